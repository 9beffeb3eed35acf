"""A plan on which a constraint is active: the closed form, and what the solver makes of it."""

from pathlib import Path

import numpy as np

from companion.control.reference_model import Array
from tools.docs.pictures.model import Planned, run, shipped_mpc
from tools.docs.style import DESIRED, FLOWN, OTHER, QUIET, panels, save

_WALL_M = 0.5
_EAST = 0
_SHOWN_S = 1.8


def _beyond_the_wall(times_s: Array) -> Array:
    """To the east and back, from rest, 0.3 m beyond the box."""
    east = 0.4 * (1.0 - np.cos(0.9 * times_s))
    return np.stack([east, np.zeros_like(times_s), np.full_like(times_s, 1.2)], axis=1)


def plans() -> tuple[list[Planned], list[Planned]]:
    """The runs without the wall, and with it."""
    free = run(shipped_mpc(), _beyond_the_wall, 0.0, 7.0)
    low, high = shipped_mpc().settings.box_low_m, shipped_mpc().settings.box_high_m
    walled = shipped_mpc(box_low_m=low, box_high_m=(_WALL_M, *high[1:]))
    return free, run(walled, _beyond_the_wall, 0.0, 7.0)


def shown_plan(walled: list[Planned]) -> tuple[Planned, Array]:
    """The plan that is drawn, and where the closed form would lead from the same state."""
    shown = min(walled, key=lambda plan: abs(plan.time_s - _SHOWN_S))
    free = shipped_mpc()
    target = _beyond_the_wall(shown.time_s + free.preview_times_s)
    _, record = free.plan(shown.memory, shown.position_m, shown.velocity_m_s, target)
    return shown, np.array(record.predicted_position_m)


def draw(folder: Path) -> list[Path]:
    """Run both and draw them; returns the picture's path."""
    free, walled = plans()
    figure, (flown, planned) = panels(1, 2, (9.0, 3.7), sharey=True)
    times = np.array([plan.time_s for plan in free])
    seen = np.linspace(0.0, 7.0, 300)
    for axes in (flown, planned):
        axes.axhspan(_WALL_M, 1.0, color="#f6e3e0", zorder=0)
        axes.plot(
            seen, _beyond_the_wall(seen)[:, _EAST], color=DESIRED, ls="--", lw=1.2, label="desired"
        )
    flown.plot(
        times, [p.position_m[_EAST] for p in free], color=OTHER, lw=1.4, label="without the fence"
    )
    flown.plot(times, [p.position_m[_EAST] for p in walled], color=FLOWN, lw=2.0, label="with it")
    ran = [p.record.status == "solved" for p in walled]
    flown.fill_between(times, -0.1, -0.06, where=ran, color=FLOWN, lw=0, label="the solver runs")
    flown.text(0.1, 0.85, "outside the geofence", color=OTHER, fontsize=8.5)
    flown.set_title("Flown")
    flown.set_ylabel("east, m")
    flown.set_xlabel("s")
    flown.set_xlim(0.0, 7.0)
    flown.set_ylim(-0.1, 0.9)
    flown.legend(loc="lower center", bbox_to_anchor=(0.5, 0.05), fontsize=8.5)

    shown, closed_form = shown_plan(walled)
    ahead = shown.time_s + shipped_mpc().preview_times_s[1:]
    planned.plot(ahead, closed_form[:, _EAST], color=OTHER, lw=1.4, label="closed form")
    planned.plot(ahead, shown.predicted_m[:, _EAST], color=FLOWN, lw=2.0, label="solved")
    planned.plot(shown.time_s, shown.position_m[_EAST], "o", ms=7, color=FLOWN, mec="white")
    planned.axvline(shown.time_s, color=QUIET, lw=0.8)
    planned.set_title("Two plans from the same place")
    planned.set_xlabel("s")
    planned.set_xlim(0.0, 7.0)
    planned.legend(loc="lower center", fontsize=8.5)
    says = "Where the closed form would leave the geofence, the solver's plan stays within it."
    return [save(figure, folder / "how-constraint.svg", says)]
