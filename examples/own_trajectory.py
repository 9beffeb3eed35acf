"""A trajectory of one's own: a helix that narrows as it climbs, from a function of time.

Run it with `python own_trajectory.py`; it writes own_trajectory.png.
"""

import math

from companion.api import InputError, fly, make_trajectory

DURATION_S = 18.0


def helix(s: float, turn_rad_s: float = 1.2) -> tuple[float, float, float]:
    """Position (ENU, m) at the path time s, which starts and stops smoothly by itself."""
    radius_m = 1.0 - 0.5 * s / DURATION_S
    angle_rad = turn_rad_s * s
    return radius_m * math.cos(angle_rad), radius_m * math.sin(angle_rad), 0.8 + 0.06 * s


def main() -> None:
    """Fly it, and have one refused that no bebop2 can fly."""
    flight = fly(make_trajectory(helix, DURATION_S, name="helix"), wind="gusts", seed=3)
    print(
        f"{flight.trajectory}: {flight.outcome}, mean error {1e3 * flight.mean_error_m:.1f} mm, "
        f"gusts push by up to {flight.figures.wind_peak_m_s2:.2f} m/s²"
    )

    try:
        fly(make_trajectory(lambda s: helix(s, turn_rad_s=2.5), DURATION_S, name="too fast"))
    except InputError as error:
        print(f"refused: {error}")

    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.2, 4.6), layout="constrained")
    axes = figure.add_subplot(projection="3d")
    axes.set_box_aspect((1, 1, 0.8), zoom=0.85)
    scored = (flight.truth.track_s >= 0.0) & (flight.truth.track_s <= DURATION_S)
    tracked = flight.ticks.phase == "track"
    axes.plot(*flight.ticks.desired_enu_m[tracked].T, color="0.6", label="desired")
    axes.plot(*flight.truth.position_enu_m[scored].T, linewidth=1.0, label="flown")
    axes.set(xlabel="east (m)", ylabel="north (m)", zlabel="up (m)")
    axes.locator_params(nbins=4)
    axes.legend()
    figure.savefig("own_trajectory.png", dpi=150)


if __name__ == "__main__":
    main()
