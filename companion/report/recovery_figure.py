"""A sudden event and what the controllers make of it, in one picture: `recovery*.png`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from companion.report.flight_data import Array, FlightData
from companion.report.metrics import reported_error_enu, true_error_enu
from companion.report.recovery import MARGIN_M, Recovery, flight_recovery

_COLOURS = ("#1f4e79", "#c0392b", "#1e8449", "#8e44ad", "#b9770e", "#566573")
_BEFORE_S, _AFTER_S = 1.0, 6.0
_ROWS = (
    "height error, mm",
    "horizontal error, mm",
    "commanded tilt, °",
    "thrust field over its mean before",
)


@dataclass(frozen=True, slots=True)
class RecoveryCurve:
    """One flight about its event; times since the event."""

    label: str
    """Of the controller: flights of one label have one colour, the first of them is drawn bold."""
    error_times_s: Array
    error_enu_m: Array
    """(n, 3) position minus desired position."""
    tick_times_s: Array
    tilt_rad: Array
    thrust: Array
    recovery: Recovery


def flight_curve(
    data: FlightData, scored_s: tuple[float, float], label: str, *, lost: bool = False
) -> tuple[str, RecoveryCurve] | None:
    """A flight's curve, and its event in words; None for a flight without one.

    Against the truth where there is one, as events are told by a simulation alone.
    """
    found = flight_recovery(data, scored_s, lost=lost)
    if found is None:
        return None
    event, figures = found
    has_truth = len(data.truth.time_s) > 0
    times, error = (true_error_enu if has_truth else reported_error_enu)(data, scored_s)
    ticks = data.ticks
    tilt: Array = np.hypot(ticks.roll_rad, ticks.pitch_rad)
    curve = RecoveryCurve(
        label,
        times - event.time_s,
        error,
        ticks.time_s - event.time_s,
        tilt,
        ticks.thrust,
        figures,
    )
    return event.text, curve


def draw_recoveries(curves: Sequence[RecoveryCurve], title: str, path: Path) -> None:
    """Draw flights over each other, from a second before the event to six after it.

    Args:
        curves: of flights with the same event.
        title: of the picture.
        path: of the PNG.

    Raises:
        OSError: the file can't be written.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 9.5))
    figure.suptitle(title, fontsize=12, x=0.08, y=0.985, ha="left")
    rows = figure.subplots(len(_ROWS), 1, sharex=True)
    figure.subplots_adjust(left=0.09, right=0.97, top=0.93, bottom=0.055, hspace=0.28)
    labels = list(dict.fromkeys(curve.label for curve in curves))
    for curve in reversed(curves):  # the first of a label lies on top
        first = next(other for other in curves if other.label == curve.label)
        colour = _COLOURS[labels.index(curve.label) % len(_COLOURS)]
        _draw(rows, curve, colour, bold=curve is first)
    for axes, name in zip(rows, _ROWS, strict=True):
        axes.set_title(name, fontsize=9, loc="left")
        axes.grid(alpha=0.3)
        axes.tick_params(labelsize=8)
        axes.axvline(0.0, color="k", lw=0.9, ls="--")
    rows[0].set_xlim(-_BEFORE_S, _AFTER_S)
    rows[-1].set_xlabel("time since the event, s (bold: the first flight of each)", fontsize=9)
    _legend(rows[0], labels)
    figure.savefig(path, dpi=110)


def _draw(rows: Any, curve: RecoveryCurve, colour: str, *, bold: bool) -> None:  # noqa: ANN401
    look = {"color": colour, "lw": 1.5 if bold else 0.6, "alpha": 1.0 if bold else 0.35}
    use = _shown(curve.error_times_s)
    times, error = curve.error_times_s[use], curve.error_enu_m[use] * 1e3
    label = curve.label if bold else None
    rows[0].plot(times, error[:, 2], label=label, **look)
    rows[1].plot(times, np.hypot(error[:, 0], error[:, 1]), **look)
    use = _shown(curve.tick_times_s)
    ticks = curve.tick_times_s[use]
    rows[2].plot(ticks, np.degrees(curve.tilt_rad[use]), **look)
    thrust = curve.thrust[use]
    earlier = thrust[ticks < 0.0]
    mean = np.nanmean(earlier) if np.isfinite(earlier).any() else np.nan
    rows[3].plot(ticks, thrust / mean if mean > 0.0 else thrust, **look)
    if not bold:
        return
    found = curve.recovery
    for axes, before in ((rows[0], found.before_height_m), (rows[1], found.before_horizontal_m)):
        axes.axhline((before + MARGIN_M) * 1e3, color=colour, lw=0.7, ls=":")
    rows[0].axhline(-(found.before_height_m + MARGIN_M) * 1e3, color=colour, lw=0.7, ls=":")
    if 0.0 < found.recovery_s < _AFTER_S:
        for axes in rows[:2]:
            axes.axvline(found.recovery_s, color=colour, lw=0.9, ls="-.")


def _shown(times_s: Array) -> np.ndarray:
    use: np.ndarray = (times_s >= -_BEFORE_S) & (times_s <= _AFTER_S)
    return use


def _legend(axes: Any, labels: Sequence[str]) -> None:  # noqa: ANN401
    axes.plot([], [], color="k", lw=0.7, ls=":", label="bounds of 'back'")
    axes.plot([], [], color="k", lw=0.9, ls="-.", label="back")
    handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    names = [*labels, "bounds of 'back'", "back"]
    axes.legend(
        [handles[name] for name in names],
        names,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=len(names),
        fontsize=8,
        frameon=False,
    )
