"""A wind of one's own: a whirl about the middle of the room that comes and goes.

Run it with `python own_wind.py`; it writes own_wind.png.
"""

import math

import numpy as np

from companion.api import fly

STRONGEST_M_S = 6.0
CORE_M = 0.8
PERIOD_S = 8.0


def whirl(time_s: float, position_enu_m: tuple[float, float, float]) -> tuple[float, float, float]:
    """Velocity of the air (ENU, m/s): around the vertical axis, fastest at the core's edge."""
    east_m, north_m, _ = position_enu_m
    radius_m = math.hypot(east_m, north_m)
    strength = STRONGEST_M_S * (0.5 - 0.5 * math.cos(2.0 * math.pi * time_s / PERIOD_S))
    turning = strength * (radius_m / CORE_M) * math.exp(0.5 * (1.0 - (radius_m / CORE_M) ** 2))
    if radius_m < 1e-6:
        return 0.0, 0.0, 0.0
    return -turning * north_m / radius_m, turning * east_m / radius_m, 0.0


def main() -> None:
    """Fly the circle, trajectory 2, in calm air and through the whirl."""
    flights = [fly(trajectory=2, wind="calm", seed=1), fly(trajectory=2, wind=whirl, seed=1)]
    for flight in flights:
        print(
            f"{flight.wind}: mean error {1e3 * flight.mean_error_m:.1f} mm, "
            f"the air pushes by up to {flight.figures.wind_peak_m_s2:.2f} m/s²"
        )

    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.4), layout="constrained")
    above, below = figure.subplots(2, sharex=True)
    for flight in flights:
        times_s, error_m = flight.error()
        above.plot(times_s, 1e3 * error_m, label=flight.wind)
    above.set(ylabel="tracking error (mm)")
    above.legend()
    truth = flights[1].truth
    tracked = (truth.wind_track_s >= 0.0) & (truth.wind_track_s <= np.max(times_s))
    below.plot(truth.wind_track_s[tracked], truth.wind_acceleration_m_s2[tracked], color="0.4")
    below.set(xlabel="time since the trajectory began (s)", ylabel="push of the air (m/s²)")
    figure.savefig("own_wind.png", dpi=150)


if __name__ == "__main__":
    main()
