"""The 95 % intervals contain the truth about that often: a small Monte Carlo."""

import numpy as np
import pytest

from companion.identification.attitude_fit import fit_tilt
from companion.identification.lift_fit import fit_lift
from companion.identification.lift_model import lag_as_second_order
from companion.identification.push_fit import fit_push
from tests.companion.identification.synthetic import GNSS, MOCAP, Truth, record

TRUTH = Truth()
SEEDS = range(5)


def share_covered(pairs):
    return np.mean(
        [abs(estimate.value - true) <= estimate.half_width_95 for estimate, true in pairs]
    )


@pytest.mark.parametrize("noise", [MOCAP, GNSS], ids=["mocap", "gnss"])
def test_intervals_cover(noise):
    omega, _ = lag_as_second_order(TRUTH.lag_s)
    pairs = []
    for seed in SEEDS:
        flown = record(TRUTH, noise, seed)
        roll = fit_tilt(flown, "roll").response
        lift = fit_lift(flown)
        push = fit_push(flown)
        pairs += [
            (roll.natural_frequency_rad_s, TRUTH.omega_rad_s),
            (roll.damping, TRUTH.zeta),
            (roll.dead_time_s, TRUTH.dead_time_s),
            (roll.gain, TRUTH.gain),
            (lift.response.natural_frequency_rad_s, omega),
            (lift.response.dead_time_s, TRUTH.lift_dead_time_s),
            (lift.response.gain, 1.0),
            (lift.hover_thrust, TRUTH.hover_thrust),
            (push.tilt_gain, TRUTH.tilt_gain),
            (push.linear_drag_1_s, TRUTH.linear_drag_1_s),
        ]
    # 50 intervals, some of them of one fit and so not independent.
    assert 0.86 <= share_covered(pairs) <= 1.0


def test_more_noise_makes_wider_intervals():
    quiet, loud = (fit_lift(record(TRUTH, noise, 1)) for noise in (MOCAP, GNSS))
    assert quiet.hover_thrust.half_width_95 < loud.hover_thrust.half_width_95
    assert 3.0 * quiet.response.dead_time_s.half_width_95 < loud.response.dead_time_s.half_width_95
