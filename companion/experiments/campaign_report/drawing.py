"""The report's figures, each of one narrow panel, so that a telephone shows it whole."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from companion.report.pages.inline_svg import inline_svg
from companion.report.pages.style import (
    COLOURS,
    INK,
    L1,
    LQR_L1,
    MPC_L1,
    MPC_L1_PLUS,
    MPC_PID,
    MPC_PID_JOINT,
    PID_L1,
    SETTINGS,
    WIND,
)
from companion.report.pages.svg import svg_text

WIDTH_IN, HEIGHT_IN = 4.6, 3.3
MM = 1e3
LOST_AT = 1.04
"""Where lost flights stand, above the axes, as a share of their height."""
_OTHERS = (MPC_L1, MPC_PID, PID_L1, LQR_L1, L1, MPC_PID_JOINT, MPC_L1_PLUS, WIND)
_SETTINGS: dict[Any, Any] = SETTINGS | {"figure.facecolor": "none"}


@dataclass(frozen=True, slots=True)
class Panel:
    """A figure on the page."""

    name: str
    title: str
    caption: str
    svg: str


def panel(name: str, title: str, caption: str, draw: Callable[[Axes], None]) -> Panel:
    """Draw one.

    Args:
        name: unique on the page, fit for an id.
        title: over it.
        caption: below it.
        draw: on empty axes.
    """
    with mpl.rc_context(_SETTINGS):
        figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
        FigureCanvasAgg(figure)
        draw(figure.add_subplot())
        text = svg_text(figure)
    return Panel(name, title, caption, inline_svg(text, name, f"{title}. {caption}"))


def colours(controllers: tuple[str, ...]) -> dict[str, str]:
    """A colour for each controller: its own, or one that no other here has; ink if they run out."""
    found = {name: COLOURS[name] for name in controllers if name in COLOURS}
    rest = iter([colour for colour in _OTHERS if colour not in found.values()])
    for name in controllers:
        if name not in found:
            found[name] = next(rest, INK)
    return found
