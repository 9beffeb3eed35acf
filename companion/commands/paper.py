"""What ``companion paper`` does: fly the study, judge the claims, draw, write, tell."""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from companion.experiments.flight_store import need_pyarrow
from companion.experiments.paper.claims import judge_claims
from companion.experiments.paper.export import write_results
from companion.experiments.paper.report import draw_figures, write_report
from companion.experiments.paper.results import Claim, PaperResults
from companion.experiments.paper.scale import FULL, QUICK
from companion.experiments.paper.statistics import millimetres
from companion.experiments.paper.study import run_study
from companion.experiments.progress import ProgressDisplay
from companion.experiments.workers import default_jobs

_WIDE = 120
_COLOURS = {"reproduced": "green", "partly": "yellow", "not reproduced": "red"}


@dataclass(frozen=True, slots=True)
class PaperRequest:
    """The options of the command line."""

    quick: bool
    out: Path | None = None
    jobs: int | None = None


def run_paper(request: PaperRequest) -> Path:
    """Run the study as asked and tell about it.

    Returns:
        The report's path.

    Raises:
        ConfigError: a shipped file that the study needs can't be used.
        MissingExtraError: a library of the extra `study` is not installed.
        CampaignInterruptedError: Ctrl-C; the same command goes on from there.
        OSError: the folder can't be written.
    """
    need_pyarrow()
    scale = QUICK if request.quick else FULL
    folder = request.out or Path("paper-quick" if request.quick else "paper")
    folder.mkdir(parents=True, exist_ok=True)
    jobs = request.jobs or default_jobs()
    with ProgressDisplay("the paper's experiments") as display:
        results = run_study(
            scale, folder, jobs, _command(request), progress=display, say=display.say
        )
        claims = judge_claims(results)
        display.say("drawing")
        figures = draw_figures(results, folder, jobs)
    write_results(results, claims, folder)
    report = write_report(results, claims, figures, folder)
    _tell(results, claims, report)
    return report


def _command(request: PaperRequest) -> str:
    return "companion paper" + (" --quick" if request.quick else "")


def _tell(results: PaperResults, claims: tuple[Claim, ...], report: Path) -> None:
    console = Console(file=sys.stdout, width=None if sys.stdout.isatty() else _WIDE)
    console.print(_errors_table(results))
    console.print(_claims_table(claims))
    p = results.provenance
    lost = f", {p.lost} of them lost" if p.lost else ""
    console.print(f"{p.flights} flights{lost}, {p.wall_s:.0f} s. Report: {report}", soft_wrap=True)


def _errors_table(results: PaperResults) -> Table:
    seeds = len(results.scale.seeds)
    told = "± spread over the seeds" if seeds > 1 else "one seed, no spread"
    table = Table(title=f"Mean tracking error, mm ({seeds} seed(s), {told})", title_justify="left")
    table.add_column("controller")
    table.add_column("wind")
    errors = results.tracking.errors
    for number in next(iter(errors.values()))["calm"].by_trajectory:
        table.add_column(str(number), justify="right")
    table.add_column("mean", justify="right")
    table.add_column("slew, g/s", justify="right")
    for controller, by_wind in errors.items():
        for wind, e in by_wind.items():
            cells = [millimetres(s) for s in (*e.by_trajectory.values(), e.mean)]
            slew = e.tilt_slew_g_s.mean
            table.add_row(controller, wind, *cells, f"{slew:.2f}" if math.isfinite(slew) else "–")
    return table


def _claims_table(claims: tuple[Claim, ...]) -> Table:
    table = Table(title="The paper's claims", title_justify="left")
    table.add_column("verdict", no_wrap=True)
    table.add_column("claim")
    for claim in claims:
        colour = _COLOURS.get(claim.verdict, "white")
        table.add_row(f"[{colour}]{claim.verdict}[/]", escape(claim.quote))
    return table
