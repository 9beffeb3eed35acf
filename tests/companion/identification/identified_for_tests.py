"""An identification as a flight might give it, without a flight."""

import numpy as np

from companion.identification.estimates import (
    Estimate,
    FittedCurve,
    Identified,
    NoiseEstimates,
    Response,
)


def response(omega, zeta, dead_time_s, gain=1.0):
    return Response(
        Estimate(omega, 0.3, "rad/s"),
        Estimate(zeta, 0.04, "1"),
        Estimate(dead_time_s, 0.003, "s"),
        Estimate(gain, 0.02, "1"),
    )


def _curve(name, quantity, rng):
    time = np.concatenate([np.arange(0.0, 4.0, 0.01), np.arange(9.0, 12.0, 0.01)])
    commanded = np.sign(np.sin(1.6 * time)) * 0.1
    fitted = 0.1 * np.sin(1.6 * time)
    measured = fitted + 0.004 * rng.standard_normal(len(time))
    return FittedCurve(name, quantity, time, measured, fitted, commanded)


def identified(**changes):
    rng = np.random.default_rng(3)
    three = (Estimate(0.001, 0.0001, "m"),) * 3
    values = {
        "roll": response(12.2, 0.82, 0.041),
        "pitch": response(11.8, 0.80, 0.039),
        "tilt_gain": Estimate(0.98, 0.01, "1"),
        "lift": response(45.0, 1.1, 0.034),
        "climb": response(9.9, 1.02, 0.032),
        "linear_drag_1_s": Estimate(0.16, 0.02, "1/s"),
        "quadratic_drag_1_m": Estimate(-0.001, 0.01, "1/m"),
        "hover_thrust": Estimate(0.51, 0.002, "1"),
        "loop_delay_s": Estimate(0.030, 0.001, "s"),
        "loop_delay_jitter_s": Estimate(0.002, 0.0005, "s"),
        "noise_estimates": NoiseEstimates(
            three,
            (Estimate(0.015, 0.001, "m/s"),) * 3,
            (Estimate(0.03, 0.005, "m/s²/√Hz"),) * 3,
            Estimate(0.0009, 0.0001, "rad"),
        ),
        "trim_roll_rad": Estimate(0.010, 0.002, "rad"),
        "trim_pitch_rad": Estimate(-0.008, 0.002, "rad"),
        "curves": tuple(
            _curve(name, quantity, rng)
            for name, quantity in (
                ("roll", "roll, rad"),
                ("pitch", "pitch, rad"),
                ("lift", "vertical acceleration, m/s²"),
                ("climb", "climb rate, m/s"),
                ("x", "acceleration, m/s²"),
                ("y", "acceleration, m/s²"),
            )
        ),
    }
    return Identified(**{**values, **changes})
