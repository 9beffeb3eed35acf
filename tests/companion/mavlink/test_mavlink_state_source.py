import math
import struct
from itertools import pairwise

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from companion.frames import (
    attitude_to_wire,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_multiply,
    swap_enu_ned,
    swap_flu_frd,
    yaw_of,
)
from companion.mavlink.codec import Packer
from companion.mavlink.framing import Framer
from companion.mavlink.messages import MessageId, Outgoing
from companion.mavlink.state_source import StateReader, StateSource
from companion.mavlink.telemetry import LARGEST_CARRY_S, Rejected, unwrapped_s
from companion.vehicle_state import VehicleState
from tests.companion.mavlink.test_mavlink_ardupilot import recorded
from tests.companion.mavlink.test_mavlink_telemetry import ASYMMETRIC, odometry, states

WRAP_MS = 2**32
milliseconds = st.integers(0, WRAP_MS - 1)


def frame(message_id, payload):
    (found,) = Framer().feed(Packer(1, 1).pack(Outgoing(message_id, payload)))
    return found


def position_of(state, time_ms):
    x, y, z = swap_enu_ned(state.position_enu_m)
    velocity = swap_enu_ned(state.velocity_enu_m_s)
    return frame(
        MessageId.LOCAL_POSITION_NED, struct.pack("<I6f", time_ms % WRAP_MS, x, y, z, *velocity)
    )


def attitude_of(state, time_ms):
    q = attitude_to_wire(state.attitude_flu_to_enu)
    rate = swap_flu_frd(state.rate_flu_rad_s)
    return frame(
        MessageId.ATTITUDE_QUATERNION, struct.pack("<I7f16x", time_ms % WRAP_MS, *q, *rate)
    )


def read(state, position_ms, attitude_ms, about_s=0.0):
    reader = StateReader()
    reader.source = StateSource.PARTS
    assert reader.take(attitude_of(state, attitude_ms), about_s) is None
    return reader.take(position_of(state, position_ms), about_s)


def angle_between_rad(a, b):
    w, x, y, z = quaternion_multiply(quaternion_conjugate(a), b)
    return 2.0 * math.atan2(math.hypot(x, y, z), abs(w))


@settings(deadline=None, derandomize=True)
@given(states, milliseconds)
def test_position_and_attitude_of_one_time_make_the_state(state, time_ms):
    made = read(state, time_ms, time_ms)
    assert isinstance(made, VehicleState)
    assert made.time_s == pytest.approx(time_ms / 1000)
    assert made.position_enu_m == pytest.approx(state.position_enu_m, abs=1e-4)
    assert made.velocity_enu_m_s == pytest.approx(state.velocity_enu_m_s, abs=1e-5)
    assert made.rate_flu_rad_s == pytest.approx(state.rate_flu_rad_s, abs=1e-5)
    assert angle_between_rad(made.attitude_flu_to_enu, state.attitude_flu_to_enu) < 1e-3


@settings(deadline=None, derandomize=True)
@given(states, milliseconds, st.integers(-30, 30))
def test_an_attitude_of_another_time_is_carried_by_its_rates(state, time_ms, lead_ms):
    """About the body's axes, by rate times time: forwards if it is older, backwards if newer."""
    made = read(state, time_ms, time_ms - lead_ms)
    assert isinstance(made, VehicleState)
    speed = math.hypot(*state.rate_flu_rad_s)
    turned = angle_between_rad(state.attitude_flu_to_enu, made.attitude_flu_to_enu)
    assert turned == pytest.approx(speed * abs(lead_ms) / 1000, abs=2e-3)
    back = read(
        VehicleState(
            state.time_s,
            state.position_enu_m,
            state.velocity_enu_m_s,
            made.attitude_flu_to_enu,
            state.rate_flu_rad_s,
        ),
        time_ms,
        time_ms + lead_ms,
    )
    assert angle_between_rad(back.attitude_flu_to_enu, state.attitude_flu_to_enu) < 3e-3


def test_the_attitude_is_carried_the_right_way():
    level = VehicleState(1.0, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0, 0, 2.0))
    made = read(level, 1020, 1000)
    assert yaw_of(made.attitude_flu_to_enu) == pytest.approx(0.04, abs=1e-4)


