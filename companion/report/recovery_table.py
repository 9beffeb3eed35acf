"""The recoveries of a comparison as a table for a terminal."""

import math
from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table
from rich.text import Text

from companion.report.compare_results import NOMINAL
from companion.report.recovery import MARGIN_M
from companion.report.recovery_cell import RecoveryCell

_MM = 1e3


def recovery_table(cells: Sequence[RecoveryCell]) -> Table:
    """A row for each cell."""
    perturbed = any(cell.perturbation != NOMINAL for cell in cells)
    table = Table(
        title="sudden events: greatest errors after them, and the time until the error is within "
        f"{MARGIN_M * _MM:.0f} mm of what it was before",
        title_justify="left",
    )
    table.add_column("event")
    if perturbed:
        table.add_column("perturbation", no_wrap=True)
    table.add_column("controller", no_wrap=True)
    for name in ("height mm", "sideways mm", "back after s", "longest s"):
        table.add_column(name, justify="right")
    table.add_column("outcome")
    for cell in cells:
        row = [escape(cell.event), *([cell.perturbation] if perturbed else [])]
        table.add_row(
            *row,
            escape(cell.controller),
            f"{cell.peak_height_m * _MM:.0f}",
            f"{cell.peak_horizontal_m * _MM:.0f}",
            _seconds(cell.recovery_s),
            _seconds(cell.longest_recovery_s),
            _outcome(cell),
        )
    return table


def _seconds(time_s: float) -> str:
    return f"{time_s:.2f}" if math.isfinite(time_s) else "–"


def _outcome(cell: RecoveryCell) -> Text:
    if not cell.not_back:
        return Text(f"all {cell.flown} back")
    return Text(f"{cell.not_back} of {cell.flown} not back", style="yellow")
