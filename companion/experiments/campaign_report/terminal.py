"""The report on a terminal of 80 columns."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console, RenderableType
from rich.console import Group as Together
from rich.table import Table
from rich.text import Text

from companion.experiments.campaign_report.influence import ALL, CONTROLLER
from companion.experiments.campaign_report.report import Report
from companion.experiments.campaign_report.summary import index_text, mm
from companion.experiments.campaign_report.tables import Case

_MOST_ROWS = 12
_MOST_CASES = 3
_COMMAND = "  "
"""What a line begins with that is a command to copy."""


def tell(console: Console, report: Report, page: Path) -> None:
    """Show what a person reads first; commands and paths are not wrapped, to be copied."""
    console.print(_answers(report))
    worst = sorted(report.worst, key=lambda case: -case.mean_error_m)
    for line in (*_again("Worst that tracked", worst), *_again("Lost", report.lost)):
        console.print(line, soft_wrap=line.plain.startswith(_COMMAND))
    console.print(Text(f"\n{page}"), soft_wrap=True)


def _answers(report: Report) -> RenderableType:
    summary = report.summary
    said: list[RenderableType] = [Text(f"Campaign {report.campaign.manifest.name}", "bold")]
    if summary.state:
        said.append(Text(summary.state, "yellow"))
    for title, sentences in (
        ("Did it track?", summary.tracked),
        ("Where does it break?", summary.breaks),
        ("What hurts most?", summary.hurts),
    ):
        if sentences:
            said += [Text(), Text(title, "bold"), *(Text(one) for one in sentences)]
    said += [Text(), _errors(report)]
    if report.sensitivity.of(ALL, "error"):
        said += [Text(), _sensitivity(report)]
    said += [Text(), Text("Intervals are those of 95 % confidence.", "dim")]
    return Together(*said)


def _errors(report: Report) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim", title_justify="left")
    table.title = Text("Flights, and their mean errors in mm", "bold")
    table.add_column("by")
    for name in ("flights", "lost", "median", "mean", "p90", "p99", "worst"):
        table.add_column(name, justify="right", no_wrap=True)
    by = [group for group in report.groups if group.by in ((), (CONTROLLER,), ("wind",))]
    by += [group for group in report.groups if group.by == ("trajectory",)]
    for group in by[:_MOST_ROWS]:
        error = group.mean_error
        values = (error.median, error.mean, error.p90, error.p99, error.worst)
        lost = Text(str(group.lost.count), "red" if group.lost.count else "")
        label = " ".join((*group.by, *group.values)) or "all"
        table.add_row(Text(label), str(group.flights), lost, *(mm(value, "") for value in values))
    return table


def _sensitivity(report: Report) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim", title_justify="left")
    table.title = Text("What decides the error: share of its rank's variance", "bold")
    table.add_column("parameter")
    table.add_column("share", no_wrap=True)
    table.add_column("median error at")
    for one in report.sensitivity.of(ALL, "error")[:_MOST_ROWS]:
        at = f"{one.best}: {mm(one.best_value)}; {one.worst}: {mm(one.worst_value)}"
        style = "" if one.seen else "dim"
        table.add_row(Text(one.parameter), index_text(one), Text(at), style=style)
    return table


def _again(title: str, cases: Sequence[Case]) -> list[Text]:
    if not cases:
        return []
    said = [Text(), Text(f"{title}, to fly again", "bold")]
    for case in cases[:_MOST_CASES]:
        told = case.note.partition("\n")[0] if case.lost else mm(case.mean_error_m)
        where = ", ".join(f"{name} {value}" for name, value in case.told.items())
        at = f" at {where}" if where else ""
        said += [Text(f"point {case.point}: {told}{at}"), Text(f"{_COMMAND}{case.command}", "dim")]
    return said
