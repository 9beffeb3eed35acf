"""`report.html`: the study on one page that needs nothing but itself."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from companion.experiments.paper.export import NAME as RESULTS_NAME
from companion.experiments.paper.figures.render import DrawnFigure, draw_figures
from companion.experiments.paper.glance import study_glance
from companion.experiments.paper.headline import MeanError, mean_errors, verdict_counts
from companion.experiments.paper.results import Claim, PaperResults, Verdict
from companion.experiments.paper.scale import TRAJECTORIES, VEHICLE
from companion.experiments.paper.statistics import millimetres
from companion.report.pages.inline_svg import inline_svg
from companion.report.pages.style import name_of, seeds_text
from companion.report.pages.templating import render_page
from companion.trajectories.harmonic import TEST_TRAJECTORIES

__all__ = ["NAME", "DrawnFigure", "draw_figures", "write_report"]

NAME = "report.html"
_TEMPLATE = "report.html.j2"
_SIGNS: dict[Verdict, str] = {
    "reproduced": "✓",
    "partly": "◐",
    "not reproduced": "✗",
    "not tested": "–",
}
_SUMMARISED = (
    {"mpc-pid": "MPC-PID by the paper's recipe", "mpc-pid-joint": "MPC-PID tuned as a whole"},
    {"pid-l1": "PID-L1", "lqr-l1": "LQR-L1"},
)
"""Controllers of the summary in its order, by clause."""
_CHATTERS = 2.0
"""Times the tilt slew of MPC-L1."""


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
        OSError: a figure can't be read, or the page not written.
    """
    filters: dict[str, Callable[..., str]] = {
        "mm": millimetres,
        "times": _times,
        "slew": _slew,
        "name": name_of,
    }
    context = _context(results, claims, figures, folder)
    page = render_page("companion.experiments.paper", _TEMPLATE, context, filters)
    path = folder / NAME
    path.write_text(page, encoding="utf-8")
    return path


def _context(
    results: PaperResults, claims: Sequence[Claim], figures: Sequence[DrawnFigure], folder: Path
) -> dict[str, Any]:
    errors = mean_errors(results)
    return {
        "glance": study_glance(results, claims, errors),
        "scale": results.scale,
        "seeds": seeds_text(results.scale.seeds),
        "vehicle": VEHICLE,
        "provenance": results.provenance,
        "summary": _summary(results, errors),
        "counts": verdict_counts(claims),
        "signs": _SIGNS,
        "claims": claims,
        "mean_errors": errors,
        "errors": {one.controller: results.tracking.errors[one.controller] for one in errors},
        "trajectories": {number: TEST_TRAJECTORIES[number].name for number in TRAJECTORIES},
        "commanded_minus_flown_m": _finite(results.tracking.commanded_minus_flown_m),
        "figures": [_figure(figure, folder) for figure in figures],
        "results_name": RESULTS_NAME,
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


def _summary(results: PaperResults, errors: Sequence[MeanError]) -> str:
    own, others = errors[0], {one.controller: one for one in errors[1:]}
    if not math.isfinite(own.calm.mean):
        return "MPC-L1 did not fly all five trajectories to their end in calm air."
    text = (
        "MPC-L1 flies the five trajectories with a mean error of "
        f"{millimetres(own.calm, ' mm')} in calm air"
    )
    if math.isfinite(own.fan.mean):
        text += f" and {millimetres(own.fan, ' mm')} with the fan"
        text += f" ({_times(own.fan_over_calm)} the calm one)."
    else:
        text += "; with the fan it did not fly all five to their end."
    for wind, ratios in (
        ("In calm air", {name: one.calm_over_mpc_l1 for name, one in others.items()}),
        ("With the fan", {name: one.fan_over_mpc_l1 for name, one in others.items()}),
    ):
        clauses = [_clause(names, ratios) for names in _SUMMARISED]
        if any(clauses):
            text += f" {wind}, {'; '.join(clause for clause in clauses if clause)}."
    return text + _chatter(results)


def _clause(names: Mapping[str, str], ratios: Mapping[str, float]) -> str:
    """Like "A makes 2 ×, B 3 × its error", of those that came to the end."""
    shown = [
        (told, _times(ratios[name]))
        for name, told in names.items()
        if math.isfinite(ratios.get(name, math.nan))
    ]
    if not shown:
        return ""
    (first, ratio), *rest = shown
    # What they have in common is said once.
    shorter = [(told.removeprefix("MPC-PID "), times) for told, times in rest]
    said = [f"{first} makes {ratio}", *(f"{told} {times}" for told, times in shorter)]
    return f"{', '.join(said)} its error"


def _chatter(results: PaperResults) -> str:
    """What the errors do not show of an MPC-PID near instability, when its flights do."""
    by_name = results.tracking.errors
    own, paper = (by_name[name]["calm"].tilt_slew_g_s.mean for name in ("mpc-l1", "mpc-pid"))
    if not (math.isfinite(own) and math.isfinite(paper) and paper >= _CHATTERS * own):
        return ""
    text = (
        " MPC-PID by the paper's recipe chatters, as a loop near instability does: its tilt "
        f"command moves at {_slew(paper)} g/s rms in calm air, that of MPC-L1 at {_slew(own)} g/s"
    )
    joint = by_name["mpc-pid-joint"]["calm"].tilt_slew_g_s.mean
    if math.isfinite(joint):
        text += f", that of MPC-PID tuned as a whole at {_slew(joint)} g/s"
    return text + "."


def _slew(value_g_s: float) -> str:
    return f"{value_g_s:.2f}" if math.isfinite(value_g_s) else "–"


def _times(ratio: float) -> str:
    if not math.isfinite(ratio):
        return "–"
    return f"{ratio:.2f}\u00a0×" if ratio < 9.95 else f"{ratio:.0f}\u00a0×"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