@settings(deadline=None, derandomize=True)
@given(milliseconds, st.integers(31, WRAP_MS - 31))
def test_an_attitude_from_too_far_is_refused(time_ms, lead_ms):
    made = read(ASYMMETRIC, time_ms, time_ms - lead_ms)
    assert isinstance(made, Rejected)
    assert "ATTITUDE_QUATERNION" in made.reason
    assert LARGEST_CARRY_S == 0.03


def test_a_position_without_an_attitude_is_refused():
    reader = StateReader()
    reader.source = StateSource.PARTS
    assert isinstance(reader.take(position_of(ASYMMETRIC, 5), 0.0), Rejected)
    reader.take(attitude_of(ASYMMETRIC, 5), 0.0)
    assert isinstance(reader.take(position_of(ASYMMETRIC, 5), 0.0), VehicleState)
    reader.forget()
    assert isinstance(reader.take(position_of(ASYMMETRIC, 5), 0.0), Rejected)


@settings(deadline=None, derandomize=True)
@given(st.floats(width=32), st.floats(width=32), st.floats(width=32), st.integers(-30, 30))
def test_no_rate_makes_a_state_that_is_not_finite(p, q, r, lead_ms):
    assume(not all(map(math.isfinite, (p, q, r))) or max(map(abs, (p, q, r))) > 50.0)
    state = VehicleState(
        0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), quaternion_from_euler(0.1, 0.2, 0.3), (p, q, r)
    )
    made = read(state, 1000, 1000 - lead_ms)
    if isinstance(made, VehicleState):
        numbers = (*made.attitude_flu_to_enu, *made.rate_flu_rad_s)
        assert all(map(math.isfinite, numbers))
        assert math.hypot(*made.attitude_flu_to_enu) == pytest.approx(1.0)


def test_messages_of_the_other_source_are_not_flown_on():
    reader = StateReader()
    assert reader.source is StateSource.ODOMETRY
    assert reader.take(attitude_of(ASYMMETRIC, 5), 0.0) is None
    assert reader.take(position_of(ASYMMETRIC, 5), 0.0) is None
    assert isinstance(reader.take(odometry(ASYMMETRIC), 0.0), VehicleState)
    reader.source = StateSource.PARTS
    assert reader.take(odometry(ASYMMETRIC), 0.0) is None


@settings(deadline=None, derandomize=True)
@given(st.integers(0, 5 * WRAP_MS), st.floats(-1e6, 1e6))
def test_a_wrap_of_the_boot_time_is_undone(true_ms, error_s):
    """As long as what is known of the time is right within 24 days."""
    found = unwrapped_s(true_ms % WRAP_MS, max(0.0, true_ms / 1000 + error_s))
    assert found == pytest.approx(true_ms / 1000, abs=1e-3)


def test_across_the_wrap_time_goes_on():
    before = read(ASYMMETRIC, WRAP_MS - 5, WRAP_MS - 5, about_s=WRAP_MS / 1000)
    after = read(ASYMMETRIC, 5, WRAP_MS - 5, about_s=WRAP_MS / 1000)
    assert after.time_s - before.time_s == pytest.approx(0.010, abs=1e-6)


def test_a_real_ardupilots_yaw_realignment_is_one_jump_and_no_gap():
    """6 s after take-off its estimator turns by 2.4 degrees in one sample; nothing else changes."""
    reader = StateReader()
    reader.source = StateSource.PARTS
    made = [reader.take(f, 0.0) for _, f in recorded("yaw-realignment.tlog")]
    samples = [s for s in made if s is not None]
    assert len(samples) > 130
    assert all(isinstance(s, VehicleState) for s in samples)
    turns, moves, steps_s = [], [], []
    for a, b in pairwise(samples):
        dt = b.time_s - a.time_s
        steps_s.append(dt)
        turns.append(
            abs(math.degrees(yaw_of(b.attitude_flu_to_enu) - yaw_of(a.attitude_flu_to_enu)))
        )
        expected = [p + v * dt for p, v in zip(a.position_enu_m, a.velocity_enu_m_s, strict=True)]
        moves.append(math.dist(b.position_enu_m, expected))
    assert max(turns) == pytest.approx(2.4, abs=0.2)
    assert sorted(turns)[-2] < 0.1
    assert max(moves) < 0.02
    assert min(steps_s) >= 0.008
    assert max(steps_s) <= 0.0121
