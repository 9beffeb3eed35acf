"""Body rates in place of attitudes: at samples, in silence, and when all is lost."""

import math
from dataclasses import replace

import numpy as np
import pytest

from companion.config.resolve import load_flight
from companion.config.yaml_source import ConfigError
from companion.control.attitude import carried
from companion.flight.assemble import make_stack, make_trajectory, supervisor_limits
from companion.flight.setpoints.control_loop import ControlLoop
from companion.flight.setpoints.supervisor import Rung
from companion.flight.setpoints.timeline import plan_timeline
from companion.frames import quaternion_from_euler, tilt_cosine
from companion.vehicle_state import VehicleState

CONFIG = load_flight(None, {"trajectory": 4, "setpoint": "rates"}, {})
POSITION = (0.1, -0.2, 2.0)


@pytest.fixture
def loop():
    stack = make_stack(CONFIG.controller, CONFIG.vehicle, CONFIG.mission)
    return ControlLoop(stack, supervisor_limits(CONFIG.mission))


def state_at(time_s, roll=0.0, pitch=0.0, yaw=0.4, rate=(0.0, 0.0, 0.0)):
    attitude = quaternion_from_euler(roll, pitch, yaw)
    return VehicleState(time_s, POSITION, (0.0, 0.0, 0.0), attitude, rate)


def engage(loop, start_s):
    timeline = plan_timeline(
        make_trajectory(CONFIG.mission),
        start_s=start_s,
        from_m=np.array(POSITION),
        home_m=np.array(POSITION),
        hover_s=1.0,
        speed_m_s=0.6,
    )
    loop.engage(timeline, 0.4)


def test_holding_levels_by_rates(loop):
    x, y, z = loop.on_sample(state_at(10.0, roll=0.2), 0.0).rate_flu_rad_s
    assert x < -0.5
    assert (y, z) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_the_attitude_is_carried_over_the_delay(loop):
    still = loop.on_sample(state_at(10.0, roll=0.1), 0.05).rate_flu_rad_s
    turning = loop.on_sample(state_at(10.01, roll=0.1, rate=(-2.0, 0.0, 0.0)), 0.05)
    gain = CONFIG.vehicle.attitude_loop.tilt_gain_1_s
    assert turning.rate_flu_rad_s[0] == pytest.approx(still[0] + gain * 2.0 * 0.05)


def test_rates_lead_to_the_attitude_that_would_have_been_sent(loop):
    engage(loop, 10.0)
    outputs = [loop.on_sample(state_at(10.0 + 0.01 * k, pitch=0.1), 0.03) for k in range(30)]
    for output in outputs:
        assert output.rung is Rung.TRACK
        assert all(math.isfinite(rate) for rate in output.rate_flu_rad_s)
    attitude = state_at(0.0, pitch=0.1).attitude_flu_to_enu
    wanted = outputs[-1].attitude_flu_to_enu
    before = sum(a * b for a, b in zip(attitude, wanted, strict=True))
    after = sum(
        a * b
        for a, b in zip(carried(attitude, outputs[-1].rate_flu_rad_s, 0.05), wanted, strict=True)
    )
    assert abs(after) > abs(before)


def test_in_silence_the_vehicle_is_levelled_by_reckoning_and_not_left_turning(loop):
    engage(loop, 10.0)
    for k in range(20):
        output = loop.on_sample(state_at(10.0 + 0.01 * k, roll=-0.3), 0.03)
    attitude, rate, now = state_at(0.0, roll=-0.3).attitude_flu_to_enu, output.rate_flu_rad_s, 10.19
    while True:
        now += 0.02
        attitude = carried(attitude, rate, 0.02)  # a vehicle that does as it is told
        output = loop.on_silence(now, now - 10.19, "")
        if output is None:
            continue
        if output.rung is Rung.HAND_OVER:
            break
        rate = output.rate_flu_rad_s
        assert output.rung is Rung.LEVEL
    assert output.rate_flu_rad_s is None
    assert tilt_cosine(attitude) > math.cos(math.radians(1.0))
    assert max(abs(r) for r in rate) < 0.1


def test_attitudes_carry_no_rates():
    mission = CONFIG.mission.model_copy(update={"setpoint": "attitude"})
    stack = make_stack(CONFIG.controller, CONFIG.vehicle, mission)
    loop = ControlLoop(stack, supervisor_limits(mission))
    assert loop.on_sample(state_at(1.0), 0.0).rate_flu_rad_s is None


def test_a_vehicle_without_an_attitude_loop_can_not_be_flown_by_rates():
    vehicle = CONFIG.vehicle.model_copy(update={"attitude_loop": None})
    with pytest.raises(ConfigError, match="'bebop2' states no attitude loop"):
        make_stack(CONFIG.controller, vehicle, CONFIG.mission)


def test_another_stack_is_adopted_while_holding(loop):
    heavier = CONFIG.vehicle.model_copy(update={"hover_thrust": 0.6})
    before = loop.on_sample(state_at(1.0), 0.0).thrust
    limits = replace(supervisor_limits(CONFIG.mission), state_age_limit_s=0.07)
    loop.adopt(make_stack(CONFIG.controller, heavier, CONFIG.mission), limits)
    after = loop.on_sample(state_at(1.01), 0.0)
    assert (before, after.thrust) == pytest.approx((CONFIG.vehicle.hover_thrust, 0.6))
    assert loop.state_age_limit_s == 0.07
