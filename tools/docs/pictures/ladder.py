"""Telemetry that stops, for a moment and for long: the rungs, and the vehicle's path."""

from pathlib import Path

import numpy as np

from tools.docs.flights import fly
from tools.docs.style import DESIRED, FLOWN, OTHER, QUIET, panels, save

_GAP_S, _GAP_END_S = 7.0, 7.3
_PAUSE_S, _PAUSE_END_S = 11.0, 14.0
_SILENT = "{{way: telemetry, pause: true, since: setpoints, from_s: {}, until_s: {}}}"
_GAPS = (_SILENT.format(_GAP_S, _GAP_END_S), _SILENT.format(_PAUSE_S, _PAUSE_END_S))
_FAULTS = f"{{name: gaps, link: [{', '.join(_GAPS)}]}}"
_RUNGS = ("nothing is sent", "level, holding altitude", "tracking")
_BEGIN_S, _END_S = 5.5, 14.0


def draw(folder: Path) -> list[Path]:
    """Fly it and draw it; returns the picture's path."""
    _, data, records = fly(2, faults=_FAULTS)
    silent = next(k for k, r in enumerate(records) if r["phase"] == "silence")
    begun_s = float(records[silent - 1]["autopilot_time_s"]) - _GAP_S
    times = np.array([r["autopilot_time_s"] for r in records]) - begun_s
    rungs = np.array([_rung(str(r["rung"]), sent=bool(r["sent"])) for r in records])
    true_s = data.truth.time_s - begun_s
    seen = (true_s > _BEGIN_S) & (true_s < _END_S)
    position = data.truth.position_enu_m[seen]
    tracked = ~np.isnan(data.ticks.desired_enu_m[:, 0])
    desired_s = data.ticks.time_s[tracked] - begun_s
    desired = data.ticks.desired_enu_m[tracked]

    figure, (rung, path) = panels(2, 1, (7.6, 4.4), sharex=True, height_ratios=(1.0, 1.3))
    for axes in (rung, path):
        axes.axvspan(_GAP_S, _GAP_END_S, color="#f6e3e0", zorder=0)
        axes.axvspan(_PAUSE_S, _PAUSE_END_S, color="#f6e3e0", zorder=0)
    rung.step([*times, _END_S], [*rungs, 0], where="post", color=FLOWN, lw=1.8)
    rung.set_yticks(range(len(_RUNGS)), _RUNGS)
    rung.set_ylim(-0.4, 2.4)
    rung.set_title("What leaves the companion (telemetry stops where it is shaded)")
    for axis, name, colour in ((0, "east", FLOWN), (1, "north", OTHER)):
        path.plot(true_s[seen], position[:, axis], color=colour, label=name)
        path.plot(desired_s, desired[:, axis], color=DESIRED, lw=1.0, ls="--")
    path.plot([], [], color=DESIRED, lw=1.0, ls="--", label="desired")
    path.set_xlim(_BEGIN_S, _END_S)
    path.set_ylim(-1.65, 1.7)
    path.set_title("Where the vehicle truly is")
    path.set_ylabel("m")
    path.set_xlabel("seconds since the companion flies")
    path.legend(loc="lower left", ncols=3, fontsize=8.5)
    path.axhline(0.0, color=QUIET, lw=0.6)
    says = "0.3 s without telemetry are flown level; after 0.9 s the companion hands over."
    return [save(figure, folder / "how-ladder.svg", says)]


def _rung(name: str, *, sent: bool) -> int:
    """A rung as a height: what was not sent is the lowest."""
    if not sent:
        return 0
    return 1 if name == "level" else 2
