"""What ``companion tune`` does: search for a baseline's gains by flying, write them down, tell."""

import json
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TextIO

from companion.config.models import ControllerConfig
from companion.config.resolve import FlightConfig, controller_path
from companion.config.validation import validate
from companion.config.yaml_source import ConfigError, parse_yaml, read_yaml
from companion.experiments.attitude_lag import attitude_lag
from companion.experiments.controller_file import controller_yaml, write_whole
from companion.experiments.flight_task import FlightTask, load_task
from companion.experiments.identify_steps import SecondOrder, StepTask, UnidentifiedError, identify
from companion.experiments.perturbed_plant import write_plant
from companion.experiments.progress import ProgressDisplay
from companion.experiments.tuned_gains import (
    TUNED,
    TUNED_BELOW_MPC,
    Array,
    Gains,
    TunedGain,
    as_settings,
    point_of,
    with_gains,
)
from companion.experiments.tuning import Evaluation, Trial, TuningResult, tune
from companion.experiments.tuning_flights import FlownCosts, flight_cost
from companion.experiments.tuning_text import cost_in_words, result_lines, said_name, source_text
from companion.experiments.workers import Failure, Workers, default_jobs
from companion.flight.assemble import infeasibilities, make_trajectory

_PID = "pid"
_MPC_PID = "mpc-pid"
_AXES = ("x", "y", "z")
ATTITUDE_LAG = 1.25
"""Of the further vehicle on which gains are flown, as a factor."""


class TuningInterruptedError(Exception):
    """Ctrl-C; the text says what is there and what is not."""


@dataclass(frozen=True, slots=True)
class TuneRequest:
    """The options of the command line."""

    controller: str
    """Name, or path of a YAML file, of the controller whose gains are replaced."""
    trajectory: int | str = 4
    vehicle: str = "bebop2"
    budget: int = 300
    """Sets of gains to fly."""
    starts: int = 2
    seed: int = 1
    """Of the search and of the flights."""
    jobs: int | None = None
    out: Path | None = None
    part: str = "gains"
    """What is tuned: "gains" of a baseline; of mpc-pid, flown with its MPC, the "model" alone or
    the "whole"."""


def run_tune(request: TuneRequest, evaluate: Callable[[Gains], float] | None = None) -> Path:
    """Tune as asked and tell about it.

    Args:
        request: what is asked for.
        evaluate: a cost in place of the flights, m.

    Returns:
        The controller file that was written; beside it lies the log of every evaluation.

    Raises:
        ConfigError: nothing was begun: there is no such controller, or none to be tuned.
        TrajectoryFileError: nor was it, for the trajectory.
        MissingExtraError: a library is not installed.
        TuningInterruptedError: Ctrl-C.
        UnidentifiedError: the tuned PID flies no step that a model could be made of.
        OSError: the result can't be written.
    """
    task = FlightTask(
        request.controller, request.trajectory, seed=request.seed, vehicle=request.vehicle
    )
    config = load_task(task).config
    problems = infeasibilities(make_trajectory(config.mission), config.mission, config.vehicle)
    if problems:
        raise ConfigError("\n".join(problems))
    framework = config.controller.framework
    table = _searched(framework, request)
    if request.starts < 1 or request.budget < request.starts:
        raise ConfigError(
            f"--budget {request.budget} is too small for --starts {request.starts}: give at least "
            "one flight for each start."
        )
    jobs = default_jobs() if request.jobs is None else request.jobs
    if jobs < 1:
        raise ConfigError(f"--jobs {jobs}: give at least one process.")
    template = read_yaml(controller_path(request.controller, config.vehicle.name)).data
    alone = framework == _MPC_PID and request.part == "gains"
    if alone and request.controller != _MPC_PID:
        raise ConfigError(
            f"{request.controller}: the gains of mpc-pid are those of its PID, flown alone; tune "
            "'mpc-pid' by its name, or a file of the framework 'pid'."
        )
    if alone:
        task = FlightTask(_PID, request.trajectory, seed=request.seed, vehicle=request.vehicle)
        inner = load_task(task).config.controller.inner_pid
        assert inner is not None
        template = {**template, "inner_pid": inner.model_dump(mode="json")}
    out = _writable(request.out or _default_out(request))
    log_path = out.with_suffix(".jsonl")
    log_path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with log_path.open("w", encoding="utf-8") as log:
            first = None if request.part == "gains" else point_of(table, template)
            with TemporaryDirectory() as plants:
                tasks = _family(request, task, config, Path(plants))
                result = _search(request, tasks, (table, first), jobs, log, evaluate)
    except KeyboardInterrupt as interrupt:
        raise TuningInterruptedError(
            f"interrupted: no controller was written. What was flown is in {log_path}."
        ) from interrupt
    models: list[SecondOrder] = []
    if alone:
        models = _identify(task, result.best.gains, jobs)
    cost = "a given cost" if evaluate is not None else cost_in_words(task, _lag(request))
    said = source_text(_command(request), cost, result, models)
    data = {**with_gains(template, result.best.gains), "source": said}
    if models:
        data |= _model_sections(models, config)
    remark = f"{said_name(request.controller)} for the vehicle {config.vehicle.name}, tuned."
    text = controller_yaml(remark, data)
    validate(ControllerConfig, parse_yaml(text, str(out)))
    write_whole(out, text)
    lines = [*result_lines(result, models), f"file      {out}", f"log       {log_path}"]
    sys.stdout.write("\n".join(lines) + "\n")
    return out


