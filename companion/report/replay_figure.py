"""The picture of a replay: what left in flight, and what leaves now."""

from pathlib import Path
from typing import Any

from companion.report.replay_figures import ReplayFigures

_FLOWN, _NOW = "#7f8c8d", "#1f6fb4"

Axes = Any
"""matplotlib's; it is imported only when something is drawn."""


def draw_replay(figures: ReplayFigures, flown: str, asked: str, path: Path) -> None:
    """Draw both.

    Args:
        figures: of the replay.
        flown: the controller that flew.
        asked: the controller that is replayed.
        path: of the picture.

    Raises:
        OSError: the file can't be written.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 7.0), layout="constrained")
    said = f"{figures.identical} of {figures.compared} setpoints identical"
    figure.suptitle(f"{asked} on the inputs of a flight of {flown}: {said}", x=0.01, ha="left")
    what = (
        ("rate x, deg/s", "rate y, deg/s") if figures.rates else ("tilt east, °", "tilt north, °")
    )
    panels = figure.subplots(3, 1, sharex=True)
    columns = ("tilt_east_deg", "tilt_north_deg", "thrust")
    for axes, column, label in zip(panels, columns, (*what, "thrust field"), strict=True):
        time_s = figures.recorded.time_s
        axes.plot(time_s, getattr(figures.recorded, column), color=_FLOWN, label=f"sent ({flown})")
        axes.plot(
            time_s, getattr(figures.replayed, column), color=_NOW, lw=0.9, label=f"now ({asked})"
        )
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    panels[0].legend(loc="upper right", ncols=2, fontsize=9)
    panels[-1].set_xlabel("the autopilot's clock, s")
    figure.savefig(path, dpi=110)
