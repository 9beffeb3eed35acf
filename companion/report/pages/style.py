"""How figures look: one table of colours, sizes of letters, and what all axes have in common.

Colours are tokens: the page puts another shade in the place of each where it is dark, so each is
used for one meaning only.  The hues are those of Okabe and Ito, told apart by the colour-blind.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.report.flight_data import Array

INK, MUTED, FAINT, PAPER = "#1f2328", "#656d76", "#d8dee4", "#ffffff"
ON_COLOUR = "#1f2329"
"""Letters on a coloured cell, the same by day and night."""
MPC_L1, MPC_L1_FAN = "#c0392b", "#eda79f"
MPC_L1_PLUS = "#b0508f"
MPC_PID, MPC_PID_FAN = "#0b63a5", "#9ec9ea"
MPC_PID_JOINT, MPC_PID_JOINT_FAN = "#3a86a8", "#b5d6e0"
PID_L1, LQR_L1 = "#e69f00", "#00876c"
L1, L1_NOISY = "#6a3d9a", "#c4b0dd"
"""The inner controller alone, without and with measurement noise."""
WIND = "#b4530a"

DARK = {
    INK: "#e6edf3",
    MUTED: "#9198a1",
    FAINT: "#343b44",
    PAPER: "#161b22",
    MPC_L1: "#f0685a",
    MPC_L1_FAN: "#f7c3bd",
    MPC_L1_PLUS: "#e08cc4",
    MPC_PID: "#4a9de0",
    MPC_PID_JOINT: "#6cb8d0",
    MPC_PID_JOINT_FAN: "#cfe8ef",
    MPC_PID_FAN: "#bfdcf5",
    PID_L1: "#f0b429",
    LQR_L1: "#2db594",
    L1: "#b394e0",
    L1_NOISY: "#6f5a94",
    WIND: "#e08a3c",
}
"""The shade of each on a dark page."""

COLOURS = {
    "mpc-l1": MPC_L1,
    "mpc-l1-plus": MPC_L1_PLUS,
    "mpc-pid": MPC_PID,
    "mpc-pid-joint": MPC_PID_JOINT,
    "pid-l1": PID_L1,
    "lqr-l1": LQR_L1,
    "l1": L1,
}
"""Of a controller, in every figure."""
NAMES = {
    "mpc-l1": "MPC-L1",
    "mpc-l1-plus": "MPC-L1+",
    "mpc-pid": "MPC-PID",
    "pid-l1": "PID-L1",
    "lqr-l1": "LQR-L1",
    "l1": "L1 alone",
    "pid-l1-error": "PID-L1, D on the error",
    "mpc-pid-joint": "MPC-PID, tuned as a whole",
}
"""Of a controller, for a person."""

WIDTH_IN = 9.0
SMALL, LETTERS = 8.5, 9.5
"""Points; at 900 pixels of width, an inch is 100 pixels."""

SETTINGS: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": LETTERS,
    "axes.titlesize": LETTERS,
    "axes.titlelocation": "left",
    "axes.labelsize": LETTERS,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.fontsize": SMALL,
    "legend.frameon": False,
    "text.color": INK,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": "none",
    "figure.facecolor": PAPER,
    "hatch.linewidth": 0.6,
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
    "svg.fonttype": "none",
    "svg.hashsalt": "companion",
}
"""matplotlib's, in force while a figure is drawn and saved."""

SHOULD_BE: dict[str, Any] = {"color": INK, "lw": 1.2, "ls": (0, (4, 2))}
"""The line of what is desired, ideal or a reference, in every figure."""

AXES = "xyz"


def new_figure(height_in: float) -> Figure:
    """An empty figure of the common width."""
    return Figure(figsize=(WIDTH_IN, height_in), layout="constrained")


def name_of(controller: str) -> str:
    """A controller's name for a person."""
    return NAMES.get(controller, controller)


def thin(times: Array, values: Array, blocks: int = 450) -> tuple[Array, Array]:
    """A long series with the least and the greatest value of each block of samples only.

    Args:
        times: (samples,)
        values: (samples,); those that are not finite are left out of a block.
        blocks: how many; two samples of each are kept.

    Returns:
        Times and values, in order; the series itself if it is short.
    """
    finite = np.isfinite(values)
    if not finite.any():
        return times[:0], values[:0]
    if len(times) <= 2 * blocks:
        return times, values
    kept: list[int] = []
    for block in np.array_split(np.arange(len(times)), blocks):
        block = block[finite[block]]
        if len(block):
            ends = {int(block[values[block].argmin()]), int(block[values[block].argmax()])}
            kept += sorted(ends)
    return times[kept], values[kept]


def smooth(times: Array, values: Array, window_s: float) -> Array:
    """Mean of `values` (samples, ...) over the last seconds, evenly sampled; fewer at first."""
    step = float(np.median(np.diff(times))) if len(times) > 1 else window_s
    total = np.cumsum(np.concatenate([np.zeros_like(values[:1]), values]), axis=0)
    high = np.arange(len(values)) + 1
    low = np.maximum(high - max(1, round(window_s / step)), 0)
    mean: Array = (total[high] - total[low]) / (high - low).reshape(-1, *[1] * (values.ndim - 1))
    return mean


def say(axes: Axes, text: str) -> None:
    """Write that there is nothing to draw, and why."""
    axes.set_axis_off()
    axes.text(0.5, 0.5, text, ha="center", va="center", color=MUTED, transform=axes.transAxes)


def note(axes: Axes, text: str, x: float = 0.99, y: float = 0.96) -> None:
    """A remark inside the axes, at the upper right unless told."""
    axes.text(
        x,
        y,
        text,
        transform=axes.transAxes,
        ha="right" if x > 0.5 else "left",
        va="top" if y > 0.5 else "bottom",
        fontsize=SMALL,
        color=MUTED,
    )


def legend_above(axes: Axes, columns: int = 4) -> None:
    """A legend where no data are: above the axes, on the right, beside the title."""
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=columns,
        borderaxespad=0.1,
        handlelength=1.5,
        columnspacing=1.1,
    )


def percent(share: float) -> str:
    """A share in per cent, fixed-point: two figures below 10 %, no more than hundredths."""
    value = 100.0 * share
    if 0.0 < abs(value) < 0.01:
        return "less than 0.01 %"
    digits = 0 if abs(value) >= 9.95 else 1 if abs(value) >= 0.995 else 2
    return f"{value:.{digits}f} %".replace("-", "−")


def seeds_text(seeds: Sequence[int]) -> str:
    """How many flights stand behind a figure."""
    if len(seeds) == 1:
        return f"one seed ({seeds[0]}), so no spread is claimed"
    return f"{len(seeds)} seeds ({seeds[0]} to {seeds[-1]}), mean ± one standard deviation"
