"""What each parameter decides, with intervals: one row a parameter."""

import math
from collections.abc import Sequence

from matplotlib.axes import Axes

from companion.experiments.campaign_report.drawing import Panel, panel
from companion.experiments.campaign_report.influence import Influence
from companion.report.pages.style import FAINT, MPC_PID, MUTED, SMALL

_MOST = 12


def share_panel(name: str, title: str, influences: Sequence[Influence]) -> Panel:
    """Draw the first-order shares of one group on one figure.

    Args:
        name: of the panel.
        title: over it.
        influences: the strongest first; some at least.
    """
    shown = list(influences[:_MOST])
    what = "whether a flight is lost" if shown[0].outcome == "lost" else "the error's rank"
    caption = (
        f"Share of the variance of {what} that each parameter decides by itself (first order), "
        "with 95 % intervals. Grey: not told from chance."
    )

    def draw(axes: Axes) -> None:
        for row, one in enumerate(reversed(shown)):
            value, low, high = one.share.value, one.share.low, one.share.high
            if math.isnan(value):
                continue
            colour = MPC_PID if one.seen else MUTED
            axes.barh(row, value, height=0.62, color=colour if one.seen else FAINT)
            if math.isfinite(low):
                axes.plot([low, high], [row, row], "-", color=MUTED, lw=1.4)
                axes.plot([low, high], [row, row], "|", color=MUTED, ms=7, mew=1.4)
            reach = high if math.isfinite(high) else value
            axes.annotate(
                f"{value:.2f}", (reach, row), (5, 0), textcoords="offset points", va="center",
                fontsize=SMALL,
            )  # fmt: skip
        axes.set_yticks(range(len(shown)), [one.parameter for one in reversed(shown)])
        axes.set_ylim(-0.6, max(len(shown), 3) - 0.4)
        reach = max(
            [0.1, *(v for one in shown for v in (one.share.value, one.share.high) if v == v)]
        )
        axes.set_xlim(0.0, 1.15 * reach)
        axes.set_xlabel("share of the variance (1: all of it)")
        axes.grid(visible=False, axis="y")
        axes.tick_params(axis="y", length=0)

    return panel(name, title, caption, draw)
