"""Flights made of arrays, whose tracking error is known."""

import numpy as np

from companion.report.flight_data import FlightData, Ticks, Truth

NO_TRUTH = Truth(np.empty(0), np.empty((0, 3)), np.empty((0, 3)), np.empty(0), np.empty(0))


def circle(times_s):
    """A circle of 1 m, once around in 6.3 s, as the desired path."""
    return np.stack([np.cos(times_s), np.sin(times_s), np.full(len(times_s), 1.2)], axis=1)


def make_ticks(times_s, position_m, desired_m, **changes):
    count = len(times_s)
    fields = {
        "time_s": times_s,
        "position_enu_m": position_m,
        "velocity_enu_m_s": np.zeros((count, 3)),
        "desired_enu_m": desired_m,
        "r2_enu_m": desired_m,
        "r1_enu_m_s": np.zeros((count, 3)),
        "u": np.zeros((count, 3)),
        "applied_u": np.zeros((count, 3)),
        "y_tilde_m_s": np.full((count, 3), 0.01),
        "sigma_hat": np.zeros((count, 3)),
        "projecting": np.zeros(count, dtype=bool),
        "roll_rad": np.full(count, 0.1),
        "pitch_rad": np.full(count, -0.1),
        "thrust": np.full(count, 0.5),
        "hover_thrust": np.full(count, 0.49),
        "computed_us": np.full(count, 80.0),
        "plan": np.array(["closed_form", "", ""] * count, dtype=str)[:count],
        "r_max_active": np.zeros(count, dtype=bool),
        "on_fallback": np.zeros(count, dtype=bool),
        "phase": np.where(times_s < 5.0, "hover", np.where(times_s < 25.0, "track", "return")),
    }
    return Ticks(**(fields | changes))


def make_truth(times_s, position_m, wind_m_s2=None):
    wind = np.zeros(len(times_s)) if wind_m_s2 is None else wind_m_s2
    return Truth(times_s, position_m, np.zeros_like(position_m), times_s, wind)


def make_flight(*, offset_m=(0.0, 0.0, 0.0), true_offset_m=None, end_s=30.0, wind_m_s2=None):
    """A flight around the circle, sampled at 100 Hz, displaced by constant offsets."""
    times = np.arange(0.0, end_s, 0.01)
    ticks = make_ticks(times, circle(times) + offset_m, circle(times))
    if true_offset_m is None:
        return FlightData(ticks, NO_TRUTH)
    # The truth is sampled by the simulator's clock, not at the ticks.
    true_times = np.arange(0.0, end_s, 0.012)
    position = circle(true_times) + true_offset_m
    return FlightData(ticks, make_truth(true_times, position, wind_m_s2))
