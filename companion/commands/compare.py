"""What ``companion compare`` does: fly controllers side by side, tell, draw, write."""

import json
import shlex
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from companion.config.yaml_source import ConfigError, settings_of
from companion.experiments.campaign import Job, run_campaign
from companion.experiments.compare import Grid, contenders, evaluate, plan
from companion.experiments.controller_file import write_whole
from companion.experiments.event_recoveries import draw_events, event_flights
from companion.experiments.flight_store import FAILED, Summary
from companion.experiments.flight_task import load_task
from companion.experiments.perturbations import chosen
from companion.experiments.progress import ProgressDisplay
from companion.experiments.provenance import commit, version
from companion.experiments.workers import default_jobs
from companion.report.compare_figure import draw_comparison
from companion.report.compare_page import NAME as PAGE_NAME
from companion.report.compare_record import comparison_object
from companion.report.compare_results import Comparison, Perturbed
from companion.report.compare_table import compare_table
from companion.report.recovery_table import recovery_table

_WIDE = 150
_UNFLOWN = (FAILED, "refused")
_AGAINST = ("truth", "reported")


@dataclass(frozen=True, slots=True)
class CompareRequest:
    """The options of the command line."""

    controllers: tuple[str, ...]
    vehicle: str = "bebop2"
    autopilot: str | None = None
    setpoint: str | None = None
    trajectories: tuple[int | str, ...] = (1, 2, 3, 4, 5)
    winds: tuple[str, ...] = ("calm",)
    sensors: str | None = None
    perturb: tuple[str, ...] = ()
    seeds: int = 5
    jobs: int | None = None
    out: Path = Path("compare")
    against: str = "truth"
    whole: bool = False
    settings: tuple[str, ...] = ()
    json_output: bool = False


def run_compare(request: CompareRequest, fly: Callable[[Job], Summary] | None = None) -> Comparison:
    """Fly what has not been flown yet, and tell about all of it.

    Args:
        request: what is asked for.
        fly: what a worker does, in place of flying; a function of a module.

    Raises:
        ConfigError: nothing was begun, since a file or a name can't be used; or not one flight
            could be flown, as the table says.
        TrajectoryFileError: nor was it, for a trajectory.
        MissingExtraError: a library of the extra `study` is not installed.
        CampaignInterruptedError: Ctrl-C; the same command goes on from there.
        OSError: the folder can't be written.
    """
    grid = _grid(request)
    jobs = default_jobs() if request.jobs is None else request.jobs
    if jobs < 1:
        raise ConfigError(f"--jobs {jobs}: give at least one process.")
    planned = plan(grid, request.out / "plants")
    tasks = [task for of_cell in planned.values() for task in of_cell]
    with ProgressDisplay("comparing") as display:
        summaries = run_campaign(tasks, request.out, jobs, display, fly)
    events = event_flights(planned, summaries, request.out, request.against)
    flown = load_task(tasks[0])  # all have the same settings
    comparison = Comparison(
        vehicle=flown.config.vehicle.name,
        autopilot=flown.shim.autopilot,
        setpoint=flown.config.mission.setpoint,
        sensors=flown.shim.sensors,
        against=request.against,
        whole=request.whole,
        controllers=tuple(contender.label for contender in grid.contenders),
        winds=grid.winds,
        perturbations=tuple(Perturbed(p.name, p.says, p.bearable) for p in grid.perturbations),
        trajectories=tuple(_said(trajectory) for trajectory in grid.trajectories),
        seeds=grid.seeds,
        cells=evaluate(planned, summaries, request.against),
        command=_command(request),
        version=version(),
        commit=commit(),
        recoveries=tuple(flights.cell for flights in events),
    )
    _write(comparison, request.out)
    about = f"{comparison.vehicle}, {comparison.autopilot}"
    pictures = draw_events(events, about, request.out)
    _write_page(comparison, pictures, request.out)
    _tell(comparison, request)
    if all(summary.outcome in _UNFLOWN for summary in summaries.values()):
        reason = next(iter(summaries.values())).note
        raise ConfigError(f"not one of {len(summaries)} flights could be flown: {reason}")
    return comparison


def _grid(request: CompareRequest) -> Grid:
    if request.against not in _AGAINST:
        raise ConfigError(f"--against {request.against}: give {' or '.join(_AGAINST)}.")
    if request.seeds < 1:
        raise ConfigError(f"--seeds {request.seeds}: fly with at least one.")
    chosen_keys = {"autopilot": request.autopilot, "setpoint": request.setpoint}
    settings = settings_of(request.settings) | {
        key: value for key, value in chosen_keys.items() if value is not None
    }
    return Grid(
        contenders(request.controllers, request.vehicle),
        tuple(dict.fromkeys(request.winds)),
        chosen(request.perturb),
        tuple(dict.fromkeys(request.trajectories)),
        tuple(range(1, request.seeds + 1)),
        request.sensors,
        tuple(settings.items()),
        request.whole,
    )


def _said(trajectory: int | str) -> str:
    return str(trajectory) if isinstance(trajectory, int) else Path(trajectory).stem


def _command(request: CompareRequest) -> str:
    """The command line that makes the comparison again."""
    options: list[tuple[str, str | None]] = [
        ("vehicle", request.vehicle),
        ("autopilot", request.autopilot),
        ("setpoint", request.setpoint),
        ("sensors", request.sensors),
        ("traj", ",".join(str(trajectory) for trajectory in request.trajectories)),
        *(("wind", wind) for wind in request.winds),
        *(("perturb", name) for name in request.perturb),
        ("seeds", str(request.seeds)),
        *(("set", setting) for setting in request.settings),
        ("against", None if request.against == "truth" else request.against),
    ]
    words = ["companion", "compare", *request.controllers]
    for name, value in options:
        words += [] if value is None else [f"--{name}", value]
    return shlex.join([*words, *(["--whole"] if request.whole else [])])


def _write(comparison: Comparison, folder: Path) -> None:
    text = json.dumps(comparison_object(comparison), indent=2, ensure_ascii=False, allow_nan=False)
    write_whole(folder / "compare.json", text + "\n")
    draw_comparison(comparison, folder / "compare.png")


def _write_page(comparison: Comparison, pictures: list[Path], folder: Path) -> None:
    from companion.report.compare_page.page import write_page  # it draws: only after the flights

    write_page(comparison, pictures, folder)


def _tell(comparison: Comparison, request: CompareRequest) -> None:
    if request.json_output:
        sys.stdout.write(json.dumps(comparison_object(comparison), ensure_ascii=False) + "\n")
        return
    console = Console(file=sys.stdout, width=None if sys.stdout.isatty() else _WIDE)
    console.print(compare_table(comparison))
    if comparison.recoveries:
        console.print(recovery_table(comparison.recoveries))
    files = (PAGE_NAME, "compare.png", "compare.json")
    console.print("  ".join(str(request.out / name) for name in files), soft_wrap=True)
