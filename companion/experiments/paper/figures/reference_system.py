"""y1 of a flight beside that of the closed-loop reference system."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.experiments.paper.results import PaperResults, ReferenceComparison
from companion.report.pages.style import (
    AXES,
    COLOURS,
    L1,
    MUTED,
    SHOULD_BE,
    name_of,
    new_figure,
    note,
    say,
    thin,
)

_NEAR = 2.5
"""A bound within this many times the curves' reach is drawn; a farther one would squash them."""
_MM = 1e3


def caption(results: PaperResults) -> str:
    """What is drawn."""
    gamma_1 = results.guarantees.gamma_1_m_s
    said = "; ".join(
        f"{flight_name(one)}: "
        + ", ".join(f"{a} {v * _MM:.0f}" for a, v in zip(AXES, one.largest_m_s, strict=True))
        for one in results.reference
    )
    shown = flight_name(results.reference[0]) if results.reference else "no flight"
    return (
        f"Left: the true velocity y1 in m/s ({shown}), that of the simulated closed-loop reference "
        "system y1_ref under the same r1 (dashed), and r1 itself (grey). Right: y1 − y1_ref in "
        "mm/s beside the bound γ1 ("
        + ", ".join(
            f"{a} {g:.3g} m/s" if np.isfinite(g) else f"{a} none"
            for a, g in zip(AXES, gamma_1, strict=True)
        )
        + f"). Seed {results.scale.seeds[0]}."
        + (f" Largest difference in mm/s: {said}." if said else "")
    )


def flight_name(comparison: ReferenceComparison) -> str:
    """Of a flight, with the controller's name as everywhere."""
    controller, _, rest = comparison.name.partition(",")
    return f"{name_of(controller)},{rest}" if rest else comparison.name


def draw(results: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(6.4)
    if not results.reference:
        say(figure.add_subplot(), "no flight could be compared")
        return figure
    panels = figure.subplots(3, 2, sharex="col")
    first = results.reference[0]
    for k in range(3):
        left, right = panels[k]
        left.plot(*thin(first.times_s, first.r1_m_s[:, k]), color=MUTED, lw=0.8, label="r1")
        left.plot(*thin(first.times_s, first.y1_m_s[:, k]), color=L1, lw=1.5, label="flown y1")
        left.plot(*thin(first.times_s, first.y1_ref_m_s[:, k]), **SHOULD_BE, label="y1_ref")
        left.set_title(f"{AXES[k]}, m/s")
        _draw_difference(right, k, results.reference, float(results.guarantees.gamma_1_m_s[k]))
    panels[0, 0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.1)
    for axes in panels[-1]:
        axes.set_xlabel("time since the trajectory's start, s")
    if len(results.reference) > 1:
        panels[-1, 1].legend(loc="upper center", bbox_to_anchor=(0.45, -0.3), ncols=2)
    return figure


def _draw_difference(
    axes: Axes, k: int, comparisons: Sequence[ReferenceComparison], gamma_1_m_s: float
) -> None:
    reach = 1e-3
    for one in comparisons:
        colour = COLOURS.get(one.name.partition(",")[0], L1)
        values = (one.y1_m_s[:, k] - one.y1_ref_m_s[:, k]) * _MM
        axes.plot(*thin(one.times_s, values), color=colour, lw=1.1, label=flight_name(one))
        reach = max(reach, float(np.nanmax(np.abs(values), initial=0.0)))
    bound = gamma_1_m_s * _MM
    if np.isfinite(bound) and bound <= _NEAR * reach:
        for sign in (1.0, -1.0):
            axes.axhline(sign * bound, **SHOULD_BE)
        axes.set_ylim(-1.25 * bound, 1.25 * bound)
        note(axes, f"bound γ1 = ±{gamma_1_m_s:.3g} m/s")
    else:
        axes.set_ylim(-1.2 * reach, 1.45 * reach)
        if np.isfinite(bound):
            note(axes, f"bound γ1 = ±{gamma_1_m_s:.3g} m/s: {bound / reach:.0f} × what is drawn")
        else:
            note(axes, "no bound γ1: the conditions do not hold")
    axes.set_title(f"{AXES[k]}: y1 − y1_ref, mm/s")