def _searched(framework: str, request: TuneRequest) -> tuple[TunedGain, ...]:
    """What of the framework is searched."""
    if request.part != "gains":
        if framework != _MPC_PID or request.part not in TUNED_BELOW_MPC:
            raise ConfigError(
                f"--part {request.part}: of {_MPC_PID} give one of gains, "
                f"{', '.join(TUNED_BELOW_MPC)}; of every other controller gains."
            )
        return TUNED_BELOW_MPC[request.part]
    searched = _PID if framework == _MPC_PID else framework
    if searched not in TUNED:
        raise ConfigError(
            f"{request.controller}: the framework {framework} is not tuned by flights. Those that "
            f"are: {', '.join(sorted([*TUNED, _MPC_PID]))}."
        )
    return TUNED[searched]


def _lag(request: TuneRequest) -> float | None:
    """Attitude lag of the further vehicle; the model is tuned for the one vehicle alone."""
    return None if request.part == "model" else ATTITUDE_LAG


def _family(
    request: TuneRequest, task: FlightTask, config: FlightConfig, folder: Path
) -> tuple[FlightTask, ...]:
    """The flights that each set of gains is judged by."""
    lag = _lag(request)
    if lag is None:
        return (task,)
    vehicle = config.vehicle.name
    path = folder / f"{vehicle}-attitude-lag-{lag:g}.yaml"
    plant = write_plant(vehicle, (attitude_lag(lag),), path)
    return task, replace(task, shim_vehicle=str(plant))


def _default_out(request: TuneRequest) -> Path:
    vehicle, controller = Path(request.vehicle).stem, Path(request.controller).stem
    words = [controller, vehicle]
    if request.part != "gains":
        words += [request.part, f"t{Path(str(request.trajectory)).stem}"]
    return Path("tuned") / f"{'-'.join(words)}.yaml"


def _writable(out: Path) -> Path:
    """The path of the result, which is written only after all the flights.

    Raises:
        ConfigError: it can't be written there, or the log would take its place.
    """
    if out.suffix not in (".yaml", ".yml"):
        raise ConfigError(f"--out {out}: give a file that ends in .yaml; the log lies beside it.")
    if out.is_dir():
        raise ConfigError(f"--out {out}: that is a folder. Give a file.")
    return out


def _search(
    request: TuneRequest,
    tasks: tuple[FlightTask, ...],
    search_space: tuple[tuple[TunedGain, ...], Array | None],
    jobs: int,
    log: TextIO,
    evaluate: Callable[[Gains], float] | None,
) -> TuningResult:
    """Run the search, with progress and log."""
    best: list[Trial] = []

    def on_trial(trial: Trial) -> None:
        log.write(json.dumps(asdict(trial), ensure_ascii=False) + "\n")
        log.flush()
        if not best or trial.evaluation.cost_m < best[0].evaluation.cost_m:
            best[:] = [trial]
            display.note(f"best {trial.evaluation.cost_m * 1e3:.1f} mm ({trial.start})")

    def search(costs: Any) -> TuningResult:  # noqa: ANN401 - a function or an object with a call
        return tune(
            search_space[0],
            costs,
            budget=request.budget,
            starts=request.starts,
            seed=request.seed,
            on_trial=on_trial,
            first=search_space[1],
        )

    with ProgressDisplay(f"tuning {said_name(request.controller)}") as display:
        if evaluate is not None:
            return search(lambda batch: [Evaluation(evaluate(gains)) for gains in batch])
        clock = _Clock(display, request.budget * len(tasks))
        with Workers(flight_cost, jobs) as workers:
            return search(FlownCosts(workers, tasks, clock.tick))


class _Clock:
    """Flights done, and how long the rest takes at the pace so far."""

    def __init__(self, display: ProgressDisplay, total: int) -> None:
        from time import perf_counter

        self._now_s = perf_counter
        self._began_s = perf_counter()
        self._display, self._total, self._done = display, total, 0
        display(0, total, None)

    def tick(self, _: Evaluation) -> None:
        self._done += 1
        pace = (self._now_s() - self._began_s) / self._done
        self._display(self._done, self._total, pace * (self._total - self._done))


def _identify(task: FlightTask, gains: Gains, jobs: int) -> list[SecondOrder]:
    """A model per axis of the vehicle under the tuned PID."""
    tuned = FlightTask(
        task.controller,
        task.trajectory,
        seed=task.seed,
        vehicle=task.vehicle,
        settings=as_settings(gains),
    )
    steps = [StepTask(tuned, axis) for axis in range(3)]
    with Workers(identify, min(jobs, 3)) as workers:
        results = workers.run(steps, lambda *_: None)
    models = []
    for axis, result in zip(_AXES, results, strict=True):
        if isinstance(result, Failure):
            raise UnidentifiedError(f"axis {axis}: {result.reason}")
        models.append(result)
    return models


def _model_sections(models: list[SecondOrder], config: FlightConfig) -> dict[str, Any]:
    """The sections of the MPC: the identified model, and all else as in mpc-l1."""
    mpc_l1 = read_yaml(controller_path("mpc-l1", config.vehicle.name)).data
    return {
        "mpc_model": {
            "m": [float(f"{model.m:.4g}") for model in models],
            "k": [float(f"{model.k:.4g}") for model in models],
        },
        "mpc": mpc_l1.get("mpc", {}),
    }


def _command(request: TuneRequest) -> str:
    """The command line that gives this result again; files are named without their folder."""
    return (
        f"companion tune {said_name(request.controller)} "
        f"--traj {said_name(str(request.trajectory))} --vehicle {said_name(request.vehicle)} "
        f"--budget {request.budget} --starts {request.starts} --seed {request.seed}"
        + ("" if request.part == "gains" else f" --part {request.part}")
    )
