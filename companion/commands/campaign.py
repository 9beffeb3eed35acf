"""What ``companion campaign`` does: plan, fly what is missing, tell; or fly one point again."""

import json
import math
import shlex
import statistics
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape

from companion.config.resolve import shipped_names
from companion.config.yaml_source import ConfigError
from companion.experiments.campaign import CampaignInterruptedError, Job
from companion.experiments.campaigns.flown_before import check_point, plan_of_folder
from companion.experiments.campaigns.flying import Order, fly_campaign
from companion.experiments.campaigns.manifest import MANIFEST
from companion.experiments.campaigns.one_point import fly_point
from companion.experiments.campaigns.parcel import Flown, Parcel
from companion.experiments.campaigns.plan import Plan, load_plan
from companion.experiments.campaigns.results import RESULTS, Row
from companion.experiments.campaigns.stopping import stopped_as_by_ctrl_c
from companion.experiments.flight_store import FAILED, Summary
from companion.experiments.progress import ProgressDisplay
from companion.experiments.workers import default_jobs, prepare_workers

_WIDE = 1000
_GOOD = ("tracked", "landed")


@dataclass(frozen=True, slots=True)
class CampaignRequest:
    """The options of the command line."""

    file: str
    """Name of a shipped campaign, or path of a YAML file; for a point of one that was flown, its
    folder, too."""
    scheduler: str | None = None
    jobs: int | None = None
    out: Path | None = None
    resume: bool = False
    point: int | None = None
    json_output: bool = False
    anew: bool = False


def run_campaign_file(
    request: CampaignRequest,
    fly: Callable[[Job], Summary] | None = None,
    fly_there: Callable[[Parcel], Flown] | None = None,
) -> bool:
    """Fly a campaign, or one point of it, as asked and tell about it.

    Args:
        request: what is asked for.
        fly: what a worker does, in place of flying; a function of a module.
        fly_there: the same for a worker of a cluster.

    Returns:
        Whether every flight has a result, however it ended.

    Raises:
        ConfigError: nothing was flown, since the file or an option can't be used.
        MissingExtraError: a library of an extra is not installed.
        CampaignInterruptedError: Ctrl-C or SIGTERM, the cluster is gone, or the folder can't be
            written any more; the text says how to go on.
        FlightLogError: the folder of a point's log can't be used.
        OSError: the folder can't be written.
    """
    if request.point is not None and request.out is not None and _is_campaign(request.out):
        raise ConfigError(
            f"--out {request.out} is a campaign's folder; a point's log would lie among its files. "
            f"Give another one: --out {request.out / 'again' / str(request.point)}"
        )
    if Path(request.file).is_dir() and request.file not in shipped_names("campaign"):
        return _one_of_folder(request, Path(request.file))
    if request.point is None and request.scheduler is None:
        prepare_workers()  # sampling takes a second, and so does this
    plan = load_plan(request.file)
    console = _console(sys.stderr)
    for remark in plan.remarks:
        console.print(f"note: {remark}", style="yellow", markup=False)
    if request.point is not None:
        return _one(plan, request.point, request, console)
    jobs = default_jobs() if request.jobs is None else request.jobs
    if jobs < 1:
        raise ConfigError(f"--jobs {jobs}: give at least one process.")
    if request.scheduler is not None and request.jobs is not None:
        raise ConfigError(
            "--jobs counts processes of this computer; with --scheduler the cluster's workers fly. "
            "Leave one of the two out."
        )
    if request.anew and not request.resume:
        raise ConfigError("--anew goes with --resume: give both, or leave it out.")
    folder = request.out or Path("campaigns") / plan.config.name
    order = Order(
        plan, folder, jobs, _command(request), request.scheduler, request.resume, request.anew
    )
    started = time.perf_counter()
    try:
        with stopped_as_by_ctrl_c(), ProgressDisplay(plan.config.name) as display:
            rows = fly_campaign(order, display, fly, fly_there)
    except KeyboardInterrupt as error:
        raise CampaignInterruptedError(
            f"interrupted before anything was flown; nothing in {folder} has changed."
        ) from error
    said = _said(plan, rows, folder, time.perf_counter() - started)
    if request.json_output:
        sys.stdout.write(json.dumps(said, ensure_ascii=False, allow_nan=False) + "\n")
    else:
        _tell(said, rows)
    failed = [row for row in rows if row["outcome"] == FAILED]
    if len(failed) == len(rows):
        raise ConfigError(f"not one of {len(rows)} flights could be flown: {failed[0]['note']}")
    return not failed


