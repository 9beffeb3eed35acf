import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink

from companion.frames import (
    attitude_from_wire,
    attitude_to_wire,
    quaternion_from_euler,
    swap_flu_frd,
)
from companion.mavlink.codec import Packer, decode
from companion.mavlink.framing import Framer
from companion.mavlink.messages import Target
from companion.mavlink.setpoints import (
    AttitudeSetpoint,
    BodyRateSetpoint,
    InvalidSetpointError,
    setpoint_message,
)

LEVEL = (1.0, 0.0, 0.0, 0.0)
tilts = st.floats(-0.8, 0.8)
attitudes = st.builds(quaternion_from_euler, tilts, tilts, st.floats(-math.pi, math.pi))
thrusts = st.floats(0.0, 1.0)
rates = st.tuples(*[st.floats(-12.0, 12.0)] * 3)


def on_the_wire(setpoint, time_s=12.345):
    (frame,) = Framer().feed(Packer(4).pack(setpoint_message(setpoint, time_s, Target(4, 1))))
    return decode(frame)


@settings(deadline=None, derandomize=True)
@given(attitudes, thrusts)
def test_an_attitude_comes_back_as_it_was_sent(attitude, thrust):
    message = on_the_wire(AttitudeSetpoint(attitude, thrust))

    assert message.type_mask == 7
    assert attitude_from_wire(tuple(message.q)) == pytest.approx(attitude, abs=1e-6)
    assert message.thrust == pytest.approx(thrust, abs=1e-7)
    assert (message.target_system, message.target_component) == (4, 1)


@settings(deadline=None, derandomize=True)
@given(rates, thrusts)
def test_body_rates_come_back_as_they_were_sent(rate, thrust):
    message = on_the_wire(BodyRateSetpoint(rate, thrust))

    wire = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    assert message.type_mask == 128
    assert swap_flu_frd(wire) == pytest.approx(rate, abs=1e-5)
    assert message.thrust == pytest.approx(thrust, abs=1e-7)


@settings(deadline=None, derandomize=True)
@given(
    st.one_of(
        st.builds(AttitudeSetpoint, attitudes, thrusts), st.builds(BodyRateSetpoint, rates, thrusts)
    ),
    st.floats(0.0, 4e6),
    st.integers(1, 255),
)
def test_the_packet_is_pymavlinks_to_the_byte(setpoint, time_s, system_id):
    packer = Packer(4)
    packer.sequence = 200
    raw = packer.pack(setpoint_message(setpoint, time_s, Target(system_id, 1)))

    if isinstance(setpoint, AttitudeSetpoint):
        mask, q, rate = 7, attitude_to_wire(setpoint.attitude_flu_to_enu), (0.0, 0.0, 0.0)
    else:
        mask, q, rate = 128, LEVEL, swap_flu_frd(setpoint.rate_flu_rad_s)
    message = pymavlink.MAVLink_set_attitude_target_message(
        round(time_s * 1e3), system_id, 1, mask, q, *rate, setpoint.thrust
    )
    theirs = pymavlink.MAVLink(None, srcSystem=4, srcComponent=191)
    theirs.seq = 200
    assert raw == bytes(message.pack(theirs))


def test_level_and_facing_east_is_a_heading_of_90_degrees():
    q = on_the_wire(AttitudeSetpoint(LEVEL, 0.5)).q

    assert tuple(q) == pytest.approx((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)), abs=1e-7)


def test_nose_down_and_right_side_down_have_the_wires_signs():
    # ENU yaw 90 degrees faces north, where NED angles can be read off directly.
    attitude = quaternion_from_euler(0.2, 0.1, math.pi / 2)
    expected = quaternion_from_euler(0.2, -0.1, 0.0)

    assert tuple(on_the_wire(AttitudeSetpoint(attitude, 0.5)).q) == pytest.approx(
        expected, abs=1e-7
    )


def test_positive_rates_turn_left_on_the_wire_and_nose_up():
    message = on_the_wire(BodyRateSetpoint((0.1, 0.2, 0.3), 0.5))

    wire = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    assert wire == pytest.approx((0.1, -0.2, -0.3))


def test_the_time_is_the_autopilots_in_milliseconds():
    assert on_the_wire(AttitudeSetpoint(LEVEL, 0.5), 12.344).time_boot_ms == 12344
    assert on_the_wire(AttitudeSetpoint(LEVEL, 0.5), 4294967.0).time_boot_ms == 4294967000


bad_numbers = st.sampled_from([math.nan, math.inf, -math.inf])


@settings(deadline=None, derandomize=True)
@given(attitudes, st.integers(0, 3), bad_numbers)
def test_an_attitude_that_is_not_finite_cannot_be_made(attitude, place, bad):
    broken = tuple(bad if i == place else value for i, value in enumerate(attitude))

    with pytest.raises(InvalidSetpointError):
        AttitudeSetpoint(broken, 0.5)


@pytest.mark.parametrize("thrust", [-1e-9, 1.0 + 1e-9, math.nan, math.inf])
def test_a_thrust_out_of_range_cannot_be_made(thrust):
    with pytest.raises(InvalidSetpointError, match="thrust"):
        AttitudeSetpoint(LEVEL, thrust)
    with pytest.raises(InvalidSetpointError, match="thrust"):
        BodyRateSetpoint((0.0, 0.0, 0.0), thrust)


@settings(deadline=None, derandomize=True)
@given(attitudes, st.one_of(st.floats(0.0, 0.998), st.floats(1.002, 3.0)))
def test_a_quaternion_off_norm_cannot_be_made(attitude, scale):
    with pytest.raises(InvalidSetpointError, match="norm"):
        AttitudeSetpoint(tuple(scale * c for c in attitude), 0.5)


@pytest.mark.parametrize("tilt_deg", [76, 90, 135, 180])
def test_a_tilt_that_no_flight_needs_cannot_be_made(tilt_deg):
    with pytest.raises(InvalidSetpointError, match="tilts"):
        AttitudeSetpoint(quaternion_from_euler(math.radians(tilt_deg), 0.0, 0.3), 0.5)


@pytest.mark.parametrize("bad", [12.1, -12.1, math.nan, math.inf])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_rates_out_of_bounds_cannot_be_made(place, bad):
    with pytest.raises(InvalidSetpointError, match="rates"):
        BodyRateSetpoint(tuple(bad if i == place else 0.1 for i in range(3)), 0.5)


def test_after_49_days_the_time_begins_again_as_the_autopilots_does():
    assert on_the_wire(AttitudeSetpoint(LEVEL, 0.5), 4294967.295).time_boot_ms == 2**32 - 1
    assert on_the_wire(AttitudeSetpoint(LEVEL, 0.5), 4294967.296).time_boot_ms == 0
    assert on_the_wire(AttitudeSetpoint(LEVEL, 0.5), 4294968.0).time_boot_ms == 704


@pytest.mark.parametrize("time_s", [-0.001, math.nan, math.inf])
def test_a_time_that_is_none_is_refused(time_s):
    with pytest.raises(InvalidSetpointError, match="time"):
        setpoint_message(AttitudeSetpoint(LEVEL, 0.5), time_s, Target(1))


def test_each_type_says_how_often_it_must_be_sent():
    assert AttitudeSetpoint.minimum_rate_hz >= 50.0
    assert BodyRateSetpoint.minimum_rate_hz >= AttitudeSetpoint.minimum_rate_hz
