"""What ``companion faults`` does: fly the table of faults, judge, write, tell."""

import json
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from companion.config.yaml_source import ConfigError
from companion.experiments.faults.flying import Order, Verdict, orders
from companion.experiments.faults.page import seconds, write_page
from companion.experiments.faults.study import Result, Unflown, run_study
from companion.experiments.faults.table import (
    FLAVOURS,
    Flavour,
    chosen_rows,
    load_table,
)
from companion.experiments.faults.written import (
    NAME,
    Made,
    RowResult,
    by_row,
    counts,
    faults_object,
    passed,
)
from companion.experiments.progress import ProgressDisplay
from companion.experiments.provenance import commit, version
from companion.experiments.workers import default_jobs
from companion.recording.whole_file import write_whole

_WIDE = 160
_COLOURS = {"passed": "green", "failed": "bold red", "not flown": "dim"}


@dataclass(frozen=True, slots=True)
class FaultsRequest:
    """The options of the command line."""

    table: Path | None = None
    only: tuple[str, ...] = ()
    autopilot: str = "both"
    jobs: int | None = None
    seed: int = 1
    out: Path = Path("faults")
    json_output: bool = False


def run_faults(request: FaultsRequest, fly: Callable[[Order], Verdict] | None = None) -> bool:
    """Fly the table as asked and tell about it.

    Args:
        request: what is asked for.
        fly: what a worker does, in place of flying; a function of a module.

    Returns:
        Whether every row that was flown passed.

    Raises:
        ConfigError: the table can't be used, or has no such row; nothing was flown.
        StudyInterruptedError: Ctrl-C.
        OSError: the folder can't be written.
    """
    table = load_table(request.table)
    rows = chosen_rows(table, request.only)
    flavours = _flavours(request.autopilot)
    request.out.mkdir(parents=True, exist_ok=True)
    planned = [
        order
        for order in orders(table, rows, request.out, request.seed)
        if order.autopilot in flavours
    ]
    started_s = time.perf_counter()
    with ProgressDisplay("faults") as display:
        results = run_study(planned, request.jobs or default_jobs(), display, fly)
    made = Made(
        version(), commit(), request.seed, time.perf_counter() - started_s, _command(request)
    )
    told = [
        result for result in by_row(rows, results) if result.flights or result.row.kind == "process"
    ]
    written = faults_object(told, made)
    text = json.dumps(written, indent=2, ensure_ascii=False, allow_nan=False)
    write_whole(request.out / NAME, text + "\n")
    page = write_page(told, made, request.out)
    if request.json_output:
        sys.stdout.write(json.dumps(written, ensure_ascii=False, allow_nan=False) + "\n")
    else:
        _tell(told, page)
    return all(passed(result) for result in results)


def _flavours(autopilot: str) -> tuple[Flavour, ...]:
    if autopilot == "both":
        return FLAVOURS
    chosen = tuple(flavour for flavour in FLAVOURS if flavour == autopilot)
    if not chosen:
        raise ConfigError(f"--autopilot {autopilot}: give px4, ardupilot or both.")
    return chosen


def _command(request: FaultsRequest) -> str:
    words = ["companion", "faults"]
    if request.table is not None:
        words.append(str(request.table))
    for name in request.only:
        words += ["--only", name]
    if request.autopilot != "both":
        words += ["--autopilot", request.autopilot]
    words += ["--seed", str(request.seed)]
    return shlex.join(words)


def _tell(results: Sequence[RowResult], page: Path) -> None:
    console = Console(file=sys.stdout, width=None if sys.stdout.isatty() else _WIDE)
    table = Table(box=None, pad_edge=False, header_style="dim")
    for name in ("fault", "autopilot", "verdict", "ended", "seen after", "mean error"):
        table.add_column(name, no_wrap=True)
    for result in results:
        if not result.flights:
            told = "run by pytest -m faults"
            table.add_row(result.row.name, "", f"[dim]{told}[/]", "", "", "")
        for flight in result.flights:
            table.add_row(result.row.name, *_cells(flight))
    console.print(table)
    for result in results:
        for flight in result.flights:
            if not passed(flight):
                _tell_failure(console, flight)
    console.print(_summary(results), soft_wrap=True)
    console.print(f"{page}  {page.with_name(NAME)}", soft_wrap=True)


def _cells(flight: Result) -> tuple[str, ...]:
    verdict = "passed" if passed(flight) else "failed"
    marked = f"[{_COLOURS[verdict]}]{verdict}[/]"
    if isinstance(flight, Unflown):
        return flight.autopilot, marked, "not flown", "", ""
    measured = flight.judgement.measured
    error = measured.mean_error_mm
    return (
        flight.autopilot,
        marked,
        measured.ending,
        seconds(measured.detected_after_s),
        f"{error:.0f} mm" if error == error else "–",
    )


def _tell_failure(console: Console, flight: Result) -> None:
    console.print(f"\n[bold red]failed[/] {escape(flight.row)} ({flight.autopilot})")
    if isinstance(flight, Unflown):
        console.print(f"  {escape(flight.reason)}", soft_wrap=True)
        return
    for sentence in flight.judgement.broken:
        console.print(f"  {escape(sentence)}", soft_wrap=True)
    console.print(f"  again: {escape(flight.command)}", soft_wrap=True)
    if flight.folder is not None:
        console.print(f"  its log: {escape(str(flight.folder))}", soft_wrap=True)


def _summary(results: Sequence[RowResult]) -> str:
    found = counts(results)
    rest = f", {found['not flown']} run by pytest -m faults" if found["not flown"] else ""
    rows = "row" if found["passed"] == 1 else "rows"
    return f"\n{found['passed']} {rows} passed, {found['failed']} failed{rest}."
