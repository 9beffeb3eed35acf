"""The picture of an identification: what was measured, what the model makes of it, what is left."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from companion.identification.estimates import Estimate, FittedCurve, Identified, Response
from companion.identification.recording import Array

_MEASURED, _FITTED, _COMMANDED, _RESIDUAL = "#1f4e79", "#c0392b", "#95a5a6", "#6c3483"
_COLUMNS = 3
_GAP_S = 0.3
"""Longer than that between two samples, a curve is interrupted."""
_TITLES = {
    "roll": "roll",
    "pitch": "pitch",
    "lift": "vertical acceleration by thrust",
    "climb": "climb rate",
    "x": "x: push by tilt and drag",
    "y": "y: push by tilt and drag",
}

Panel = Any
"""matplotlib's axes; it is imported only when something is drawn."""


def draw_identification(identified: Identified, title: str, path: Path) -> None:
    """Draw the fit over the data for each axis, its residual below.

    Args:
        identified: with its curves.
        title: of the figure.
        path: of the image.

    Raises:
        OSError: the file can't be written.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(curve.name for curve in identified.curves))
    columns = min(_COLUMNS, max(1, len(names)))
    rows = max(1, math.ceil(len(names) / columns))
    figure = Figure(figsize=(5.2 * columns, 4.6 * rows + 0.5))
    figure.suptitle(title, fontsize=13, x=0.03, y=0.99, ha="left")
    grid = figure.add_gridspec(
        rows, columns, left=0.055, right=0.985, bottom=0.09 / rows + 0.02, top=1.0 - 0.2 / rows,
        hspace=0.32, wspace=0.22,
    )  # fmt: skip
    for k, name in enumerate(names):
        both = grid[k // columns, k % columns].subgridspec(2, 1, height_ratios=(3, 1), hspace=0.08)
        upper = figure.add_subplot(both[0])
        lower = figure.add_subplot(both[1], sharex=upper)
        curves = [curve for curve in identified.curves if curve.name == name]
        _draw(upper, lower, curves, _found(identified, name))
    figure.savefig(path, dpi=110)


def _draw(upper: Panel, lower: Panel, curves: list[FittedCurve], found: str) -> None:
    """One axis: all of its curves in one panel, end to end."""
    parts = [_interrupted(curve) for curve in sorted(curves, key=lambda c: float(c.time_s[0]))]
    time, measured, fitted, commanded = (np.concatenate(column) for column in zip(*parts))  # noqa: B905
    time = _without_gaps(time)
    if np.isfinite(commanded).any():
        upper.plot(time, commanded, color=_COMMANDED, lw=1.0, label="commanded")
    upper.plot(time, measured, color=_MEASURED, lw=1.0, label="measured")
    upper.plot(time, fitted, color=_FITTED, lw=1.3, label="model")
    residual = measured - fitted
    rms = float(np.sqrt(np.nanmean(residual**2)))
    lower.plot(time, residual, color=_RESIDUAL, lw=0.8, label=f"residual, rms {rms:.2g}")
    name, quantity = curves[0].name, curves[0].quantity
    upper.set_title(f"{_TITLES.get(name, name)}: {found}", fontsize=8.5, loc="left")
    upper.set_ylabel(quantity, fontsize=8)
    upper.tick_params(labelsize=7, labelbottom=False)
    lower.tick_params(labelsize=7)
    lower.set_xlabel("time of the excitation, s", fontsize=8)
    for panel in (upper, lower):
        panel.grid(alpha=0.3, lw=0.5)
        panel.legend(fontsize=7, framealpha=0.8, edgecolor="none", loc="upper right")


def _interrupted(curve: FittedCurve) -> tuple[Array, Array, Array, Array]:
    """Time, measured, fitted and commanded, with a NaN behind each of its parts."""
    ends = np.append(np.flatnonzero(np.diff(curve.time_s) > _GAP_S) + 1, len(curve.time_s))
    columns = (curve.measured, curve.fitted, curve.commanded)
    measured, fitted, commanded = (np.insert(column, ends, np.nan) for column in columns)
    time = np.insert(curve.time_s, ends, curve.time_s[ends - 1] + 1e-3)
    return time, measured, fitted, commanded


def _without_gaps(time_s: Array) -> Array:
    """Time from 0 in which what lies between two parts is cut out."""
    steps = np.diff(time_s, prepend=time_s[0])
    steps[steps > _GAP_S] = _GAP_S
    shortened: Array = np.cumsum(steps)
    return shortened


def _found(identified: Identified, name: str) -> str:
    """The figures of an axis, short."""
    if name in ("x", "y"):
        drag, square = identified.linear_drag_1_s, identified.quadratic_drag_1_m
        return (
            f"tilt gain {_short(identified.tilt_gain)}\n"
            f"drag {_short(drag)} 1/s, {_short(square)} 1/m"
        )
    response: Response | None = getattr(identified, name, None)
    if response is None:
        return ""
    return (
        f"ωn {_short(response.natural_frequency_rad_s)} rad/s, ζ {_short(response.damping)}\n"
        f"dead time {_short(response.dead_time_s, 1e3)} ms, gain {_short(response.gain)}"
    )


def _short(estimate: Estimate, scale: float = 1.0) -> str:
    return f"{estimate.value * scale:.3g} ± {estimate.half_width_95 * scale:.2g}"
