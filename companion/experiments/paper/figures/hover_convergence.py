"""σ̂ in a hover in steady wind."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.experiments.paper.changing_dynamics import HoverConvergence
from companion.experiments.paper.results import PaperResults
from companion.report.flight_data import Array
from companion.report.pages.style import (
    INK,
    L1,
    L1_NOISY,
    MUTED,
    SHOULD_BE,
    SMALL,
    legend_above,
    new_figure,
    say,
    smooth,
    thin,
)

_WINDOW_S = 5.0
_SHOWN = (-3.0, 4.0)
"""Range of the parts that is drawn, in units of the expected value."""
_MM = 1e3


def caption(results: PaperResults) -> str:
    """What is drawn."""
    hover = results.changing_dynamics.hover
    text = (
        "A hover of MPC-L1 in steady wind of 3 m/s, from the take-over on; "
        f"seed {results.scale.seeds[0]}. Above, logarithmic, the length of the horizontal σ̂ (in "
        "the unit of u: the sine of a tilt), noise-free (strong), with measurement noise (pale) "
        f"and the mean of its last {_WINDOW_S:g} s, beside what the wind's push asks for "
        "(dashed). Below, its parts along x and y, noise-free."
    )
    if hover is None:
        return text + " It was not flown to its end."
    return text + (
        f" Without any excitation (at most {hover.largest_speed_m_s * _MM:.1f} mm/s at the end) σ̂ "
        f"settles to {hover.settled_sine:.4f}, {_off(hover.settled_sine, hover)} what is expected "
        f"({hover.expected_sine:.4f}), within {hover.settling_s:.1f} s; with noise its mean is "
        f"{hover.settled_noisy_sine:.4f}."
    )


def _off(value: float, hover: HoverConvergence) -> str:
    share = value / hover.expected_sine - 1.0
    return f"{100 * abs(share):.1f} % {'above' if share > 0.0 else 'below'}"


def draw(results: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(5.0)
    hover = results.changing_dynamics.hover
    if hover is None:
        say(figure.add_subplot(), "the hover was not flown to its end")
        return figure
    lengths, parts = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    noisy = np.linalg.norm(hover.noisy_sigma_hat[:, :2], axis=1)
    _plot(lengths, hover.noisy_times_s, noisy, L1_NOISY, 0.6, "with noise")
    calm = smooth(hover.noisy_times_s, hover.noisy_sigma_hat[:, :2], _WINDOW_S)
    length = np.linalg.norm(calm, axis=1)
    _plot(
        lengths,
        hover.noisy_times_s,
        length,
        MUTED,
        1.2,
        f"with noise, mean of the last {_WINDOW_S:g} s",
    )
    clean = np.linalg.norm(hover.sigma_hat[:, :2], axis=1)
    _plot(lengths, hover.times_s, clean, L1, 1.6, "noise-free")
    lengths.axhline(hover.expected_sine, **SHOULD_BE, label="expected: push / g")
    lengths.set_yscale("log")
    lengths.set_ylim(0.2 * hover.expected_sine, 1.2 * float(max(noisy.max(), clean.max())))
    lengths.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    lengths.set_title("length of horizontal σ̂")
    lengths.axvline(hover.settling_s, color=INK, lw=1.0, ls=":")
    lengths.annotate(
        f"within a tenth from {hover.settling_s:.1f} s on",
        (hover.settling_s, 0.97),
        (4, 0),
        xycoords=lengths.get_xaxis_transform(),
        textcoords="offset points",
        va="top",
        fontsize=SMALL,
    )
    legend_above(lengths)
    for k, colour, style in ((0, L1, "-"), (1, L1, ":")):
        times, values = thin(hover.times_s, hover.sigma_hat[:, k])
        parts.plot(times, values, color=colour, lw=1.4, ls=style, label=f"σ̂ {'xy'[k]}")
    parts.axhline(0.0, color=MUTED, lw=0.8)
    parts.set_ylim(*(share * hover.expected_sine for share in _SHOWN))
    parts.set_title("its parts, noise-free (the beginning is off the scale)")
    legend_above(parts)
    parts.set_xlabel("time since the take-over, s")
    parts.margins(x=0.01)
    return figure


def _plot(axes: Axes, times: Array, values: Array, colour: str, width: float, label: str) -> None:
    axes.plot(*thin(times, values), color=colour, lw=width, label=label)
