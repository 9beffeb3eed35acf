"""Numbers and tables as Markdown."""

import math
from collections.abc import Iterable, Sequence


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A table whose first column is text and whose others are figures."""
    lines = [_row(heads), "|---|" + "---:|" * (len(heads) - 1)]
    return [*lines, *(_row(row) for row in rows), ""]


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |"


def figure(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits, never in powers of ten but for the very small."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    if abs(value) < 1e-3:
        mantissa, _, power = f"{value:.0e}".partition("e")
        return f"{mantissa}·10^{int(power)}"
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:,.{decimals}f}".replace(",", " ")


def share(value: float) -> str:
    """A share in per cent."""
    return f"{100.0 * value:.0f} %"


def holds(reached: bool) -> str:
    """Whether a limit is kept."""
    return "holds" if reached else "**missed**"
