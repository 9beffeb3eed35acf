"""Gains are derived by a stated method: the same for the same vehicle, certified, with room."""

import numpy as np
import pytest

from companion.config.models import MissionConfig, ResponseConfig, VehicleConfig
from companion.config.resolve import FlightConfig, find_config
from companion.config.validation import validate
from companion.config.yaml_source import read_yaml
from companion.control.qp.condensed import Weights
from companion.experiments.certified import certificate_subject
from companion.identification.recommend import ASSUMED_NOISE, recommend
from companion.identification.recommend_loop import AxisNoise, Candidates, LoopBuilder, Rates
from companion.identification.recommend_plants import horizontal_family
from companion.identification.recommend_plus import plus_gains
from companion.identification.recommend_score import HORIZONTAL, Scorer
from companion.identification.recommend_search import NothingHoldsError
from companion.theory.certificate import certify

FEW = 6
"""Generations: enough for gains that hold, and not for the best."""


def vehicle(name="bebop2", **dynamics):
    stated = validate(VehicleConfig, read_yaml(find_config("vehicle", name)))
    changed = stated.dynamics.model_copy(update=dynamics)
    return stated.model_copy(update={"dynamics": changed, "noise": ASSUMED_NOISE})


@pytest.fixture(scope="module")
def bebop2():
    return recommend(vehicle(), generations=FEW)


def scorer(dynamics):
    rates = Rates(0.01, 3, dynamics.loop_delay_s, Weights(17.0, 0.08, 0.02))
    return Scorer(
        LoopBuilder(horizontal_family(dynamics), rates, AxisNoise(1e-3, 1.5e-2, 0.01)),
        HORIZONTAL,
        60,
        0.57,
    )


def candidates(*rows):
    m, omega, k, gamma, horizon = zip(*rows, strict=True)
    return Candidates(
        np.array(m), np.array(omega), np.array(k), np.array(gamma), tuple(int(h) for h in horizon)
    )


def test_recommended_gains_are_certified_with_room_for_delay(bebop2):
    flown = vehicle()
    config = FlightConfig(MissionConfig(), flown, bebop2.controller)
    certificate = certify(certificate_subject(config, 4.5))
    assert certificate.holds
    for axis in certificate.axes:
        assert axis.whole_margins[2] >= 0.020
        assert axis.gamma_low < axis.loop.gamma <= axis.gamma_safe
        # The projection covers full tilt in the worst wind: no caution.
        assert not any(condition.caution for condition in axis.conditions)


def test_the_same_vehicle_gets_the_same_gains():
    once = recommend(vehicle("x500"), climb_rate_field=True, generations=2)
    again = recommend(vehicle("x500"), climb_rate_field=True, generations=2)
    assert once.controller == again.controller


def test_another_climb_rate_loop_has_gains_of_its_own(bebop2):
    l1 = bebop2.controller.l1
    assert l1.climb_rate is not None
    assert l1.climb_rate.m < l1.m[2]


def test_where_the_autopilot_flies_the_climb_rate_its_loop_decides():
    found = recommend(vehicle("arducopter"), climb_rate_field=True, generations=4)
    assert found.controller.l1.climb_rate is None
    assert found.controller.l1.m[2] == found.climb_rate.m
    # Its loop is too slow for what the companion's own bears.
    assert found.controller.l1.m[2] < 2.0


def test_a_vehicle_that_swings_too_much_for_the_controller_is_told_so():
    late = vehicle(attitude=ResponseConfig(natural_frequency_rad_s=12.0, damping=0.02, delay_s=1.0))
    with pytest.raises(NothingHoldsError, match="no gains of mpc-l1"):
        recommend(late, generations=1)


def test_a_vehicle_without_dynamics_is_refused():
    with pytest.raises(ValueError, match="states no dynamics"):
        recommend(vehicle().model_copy(update={"dynamics": None}))


def test_gains_that_hold_score_better_than_those_that_do_not():
    found = scorer(vehicle().dynamics).scores(
        candidates(
            (0.358, 0.152, 0.964, 487, 35),  # found by a search
            (0.358, 0.6, 0.964, 487, 35),  # four times the loop's gain
            (0.358, 0.152, 0.964, 250, 35),  # an estimate that lags behind
        )
    )
    assert found.hold.tolist() == [True, False, False]
    assert found.total_mm[0] < found.total_mm[1:].min()


def test_a_wandering_estimate_asks_for_other_gains_than_a_good_one():
    dynamics = vehicle("sih_quadx").dynamics
    rates = Rates(0.01, 3, dynamics.loop_delay_s, Weights(17.0, 0.08, 0.02))
    errors = []
    for noise in (AxisNoise(1e-3, 1e-2, 0.01), AxisNoise(1e-3, 1e-2, 0.4)):
        one = Scorer(LoopBuilder(horizontal_family(dynamics), rates, noise), HORIZONTAL, 60, 0.64)
        errors.append(one.scores(candidates((0.482, 0.213, 0.539, 315, 56))).errors_mm[0, 0])
    assert errors[1] > 2.0 * errors[0]


@pytest.mark.parametrize(
    ("name", "bandwidth"), [("bebop2", 9.49), ("x500", 11.1), ("sih_quadx", 6.64)]
)
def test_bandwidths_of_mpc_l1_plus_go_inversely_with_the_lag(name, bandwidth):
    plus = plus_gains(vehicle(name).dynamics)
    assert plus.bandwidth_rad_s[:2] == (bandwidth, bandwidth)
    assert plus.climb_rate is not None
    slower = ResponseConfig(natural_frequency_rad_s=4.0, damping=1.0)
    slow = plus_gains(vehicle(name, attitude=slower).dynamics)
    assert slow.bandwidth_rad_s[0] < bandwidth
    assert slow.rate_time_s[0] > plus.rate_time_s[0]
