"""The architecture's picture: a row of boxes for each layer, and arrows to what a room imports."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tools.docs.style import FLOWN, GOOD, INK, OTHER, QUIET, Axes, panels, save

_ROW = 0.86
_HEIGHT = 0.5
_GAP = 0.28
_LETTER = 0.105
_ASIDE = 0.75
"""Rooms alone in their row stand to either side in turn: arrows past them stay in sight."""
_PACKAGE_GAP = 0.9
_COLOURS = {"companion": FLOWN, "sitl_shim": GOOD}

Box = tuple[float, float, float]
"""Left, bottom, width."""


def draw(data: Mapping[str, Any], path: Path) -> Path:
    """Draw the rooms of both packages side by side.

    An arrow stands for an import that no chain of other arrows stands for: what a room reaches by
    arrows, it may use, and mostly does.
    """
    rows_at_most = max(len(rows) for rows in data["layers"].values())
    boxes: dict[str, Box] = {}
    left = 0.0
    spans = {}
    for package, rows in data["layers"].items():
        width = max(sum(map(_width, row)) + _GAP * (len(row) - 1) for row in rows if row)
        placed = _place(rows, left, width, rows_at_most)
        boxes.update(placed)
        spans[package] = (left, left + width)
        left += width + _PACKAGE_GAP
    figure, axes = panels(1, 1, (0.7 * left, 0.7 * (_ROW * rows_at_most + 0.9)))
    axes.set_axis_off()
    axes.set_xlim(-0.2, left - _PACKAGE_GAP + 0.2)
    axes.set_ylim(-0.2, _ROW * rows_at_most + 0.6)
    for package, (begin, end) in spans.items():
        axes.text(
            (begin + end) / 2.0,
            _ROW * rows_at_most + 0.28,
            package,
            ha="center",
            va="center",
            weight="bold",
            fontsize=12,
            color=_COLOURS[package],
        )
    for importer, below in reduced(data["imports"]).items():
        for imported in below:
            _arrow(
                axes,
                boxes[importer],
                boxes[imported],
                across=_package(importer) != _package(imported),
            )
    for room, (x, y, width) in boxes.items():
        _box(axes, room, x, y, width)
    return save(
        figure, path, "The rooms of companion and sitl_shim in layers, and who imports whom."
    )


def reduced(imports: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """The imports that no chain of other imports leads to."""

    def reached(room: str) -> set[str]:
        found: set[str] = set()
        waiting = list(imports.get(room, ()))
        while waiting:
            one = waiting.pop()
            if one not in found:
                found.add(one)
                waiting += imports.get(one, ())
        return found

    return {
        room: [b for b in below if not any(b in reached(other) for other in below if other != b)]
        for room, below in imports.items()
    }


def _place(
    rows: Sequence[Sequence[str]], left: float, width: float, rows_at_most: int
) -> dict[str, Box]:
    placed = {}
    for depth, row in enumerate(rows):
        used = sum(map(_width, row)) + _GAP * (len(row) - 1)
        aside = _ASIDE * (-1.0 if depth % 2 else 1.0) if len(row) == 1 else 0.0
        x = left + (width - used) / 2.0 + aside
        for room in sorted(row, key=lambda r: not r.endswith(".lockstep")):
            placed[room] = (x, _ROW * (rows_at_most - 1 - depth), _width(room))
            x += _width(room) + _GAP
    return placed


def _width(room: str) -> float:
    return 0.35 + _LETTER * len(_name(room))


def _name(room: str) -> str:
    return room.partition(".")[2]


def _package(room: str) -> str:
    return room.partition(".")[0]


def _box(axes: Axes, room: str, x: float, y: float, width: float) -> None:
    from matplotlib.patches import FancyBboxPatch

    axes.add_patch(
        FancyBboxPatch(
            (x, y),
            width,
            _HEIGHT,
            boxstyle="round,pad=0.0,rounding_size=0.08",
            facecolor="white",
            edgecolor=_COLOURS[_package(room)],
            linewidth=1.4,
            zorder=3,
        )
    )
    axes.text(
        x + width / 2.0,
        y + _HEIGHT / 2.0,
        _name(room),
        ha="center",
        va="center",
        color=INK,
        fontsize=9,
        zorder=4,
    )


def _arrow(axes: Axes, upper: Box, lower: Box, *, across: bool) -> None:
    begin = (upper[0] + upper[2] / 2.0, upper[1])
    end = (lower[0] + lower[2] / 2.0, lower[1] + _HEIGHT)
    if across:
        begin = (upper[0] + upper[2], upper[1] + _HEIGHT / 2.0)
        end = (lower[0], lower[1] + _HEIGHT / 2.0)
    axes.annotate(
        "",
        end,
        begin,
        zorder=2 if across else 1,
        arrowprops={
            "arrowstyle": "-|>",
            "color": OTHER if across else QUIET,
            "lw": 1.4 if across else 0.9,
            "shrinkA": 0,
            "shrinkB": 0,
            "mutation_scale": 9,
        },
    )
