import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.frames import (
    attitude_to_wire,
    quaternion_conjugate,
    quaternion_from_euler,
    rotate,
    swap_enu_ned,
    swap_flu_frd,
)
from companion.mavlink.codec import Packer, encode
from companion.mavlink.framing import Framer
from companion.mavlink.messages import Outgoing
from companion.mavlink.telemetry import (
    Rejected,
    WindAcceleration,
    is_truth,
    state_from_odometry,
    wind_acceleration,
)
from companion.vehicle_state import VehicleState

ASYMMETRIC = VehicleState(
    time_s=12.344,
    position_enu_m=(1.5, -2.5, 3.25),
    velocity_enu_m_s=(0.5, -0.25, 0.125),
    attitude_flu_to_enu=quaternion_from_euler(0.1, -0.2, 0.7),
    rate_flu_rad_s=(0.01, -0.02, 0.03),
)

metres = st.floats(-1000, 1000, width=32)
three = st.tuples(metres, metres, metres)
states = st.builds(
    VehicleState,
    st.integers(0, 2**31).map(lambda ms: ms / 1000),
    three,
    st.tuples(*[st.floats(-50, 50, width=32)] * 3),
    st.builds(
        quaternion_from_euler, st.floats(-1, 1), st.floats(-1, 1), st.floats(-math.pi, math.pi)
    ),
    st.tuples(*[st.floats(-10, 10, width=32)] * 3),
)


def frame_of(name, component=1, /, **fields):
    (frame,) = Framer().feed(Packer(1, component).pack(encode(name, **fields)))
    return frame


def odometry(state, *, child_frame=1, component=1, **changes):
    """ODOMETRY as an autopilot sends it, from a state in the companion's frames."""
    q = attitude_to_wire(state.attitude_flu_to_enu)
    velocity = swap_enu_ned(state.velocity_enu_m_s)
    if child_frame in (8, 12):
        velocity = rotate(quaternion_conjugate(q), velocity)
    x, y, z = swap_enu_ned(state.position_enu_m)
    vx, vy, vz = velocity
    p, qq, r = swap_flu_frd(state.rate_flu_rad_s)
    fields = {
        "time_usec": round(state.time_s * 1e6), "frame_id": 1, "child_frame_id": child_frame,
        "x": x, "y": y, "z": z, "q": q, "vx": vx, "vy": vy, "vz": vz,
        "rollspeed": p, "pitchspeed": qq, "yawspeed": r,
        "pose_covariance": [0.0] * 21, "velocity_covariance": [0.0] * 21,
    }  # fmt: skip
    return frame_of("ODOMETRY", component, **(fields | changes))


def assert_same(state, expected):
    assert isinstance(state, VehicleState)
    assert state.time_s == pytest.approx(expected.time_s, abs=1e-6)
    assert state.position_enu_m == pytest.approx(expected.position_enu_m, abs=1e-4)
    assert state.velocity_enu_m_s == pytest.approx(expected.velocity_enu_m_s, abs=1e-4)
    assert state.attitude_flu_to_enu == pytest.approx(expected.attitude_flu_to_enu, abs=1e-6)
    assert state.rate_flu_rad_s == pytest.approx(expected.rate_flu_rad_s, abs=1e-5)


@settings(deadline=None, derandomize=True)
@given(states, st.sampled_from([1, 8, 12]))
def test_odometry_gives_the_state_whatever_frame_its_velocity_is_in(state, child_frame):
    assert_same(state_from_odometry(odometry(state, child_frame=child_frame)), state)


def test_px4s_velocity_is_ned_and_not_turned_by_the_attitude():
    frame = odometry(ASYMMETRIC, vx=1.0, vy=2.0, vz=3.0)

    assert state_from_odometry(frame).velocity_enu_m_s == (2.0, 1.0, -3.0)


def test_a_body_velocity_is_turned_by_the_attitude():
    facing_east = quaternion_from_euler(0.0, 0.0, 0.0)
    state = VehicleState(1.0, (0, 0, 0), (0, 0, 0), facing_east, (0, 0, 0))
    frame = odometry(state, child_frame=12, vx=1.0, vy=2.0, vz=3.0)

    velocity = state_from_odometry(frame).velocity_enu_m_s

    assert velocity == pytest.approx((1.0, -2.0, -3.0), abs=1e-6)


