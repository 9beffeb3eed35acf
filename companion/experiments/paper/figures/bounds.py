"""The bounds of the L1 controller: ỹ with γ0, and the position beside the ideal system's."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.experiments.paper.bounds import HOVER_S, BoundsFlight
from companion.experiments.paper.figures.style import (
    AXES,
    L1,
    L1_NOISY,
    MUTED,
    SHOULD_BE,
    SMALL,
    new_figure,
    note,
    say,
    thin,
)
from companion.experiments.paper.results import PaperResults

_MM = 1e3
_LINEAR_MM_S = 3.0
"""The scale is linear up to here, and logarithmic beyond."""
_NEAR = 2.5
"""A bound within this many times the curves' reach leaves the scale linear."""


def caption(results: PaperResults) -> str:
    """What is drawn."""
    gamma_0 = results.guarantees.gamma_0_m_s
    extra = results.guarantees.noise_extra_m_s
    exact = results.bounds.get("exact")
    said = ""
    if exact is not None:
        shares = exact.largest_y_tilde_m_s / gamma_0
        said = (
            " Noise-free, the largest |ỹ| is "
            + ", ".join(f"{100 * s:.2g} % ({a})" for a, s in zip(AXES, shares, strict=True))
            + " of the bound, which holds."
            if (shares < 1.0).all()
            else " Noise-free, |ỹ| exceeds the bound on at least one axis."
        )
        said += (
            f" The position stays {exact.mean_distance_m * _MM:.0f} mm from the ideal one on "
            "average."
        )
    return (
        "The L1 controller alone, given r2 directly, in calm air: a hover of "
        f"{HOVER_S:g} s, then a straight line in space, then rest; seed {results.scale.seeds[0]}. "
        "Left: the estimation error ỹ in mm/s, noise-free (strong) and with the vehicle's "
        "measurement noise (pale), and its bound γ0 (dashed; the scale is logarithmic beyond "
        f"±{_LINEAR_MM_S:g} mm/s; with noise, "
        + ", ".join(f"{a} {e * _MM:.0f}" for a, e in zip(AXES, extra, strict=True))
        + " mm/s may come on top). Right: the true position y2 of the noise-free flight and "
        "y2_id = D(s) r2, in metres." + said
    )


def draw(results: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(6.4)
    exact, noisy = results.bounds.get("exact"), results.bounds.get("noisy")
    if exact is None and noisy is None:
        say(figure.add_subplot(), "neither of the two flights could be flown")
        return figure
    panels = figure.subplots(3, 2, sharex=True)
    for k in range(3):
        left, right = panels[k]
        _draw_error(left, k, exact, noisy, float(results.guarantees.gamma_0_m_s[k]))
        _draw_position(right, k, exact, noisy)
    for axes in panels[0]:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.1)
    for axes in panels[-1]:
        axes.set_xlabel("time since the beginning of the hover, s")
    return figure


def _draw_error(
    axes: Axes, k: int, exact: BoundsFlight | None, noisy: BoundsFlight | None, gamma_0_m_s: float
) -> None:
    looks = ((noisy, L1_NOISY, 0.7, "with noise"), (exact, L1, 1.3, "noise-free"))
    reach = 1e-3
    for flight, colour, width, label in looks:
        if flight is not None:
            values = flight.y_tilde_m_s[:, k] * _MM
            axes.plot(*thin(flight.times_s, values), color=colour, lw=width, label=label)
            reach = max(reach, float(np.nanmax(np.abs(values), initial=0.0)))
    bound = gamma_0_m_s * _MM
    if np.isfinite(bound) and bound <= _NEAR * reach:
        for sign in (1.0, -1.0):
            axes.axhline(sign * bound, **SHOULD_BE)
        axes.set_ylim(-1.25 * bound, 1.25 * bound)
        note(axes, f"bound γ0 = ±{gamma_0_m_s:.3g} m/s")
    elif np.isfinite(bound):
        axes.set_yscale("symlog", linthresh=_LINEAR_MM_S, linscale=0.6)
        axes.set_yticks([-1e3, -1e2, -1e1, 0.0, 1e1, 1e2, 1e3])
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}".replace("-", "−"))
        axes.set_ylim(-4.0 * bound, 4.0 * bound)
        for sign in (1.0, -1.0):
            axes.axhline(sign * bound, **SHOULD_BE)
        axes.annotate(
            f"bound γ0 = ±{gamma_0_m_s:.3g} m/s: {bound / reach:.0f} × the largest |ỹ|",
            (0.99, bound),
            (0, -3),
            xycoords=axes.get_yaxis_transform(),
            textcoords="offset points",
            ha="right",
            va="top",
            fontsize=SMALL,
            color=MUTED,
        )
    else:
        axes.set_ylim(-1.2 * reach, 1.45 * reach)
        note(axes, "no bound γ0: the conditions do not hold")
    axes.set_title(f"ỹ {AXES[k]}, mm/s")


def _draw_position(
    axes: Axes, k: int, exact: BoundsFlight | None, noisy: BoundsFlight | None
) -> None:
    flight = exact if exact is not None else noisy
    assert flight is not None
    axes.plot(*thin(flight.times_s, flight.position_m[:, k]), color=L1, lw=1.5, label="flown y2")
    axes.plot(*thin(flight.times_s, flight.ideal_m[:, k]), **SHOULD_BE, label="ideal y2_id")
    note(axes, f"largest distance {flight.largest_distance_m[k] * _MM:.0f} mm", y=0.05)
    axes.set_title(f"{AXES[k]}, m")
