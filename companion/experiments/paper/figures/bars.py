"""Groups of bars with their values written on them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes

from companion.experiments.paper.statistics import Spread, lost_text
from companion.report.pages.style import INK, MUTED, SMALL

_LOST_HEIGHT = 0.35
"""Of a bar that stands for lost flights, as a share of the highest one."""
_HEADROOM = 1.12


@dataclass(frozen=True, slots=True)
class Bar:
    """One bar; not finite where flights were lost."""

    value: float
    spread: float = math.nan
    """Half length of the whisker; none if NaN."""
    note: str = ""
    """Written beyond the value, or in the place of it where it is not finite."""


@dataclass(frozen=True, slots=True)
class Series:
    """Bars of one meaning, one for each group."""

    label: str
    colour: str
    bars: Sequence[Bar]


def bar_of(spread: Spread, scale: float, note: str = "") -> Bar:
    """Mean and spread in another unit."""
    if spread.lost:
        return Bar(math.inf, note=lost_text(spread))
    return Bar(spread.mean * scale, spread.std * scale, note)


def draw_bars(
    axes: Axes, groups: Sequence[str], series: Sequence[Series], letters: float = SMALL
) -> None:
    """Draw, write values, and set the limits.

    Args:
        axes: to draw on.
        groups: names along the axis.
        series: one bar of each per group.
        letters: size of the values.
    """
    finite = [b.value for s in series for b in s.bars if math.isfinite(b.value)]
    tops = [
        b.value + (b.spread if math.isfinite(b.spread) else 0.0)
        for s in series
        for b in s.bars
        if math.isfinite(b.value)
    ]
    top = max([*tops, 0.0]) or 1.0
    bottom = min([*finite, 0.0])
    width = 0.84 / len(series)
    for k, one in enumerate(series):
        places = [g + (k - (len(series) - 1) / 2) * width for g in range(len(groups))]
        label: str | None = one.label
        for place, bar in zip(places, one.bars, strict=True):
            _draw_bar(axes, place, 0.92 * width, bar, one.colour, label, top, letters)
            label = None
    span = top - bottom
    axes.set_ylim(bottom - (0.12 * span if bottom < 0.0 else 0.0), bottom + _HEADROOM * span)
    axes.set_xlim(-0.55, len(groups) - 0.45)
    axes.set_xticks(range(len(groups)), groups)
    axes.tick_params(axis="x", length=0)
    axes.grid(visible=False, axis="x")
    if bottom < 0.0:
        axes.axhline(0.0, color=MUTED, lw=0.8)


def _draw_bar(
    axes: Axes,
    place: float,
    width: float,
    bar: Bar,
    colour: str,
    label: str | None,
    top: float,
    letters: float,
) -> None:
    if not math.isfinite(bar.value):
        height = _LOST_HEIGHT * top
        axes.bar(
            place, height, width, facecolor="none", edgecolor=colour, hatch="////", label=label
        )
        text = bar.note or "lost"
        axes.annotate(
            text,
            (place, height),
            (0, 3),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=letters,
            rotation=90,
        )
        return
    axes.bar(place, bar.value, width, color=colour, label=label)
    reach = bar.value
    if math.isfinite(bar.spread):
        axes.errorbar(place, bar.value, bar.spread, color=INK, elinewidth=1.0, capsize=2.0)
        reach += bar.spread if bar.value >= 0.0 else -bar.spread
    text = f"{bar.value:.0f}" if abs(bar.value) >= 99.5 else f"{bar.value:.1f}"
    text = text.replace("-", "−")
    up = bar.value >= 0.0
    lines = [bar.note, text] if up else [text, bar.note]
    axes.annotate(
        "\n".join(line for line in lines if line),
        (place, reach),
        (0, 2 if up else -2),
        textcoords="offset points",
        ha="center",
        va="bottom" if up else "top",
        fontsize=letters,
    )
