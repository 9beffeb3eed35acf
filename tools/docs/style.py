"""One look for the documentation's pictures, and SVG files that are the same each time."""

from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("svg")
from matplotlib import pyplot as plt

INK, QUIET, GRID = "#2b2b2b", "#8a8a8a", "#dddddd"
FLOWN, OTHER, DESIRED, WARM, GOOD = "#1f5fa8", "#c0392b", "#2b2b2b", "#e07b00", "#2e8b57"
LARGEST_BYTES = 150_000
"""Of a picture: a page with six of them is still read over a slow connection."""

_LOOK = {
    "svg.hashsalt": "how-it-works",
    "svg.fonttype": "none",
    "path.simplify": True,
    "path.simplify_threshold": 0.5,
    "font.family": "sans-serif",
    "font.size": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "legend.frameon": False,
}

Figure = Any
"""matplotlib's, which says nothing of its types."""
Axes = Any


def panels(rows: int, columns: int, size_in: tuple[float, float], **more: Any) -> Any:  # noqa: ANN401
    """A figure and its axes in this look.

    Args:
        rows: of panels.
        columns: of panels.
        size_in: width and height, inches.
        **more: as `matplotlib.pyplot.subplots` takes it.
    """
    plt.rcParams.update(_LOOK)
    return plt.subplots(rows, columns, figsize=size_in, constrained_layout=True, **more)


def save(figure: Figure, path: Path, says: str) -> Path:
    """Write a figure as SVG, without the date and with stable names inside.

    Args:
        figure: what is drawn; closed afterwards.
        path: of the file.
        says: what it shows, in a sentence; a screen reader reads it.

    Raises:
        ValueError: it is larger than `LARGEST_BYTES`.
    """
    figure.savefig(path, metadata={"Date": None, "Description": says, "Title": says})
    plt.close(figure)
    size = path.stat().st_size
    if size > LARGEST_BYTES:
        raise ValueError(f"{path}: {size:,} bytes. Draw fewer points: {LARGEST_BYTES:,} at most.")
    return path
