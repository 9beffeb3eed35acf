"""The control loop as boxes and arrows."""

from pathlib import Path

from tools.docs.style import FLOWN, GOOD, INK, OTHER, QUIET, Axes, panels, save

_BOXES = {
    # name: (left, bottom, width, height, heading, lines, colour)
    "path": (0.0, 2.75, 1.5, 0.95, "trajectory", "where to be\nin the next second", QUIET),
    "mpc": (2.3, 2.75, 1.75, 0.95, "MPC", "plans over D(s)\nevery 30 ms", FLOWN),
    "gain": (4.85, 2.75, 1.3, 0.95, "K", "position error\nto velocity", FLOWN),
    "l1": (6.95, 2.75, 1.75, 0.95, "L1", "makes the vehicle\nbehave like M(s)", FLOWN),
    "maps": (9.5, 2.75, 1.75, 0.95, "tilt and thrust", "limits, frames,\nclimb-rate loop", FLOWN),
    "guard": (
        9.5,
        1.15,
        1.75,
        0.95,
        "supervisor",
        "may this leave?\nelse level, or nothing",
        OTHER,
    ),
    "vehicle": (
        6.95,
        0.0,
        1.75,
        1.35,
        "autopilot",
        "attitude loop,\nmotors, vehicle,\nestimator",
        GOOD,
    ),
    "carry": (2.3, 0.35, 1.75, 0.95, "carry", "the state over\nthe loop's delay", FLOWN),
}
_ARROWS = (
    # from, to, label and where it stands; sides are chosen by the points
    ((1.5, 3.22), (2.3, 3.22), "y2*", (1.9, 3.36)),
    ((4.05, 3.22), (4.85, 3.22), "r2", (4.45, 3.36)),
    ((6.15, 3.22), (6.95, 3.22), "r1", (6.55, 3.36)),
    ((8.7, 3.22), (9.5, 3.22), "u", (9.1, 3.36)),
    ((10.37, 2.75), (10.37, 2.1), "attitude,\nthrust", (10.93, 2.42)),
    ((9.5, 1.4), (8.7, 1.0), "MAVLink,\n100 Hz", (9.25, 0.78)),
    ((7.82, 1.35), (7.82, 2.75), "velocity y1", (8.35, 2.05)),
    ((5.5, 0.82), (5.5, 2.75), "position y2", (6.05, 2.05)),
    ((6.95, 0.82), (4.05, 0.82), "state, 100 Hz", (4.85, 0.96)),
    ((3.17, 1.3), (3.17, 2.75), "state when it acts", (2.3, 2.05)),
)


def draw(folder: Path) -> list[Path]:
    """Draw the loop into a folder; returns the picture's path."""
    figure, axes = panels(1, 1, (9.6, 3.5))
    axes.set_axis_off()
    axes.grid(visible=False)
    axes.set_xlim(-0.05, 11.5)
    axes.set_ylim(-0.1, 3.85)
    for left, bottom, width, height, heading, lines, colour in _BOXES.values():
        _box(axes, (left, bottom, width, height), heading, lines, colour)
    for begin, end, label, at in _ARROWS:
        axes.annotate(
            "", end, begin, arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.1}, zorder=1
        )
        axes.text(*at, label, ha="center", va="center", fontsize=8.5, color=INK)
    says = "The loop: trajectory, MPC, K, L1, tilt and thrust, supervisor, autopilot, and back."
    return [save(figure, folder / "how-loop.svg", says)]


def _box(
    axes: Axes, place: tuple[float, float, float, float], heading: str, lines: str, colour: str
) -> None:
    from matplotlib.patches import FancyBboxPatch

    left, bottom, width, height = place
    axes.add_patch(
        FancyBboxPatch(
            (left + 0.03, bottom + 0.03),
            width - 0.06,
            height - 0.06,
            boxstyle="round,pad=0.0,rounding_size=0.08",
            facecolor="white",
            edgecolor=colour,
            linewidth=1.6,
            zorder=2,
        )
    )
    middle, top = left + width / 2.0, bottom + height
    axes.text(
        middle, top - 0.2, heading, ha="center", va="center", weight="bold", color=colour, zorder=3
    )
    axes.text(
        middle,
        (bottom + top - 0.32) / 2.0,
        lines,
        ha="center",
        va="center",
        fontsize=8.2,
        color=INK,
        zorder=3,
        linespacing=1.15,
    )