def test_a_negative_quaternion_is_the_same_attitude():
    q = attitude_to_wire(ASYMMETRIC.attitude_flu_to_enu)

    state = state_from_odometry(odometry(ASYMMETRIC, q=[-c for c in q]))

    assert rotate(state.attitude_flu_to_enu, (1.0, 2.0, 3.0)) == pytest.approx(
        rotate(ASYMMETRIC.attitude_flu_to_enu, (1.0, 2.0, 3.0)), abs=1e-5
    )


@pytest.mark.parametrize("field", ["x", "y", "z", "vx", "vy", "vz"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e30])
def test_a_position_or_velocity_that_cannot_be_is_rejected(field, bad):
    rejected = state_from_odometry(odometry(ASYMMETRIC, **{field: bad}))

    assert isinstance(rejected, Rejected)
    assert "ODOMETRY" in rejected.reason
    assert ("velocity" if "v" in field else "position") in rejected.reason


@pytest.mark.parametrize("field", ["rollspeed", "pitchspeed", "yawspeed"])
def test_rates_that_are_not_finite_are_rejected(field):
    rejected = state_from_odometry(odometry(ASYMMETRIC, **{field: math.nan}))

    assert isinstance(rejected, Rejected)
    assert "rates" in rejected.reason


@pytest.mark.parametrize(
    "q", [(0, 0, 0, 0), (math.nan, 0, 0, 0), (2, 0, 0, 0), (math.inf, 0, 0, 0), (0.9, 0, 0, 0)]
)
@pytest.mark.parametrize("child_frame", [1, 12])
def test_an_attitude_that_is_none_is_rejected(q, child_frame):
    rejected = state_from_odometry(odometry(ASYMMETRIC, q=q, child_frame_id=child_frame))

    assert isinstance(rejected, Rejected)


@pytest.mark.parametrize(
    ("frames", "word"),
    [({"frame_id": 20}, "frame 20"), ({"frame_id": 0}, "frame 0"), ({"child_frame_id": 4}, "4")],
)
def test_frames_that_cannot_be_used_are_named(frames, word):
    rejected = state_from_odometry(odometry(ASYMMETRIC, **frames))

    assert isinstance(rejected, Rejected)
    assert word in rejected.reason


def test_the_winds_acceleration_is_turned_to_enu():
    frame = frame_of("DEBUG_VECT", 240, name=b"wind_acc", time_usec=2_000_000, x=1.0, y=2.0, z=-3.0)

    assert wind_acceleration(frame) == WindAcceleration(2.0, (2.0, 1.0, 3.0))


def test_other_debug_vectors_are_not_wind():
    assert wind_acceleration(frame_of("DEBUG_VECT", name=b"x", time_usec=1, x=1, y=2, z=3)) is None
    rejected = wind_acceleration(
        frame_of("DEBUG_VECT", name=b"wind_acc", time_usec=1, x=math.nan, y=0, z=0)
    )
    assert isinstance(rejected, Rejected)


def test_truth_is_told_from_telemetry():
    assert is_truth(odometry(ASYMMETRIC, component=240))
    assert not is_truth(odometry(ASYMMETRIC))
    assert is_truth(
        frame_of(
            "HIL_STATE_QUATERNION",
            time_usec=0, attitude_quaternion=[1, 0, 0, 0], rollspeed=0, pitchspeed=0, yawspeed=0,
            lat=0, lon=0, alt=0, vx=0, vy=0, vz=0, ind_airspeed=0, true_airspeed=0,
            xacc=0, yacc=0, zacc=0,
        )
    )  # fmt: skip


@settings(deadline=None, derandomize=True, max_examples=300)
@given(st.binary(max_size=255))
def test_no_payload_raises_and_every_state_is_finite(payload):
    frames = {
        message_id: Framer().feed(Packer(1).pack(Outgoing(message_id, payload)))[0]
        for message_id in (331, 250)
    }
    wind_acceleration(frames[250])

    state = state_from_odometry(frames[331])
    if isinstance(state, VehicleState):
        numbers = (
            *state.position_enu_m,
            *state.velocity_enu_m_s,
            *state.attitude_flu_to_enu,
            *state.rate_flu_rad_s,
        )
        assert all(math.isfinite(number) for number in numbers)
        assert math.hypot(*state.attitude_flu_to_enu) == pytest.approx(1.0)