def _is_campaign(folder: Path) -> bool:
    return (folder / MANIFEST).is_file()


def _one_of_folder(request: CampaignRequest, folder: Path) -> bool:
    if request.point is None:
        raise ConfigError(
            f"{folder} is a folder. Give the campaign's file (with --out {folder} --resume to go "
            "on with it), or --point N to fly one of its flights again."
        )
    plan = plan_of_folder(folder)
    console = _console(sys.stderr)
    remark = check_point(folder, plan, request.point)
    if remark is not None:
        console.print(f"note: {remark}", style="yellow", markup=False)
    return _one(plan, request.point, request, console)


def _one(plan: Plan, point: int, request: CampaignRequest, console: Console) -> bool:
    given = {
        "--scheduler": request.scheduler,
        "--jobs": request.jobs,
        "--resume": request.resume,
        "--anew": request.anew,
    }
    for option, value in given.items():
        if value:
            raise ConfigError(f"--point flies one flight, here: leave {option} out.")
    folder = request.out or Path("flights") / f"{plan.config.name}-point-{point}"
    again = fly_point(plan, point, folder)
    if again.trouble is not None:
        console.print(f"warning: {folder} is not complete: {again.trouble}", style="yellow")
    if request.json_output:
        plain = {n: _plain(value) for n, value in again.row.items()} | {"log_dir": str(folder)}
        sys.stdout.write(json.dumps(plain, ensure_ascii=False, allow_nan=False) + "\n")
        return True
    out = _console(sys.stdout)
    out.print(f"point {point} of {plan.config.name}: {again.says}", markup=False)
    note = f" ({again.row['note']})" if again.row["note"] else ""
    out.print(f"{again.row['outcome']}{note}, mean error {_mm(again.row)}", markup=False)
    out.print(str(folder), markup=False)
    return True


def _said(plan: Plan, rows: Sequence[Row], folder: Path, wall_s: float) -> dict[str, Any]:
    return {
        "campaign": plan.config.name,
        "engine": plan.config.engine,
        "flights": len(rows),
        "outcomes": dict(Counter(row["outcome"] for row in rows).most_common()),
        "median_error_m": _median(rows),
        "results": str(folder / RESULTS),
        "wall_s": round(wall_s, 3),
    }


def _median(rows: Sequence[Row]) -> float | None:
    errors = [row["mean_error_m"] for row in rows if math.isfinite(row["mean_error_m"])]
    return statistics.median(errors) if errors else None


def _tell(said: dict[str, Any], rows: Sequence[Row]) -> None:
    console = _console(sys.stdout)
    outcomes = ", ".join(f"{count} {escape(name)}" for name, count in said["outcomes"].items())
    console.print(f"{said['flights']} flights: {outcomes}")
    median = said["median_error_m"]
    if median is not None:
        console.print(f"mean error: {1e3 * median:.1f} mm in the median of those that tracked")
    reasons = Counter(str(row["note"]) for row in rows if row["outcome"] == FAILED)
    for reason, count in reasons.most_common(3):
        console.print(f"failed {count} times: {escape(reason)}; --resume flies them again")
    console.print(escape(said["results"]))


def _mm(row: Row) -> str:
    error = float(row["mean_error_m"])
    return f"{1e3 * error:.1f} mm" if math.isfinite(error) else "none: it did not track to the end"


def _plain(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _command(request: CampaignRequest) -> str:
    """The command line that goes on with a campaign, but for --resume."""
    words = ["companion", "campaign", request.file]
    options = (("--scheduler", request.scheduler), ("--jobs", request.jobs), ("--out", request.out))
    for name, value in options:
        words += [] if value is None else [name, str(value)]
    return shlex.join(words)


def _console(stream: Any) -> Console:  # noqa: ANN401 - a text stream
    width = None if stream.isatty() else _WIDE
    return Console(file=stream, highlight=False, width=width)
