"""A comparison's page: one file that needs nothing but the pictures beside it."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from companion.recording.whole_file import write_whole
from companion.report.compare_page import NAME
from companion.report.compare_page.glance import comparison_glance
from companion.report.compare_results import NOMINAL, Cell, Comparison, file_name, ratio
from companion.report.pages.templating import render_page
from companion.report.recovery import MARGIN_M

_PACKAGE = "companion.report.compare_page"
_TEMPLATE = "compare.html.j2"
_MM = 1e3


def write_page(comparison: Comparison, pictures: Sequence[Path], folder: Path) -> Path:
    """Write the page beside `compare.json`.

    Args:
        comparison: what it shows.
        pictures: of sudden events, in the folder.
        folder: of the comparison.

    Raises:
        OSError: it can't be written.
    """
    filters: dict[str, Callable[..., str]] = {
        "mm": _mm,
        "times": _times,
        "seconds": _seconds,
        "wind": file_name,
    }
    path = folder / NAME
    context = _context(comparison, pictures, folder)
    write_whole(path, render_page(_PACKAGE, _TEMPLATE, context, filters))
    return path


def _context(comparison: Comparison, pictures: Sequence[Path], folder: Path) -> dict[str, Any]:
    return {
        "glance": comparison_glance(comparison),
        "comparison": comparison,
        "rows": [_row(comparison, cell) for cell in comparison.cells],
        "perturbed": len(comparison.perturbations) > 1,
        "several": len(comparison.controllers) > 1,
        "svg": _drawing(comparison),
        "pictures": [path.name for path in pictures],
        "files": [name for name in ("compare.json", "compare.png") if (folder / name).is_file()],
        "has_flights": (folder / "flights").is_dir(),
        "margin_mm": f"{MARGIN_M * _MM:.0f}",
    }


def _row(comparison: Comparison, cell: Cell) -> dict[str, Any]:
    first = comparison.cell(comparison.controllers[0], cell.wind, cell.perturbation)
    is_first = cell.controller == comparison.controllers[0]
    says = next(p.says for p in comparison.perturbations if p.name == cell.perturbation)
    return {
        "cell": cell,
        "perturbation": says,
        "spread": "" if math.isnan(cell.spread_m) else f" ± {cell.spread_m * _MM:.1f}",
        "to_first": "" if is_first else _times(comparison.to_first(cell)),
        "to_nominal": "" if cell.perturbation == NOMINAL else _times(comparison.to_nominal(cell)),
        "slew": _number(cell.tilt_slew_rms_g_s, 2),
        "slew_to_first": (
            "" if is_first else _times(ratio(cell.tilt_slew_rms_g_s, first.tilt_slew_rms_g_s))
        ),
        "bears": comparison.bears(cell),
    }


def _drawing(comparison: Comparison) -> str:
    import matplotlib as mpl

    from companion.report.compare_figure import comparison_figure
    from companion.report.pages.inline_svg import inline_svg
    from companion.report.pages.style import FAINT, MUTED, SETTINGS
    from companion.report.pages.svg import svg_text

    with mpl.rc_context({**SETTINGS, "axes.grid": False}):
        figure = comparison_figure(comparison, small_print=MUTED, band=(FAINT, 0.4))
        return inline_svg(svg_text(figure), "comparison", "Mean tracking errors, mm")


def _mm(value_m: float, digits: int = 1) -> str:
    return _number(value_m * _MM, digits)


def _times(value: float) -> str:
    return _number(value, 2)


def _seconds(value_s: float) -> str:
    return _number(value_s, 2)


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"
