"""`report.html`: the study on one page that needs nothing but itself."""

import math
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from companion.experiments.flight_store import MissingExtraError
from companion.experiments.paper.export import NAME as RESULTS_NAME
from companion.experiments.paper.figures.render import DrawnFigure, draw_figures
from companion.experiments.paper.figures.style import name_of, seeds_text
from companion.experiments.paper.headline import MeanError, mean_errors, verdict_counts
from companion.experiments.paper.inline_svg import colour_rules, inline_svg
from companion.experiments.paper.results import Claim, PaperResults, Verdict
from companion.experiments.paper.scale import TRAJECTORIES, VEHICLE
from companion.experiments.paper.statistics import Spread
from companion.trajectories.harmonic import TEST_TRAJECTORIES

__all__ = ["NAME", "DrawnFigure", "draw_figures", "need_report_libraries", "write_report"]

NAME = "report.html"
_TEMPLATE = "report.html.j2"
_MM = 1e3
_SIGNS: dict[Verdict, str] = {
    "reproduced": "✓",
    "partly": "◐",
    "not reproduced": "✗",
    "not tested": "–",
}


def need_report_libraries() -> None:
    """Fail now rather than after the flights.

    Raises:
        MissingExtraError: jinja2 is not installed.
    """
    _jinja()


def write_report(
    results: PaperResults, claims: Sequence[Claim], figures: Sequence[DrawnFigure], folder: Path
) -> Path:
    """Write `report.html` into the study's folder.

    Args:
        results: of the study.
        claims: judged.
        figures: drawn into the folder.
        folder: of the study; the page links to what else lies in it.

    Raises:
        MissingExtraError: jinja2 is not installed.
        OSError: a figure can't be read, or the page not written.
    """
    jinja = _jinja()
    environment = jinja.Environment(
        loader=jinja.PackageLoader("companion.experiments.paper"),
        autoescape=True,
        undefined=jinja.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"mm": _millimetres, "times": _times, "slew": _slew, "name": name_of}
    page = environment.get_template(_TEMPLATE).render(_context(results, claims, figures, folder))
    path = folder / NAME
    path.write_text(page, encoding="utf-8")
    return path


def _jinja() -> ModuleType:
    try:
        import jinja2
    except ImportError as error:
        raise MissingExtraError(
            "The page is made with jinja2, which is missing: pip install 'companion[study]'"
        ) from error
    return jinja2


def _context(
    results: PaperResults, claims: Sequence[Claim], figures: Sequence[DrawnFigure], folder: Path
) -> dict[str, Any]:
    errors = mean_errors(results)
    return {
        "scale": results.scale,
        "seeds": seeds_text(results.scale.seeds),
        "vehicle": VEHICLE,
        "provenance": results.provenance,
        "summary": _summary(errors),
        "counts": verdict_counts(claims),
        "signs": _SIGNS,
        "claims": claims,
        "mean_errors": errors,
        "errors": {one.controller: results.tracking.errors[one.controller] for one in errors},
        "trajectories": {number: TEST_TRAJECTORIES[number].name for number in TRAJECTORIES},
        "commanded_minus_flown_m": _finite(results.tracking.commanded_minus_flown_m),
        "figures": [_figure(figure, folder) for figure in figures],
        "results_name": RESULTS_NAME,
        "light_colours": colour_rules(dark=False),
        "dark_colours": colour_rules(dark=True),
    }


def _figure(figure: DrawnFigure, folder: Path) -> dict[str, str]:
    description = f"{figure.title}. {figure.caption.partition('. ')[0]}."
    return {
        "name": figure.name,
        "title": figure.title,
        "caption": figure.caption,
        "svg": inline_svg(figure.svg.read_text(encoding="utf-8"), figure.name, description),
        "png_link": figure.png.relative_to(folder).as_posix(),
        "svg_link": figure.svg.relative_to(folder).as_posix(),
    }


def _summary(errors: Sequence[MeanError]) -> str:
    own, others = errors[0], {one.controller: one for one in errors[1:]}
    if not math.isfinite(own.calm.mean):
        return "MPC-L1 did not fly all five trajectories to their end in calm air."
    text = (
        f"MPC-L1 flies the five trajectories with a mean error of {_millimetres(own.calm)} mm in "
        f"calm air and {_millimetres(own.fan)} mm with the fan "
        f"({_times(own.fan_over_calm)} the calm one)."
    )
    shown = [others[name] for name in ("pid-l1", "lqr-l1", "mpc-pid") if name in others]
    for wind, ratios in (
        ("In calm air", [one.calm_over_mpc_l1 for one in shown]),
        ("With the fan", [one.fan_over_mpc_l1 for one in shown]),
    ):
        parts = [
            f"{name_of(one.controller)} makes {_times(ratio)}"
            for one, ratio in zip(shown, ratios, strict=True)
            if math.isfinite(ratio)
        ]
        if parts:
            text += f" {wind}, {', '.join(parts)} its error."
    return text


def _millimetres(spread: Spread) -> str:
    """Mean ± spread, or how many were lost."""
    if spread.lost:
        return "lost" if spread.seeds == 1 else f"lost {spread.lost} of {spread.seeds}"
    if not math.isfinite(spread.mean):
        return "–"
    text = f"{spread.mean * _MM:.1f}"
    return f"{text} ± {spread.std * _MM:.1f}" if math.isfinite(spread.std) else text


def _slew(value_g_s: float) -> str:
    return f"{value_g_s:.2f}" if math.isfinite(value_g_s) else "–"


def _times(ratio: float) -> str:
    if not math.isfinite(ratio):
        return "–"
    return f"{ratio:.2f}\u00a0×" if ratio < 9.95 else f"{ratio:.0f}\u00a0×"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
