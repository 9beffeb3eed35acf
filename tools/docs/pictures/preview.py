"""The MPC before a corner: what it sees, what it plans, what it commands."""

from pathlib import Path

import numpy as np

from companion.control.reference_model import Array, discretise_position_model
from tools.docs.pictures.model import run, shipped_mpc
from tools.docs.style import DESIRED, FLOWN, OTHER, QUIET, WARM, panels, save

_SPEED_M_S = 0.8
_TURN_S = 0.0
_SHOWN_S = -0.3
"""The plan that is drawn was made so long before the corner."""


def _corner(times_s: Array) -> Array:
    """East until the corner, then north, at one speed."""
    east = _SPEED_M_S * np.minimum(times_s, _TURN_S)
    north = _SPEED_M_S * np.maximum(times_s - _TURN_S, 0.0)
    return np.stack([east, north, np.full_like(times_s, 1.2)], axis=1)


def draw(folder: Path) -> list[Path]:
    """Let the model fly round the corner and draw it; returns the picture's path."""
    mpc = shipped_mpc()
    made = run(mpc, _corner, -4.0, 3.0)
    shown = min(made, key=lambda plan: abs(plan.time_s - _SHOWN_S))
    times = np.array([plan.time_s for plan in made])
    flown = np.array([plan.position_m for plan in made])
    lagging = _without_preview(-4.0, 3.0)

    figure, (above, over) = panels(1, 2, (9.0, 3.9), width_ratios=(1.0, 1.1))
    path = _corner(np.array([-1.4, 0.0, 1.6]))
    above.plot(path[:, 0], path[:, 1], color=DESIRED, lw=1.2, ls="--", label="desired y2*")
    near = (times > -1.4) & (times < 2.3)
    above.plot(*flown[near, :2].T, color=FLOWN, lw=2.0, label="flown with the MPC")
    above.plot(*lagging[near, :2].T, color=OTHER, lw=1.4, label="flown with r2 = y2*")
    above.plot(
        *shown.predicted_m[:, :2].T, ".", ms=3.5, color=WARM, label="what it expects", zorder=4
    )
    above.plot(*shown.position_m[:2], "o", ms=8, color=FLOWN, mec="white", zorder=5)
    above.annotate("now", shown.position_m[:2], xytext=(-6, -16), textcoords="offset points")
    above.set_xlim(-1.45, 0.45)
    above.set_ylim(-0.15, 1.45)
    above.set_aspect("equal")
    above.set_title("From above")
    above.set_xlabel("east, m")
    above.set_ylabel("north, m")
    above.legend(loc="upper left", fontsize=8.5)

    ahead = shown.time_s + mpc.preview_times_s
    over.axvspan(shown.time_s, ahead[-1], color="#f3f3f3", zorder=0)
    over.text(
        (shown.time_s + ahead[-1]) / 2.0,
        0.03,
        "horizon",
        color=QUIET,
        ha="center",
        transform=over.get_xaxis_transform(),
    )
    seen = np.linspace(-1.4, 2.3, 400)
    over.plot(seen, _corner(seen)[:, 0], color=DESIRED, lw=1.2, ls="--", label="desired")
    over.plot(times[near], flown[near, 0], color=FLOWN, lw=2.0, label="flown")
    over.plot(ahead[:-1], shown.plan_m[:, 0], color=WARM, lw=1.2, label="r2 planned")
    over.plot(ahead[1:], shown.predicted_m[:, 0], ".", ms=3.5, color=WARM, label="what it expects")
    over.axvline(_TURN_S, color=QUIET, lw=0.8, ls=":")
    over.axvline(shown.time_s, color=FLOWN, lw=0.8)
    over.set_title("East, by time: it brakes before the corner")
    over.set_xlabel("seconds from the corner")
    over.set_ylabel("m")
    over.legend(loc="lower right", fontsize=8.5)
    says = "Before a corner the MPC plans to brake and turn; without a preview the vehicle lags."
    return [save(figure, folder / "how-preview.svg", says)]


def _without_preview(begin_s: float, end_s: float) -> Array:
    """Positions of the same model where r2 is the desired position of now."""
    mpc = shipped_mpc()
    a, b = discretise_position_model(
        np.array(mpc.model.m), np.array(mpc.model.gain_k), mpc.period_s
    )
    state = np.stack([_corner(np.array([begin_s]))[0], np.zeros(3)], axis=1)
    flown = []
    for k in range(round((end_s - begin_s) / mpc.period_s)):
        flown.append(state[:, 0].copy())
        r2 = _corner(np.array([begin_s + k * mpc.period_s]))[0]
        state = np.einsum("nij,nj->ni", a, state) + b * r2[:, None]
    return np.array(flown)
