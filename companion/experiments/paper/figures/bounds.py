"""The bounds of the L1 controller: ỹ with γ0, and the position beside the ideal system's."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.experiments.paper.bounds import HOVER_S, BoundsFlight
from companion.experiments.paper.results import PaperResults
from companion.report.flight_data import Array
from companion.report.pages.style import (
    AXES,
    L1,
    L1_NOISY,
    MUTED,
    SHOULD_BE,
    SMALL,
    new_figure,
    note,
    percent,
    say,
    thin,
)

SPEED_LIMIT_M_S = 3.0
"""Of the vehicle that is flown, by its file."""
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
    said = "".join(
        _shares(label, results.bounds[name], gamma_0)
        for name, label in (("exact", "Noise-free"), ("noisy", "With noise"))
        if name in results.bounds
    )
    beyond = [a for a, g in zip(AXES, gamma_0, strict=True) if SPEED_LIMIT_M_S < g < np.inf]
    if beyond:
        said += (
            f" On {' and '.join(beyond)} γ0 is beyond the vehicle's speed limit of "
            f"{SPEED_LIMIT_M_S:g} m/s: there it is a bound and no test."
        )
    if exact is not None:
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


def _shares(label: str, flight: BoundsFlight, gamma_0_m_s: Array) -> str:
    """The largest |ỹ| as shares of the bound, as far as there is one."""
    shares = flight.largest_y_tilde_m_s / gamma_0_m_s
    bounded = np.isfinite(gamma_0_m_s)
    if not bounded.any():
        return ""
    told = ", ".join(
        f"{percent(s)} ({a})" for a, s, b in zip(AXES, shares, bounded, strict=True) if b
    )
    holds = (shares[bounded] < 1.0).all()
    return (
        f" {label}, the largest |ỹ| is {told} of the bound, which {'holds' if holds else 'fails'}."
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
    ratios = []
    bound = gamma_0_m_s * _MM
    for flight, colour, width, label in looks:
        if flight is not None:
            values = flight.y_tilde_m_s[:, k] * _MM
            axes.plot(*thin(flight.times_s, values), color=colour, lw=width, label=label)
            largest = float(np.nanmax(np.abs(values), initial=0.0))
            reach = max(reach, largest)
            if largest > 0.0:
                ratios.append(f"{bound / largest:.0f} × {label}")
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
        _write_at(axes, bound, f"bound γ0 = ±{gamma_0_m_s:.3g} m/s")
        if ratios:
            _write_at(axes, -bound, f"γ0 over the largest |ỹ|: {', '.join(ratios)}")
    else:
        axes.set_ylim(-1.2 * reach, 1.45 * reach)
        note(axes, "no bound γ0: the conditions do not hold")
    axes.set_title(f"ỹ {AXES[k]}, mm/s")


def _write_at(axes: Axes, value: float, text: str) -> None:
    """On the inner side of a horizontal line, at the right."""
    below = value > 0.0
    axes.annotate(
        text,
        (0.99, value),
        (0, -3 if below else 3),
        xycoords=axes.get_yaxis_transform(),
        textcoords="offset points",
        ha="right",
        va="top" if below else "bottom",
        fontsize=SMALL,
        color=MUTED,
    )


def _draw_position(
    axes: Axes, k: int, exact: BoundsFlight | None, noisy: BoundsFlight | None
) -> None:
    flight = exact if exact is not None else noisy
    assert flight is not None
    axes.plot(*thin(flight.times_s, flight.position_m[:, k]), color=L1, lw=1.5, label="flown y2")
    axes.plot(*thin(flight.times_s, flight.ideal_m[:, k]), **SHOULD_BE, label="ideal y2_id")
    note(axes, f"largest distance {flight.largest_distance_m[k] * _MM:.0f} mm", y=0.05)
    axes.set_title(f"{AXES[k]}, m")
