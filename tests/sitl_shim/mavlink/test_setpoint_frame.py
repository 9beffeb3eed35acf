"""Setpoints are read straight from their frames as pymavlink would, or not at all."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.autopilot.interface import AttitudeTarget
from sitl_shim.frames import attitude_from_wire, swap_flu_frd
from sitl_shim.mavlink.setpoint_frame import read_setpoint
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Packer, dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import ShimClient

LAW = settings(deadline=None, derandomize=True, max_examples=60)
NUMBER = st.floats(width=32, allow_nan=False) | st.just(0.0)
BYTE = st.integers(0, 255)


@st.composite
def setpoints(draw):
    four, three = st.tuples(*[NUMBER] * 4), st.tuples(*[NUMBER] * 3)
    return dialect.MAVLink_set_attitude_target_message(
        draw(st.integers(0, 2**32 - 1)),
        draw(BYTE),
        draw(BYTE),
        draw(BYTE),
        draw(four),
        *draw(three),
        draw(NUMBER),
    )


@LAW
@given(message=setpoints())
def test_it_reads_what_was_sent(message):
    read = read_setpoint(Packer(245, 190).pack(message))
    assert read is not None
    w, x, y, z = message.q
    rates = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    assert read.target == AttitudeTarget(
        message.type_mask, attitude_from_wire((w, x, y, z)), swap_flu_frd(rates), message.thrust
    )
    assert (read.target_system, read.target_component) == (
        message.target_system,
        message.target_component,
    )


@LAW
@given(message=setpoints(), data=st.data())
def test_what_is_damaged_or_no_whole_frame_is_left_to_the_parser(message, data):
    frame = Packer(245, 190).pack(message)
    place = data.draw(st.integers(0, len(frame) - 1))
    change = data.draw(st.integers(1, 255))
    damaged = bytearray(frame)
    damaged[place] ^= change
    assert read_setpoint(bytes(damaged)) is None
    assert read_setpoint(frame[:place]) is None
    assert read_setpoint(frame + b"\0") is None
    assert read_setpoint(frame + frame) is None


def test_other_messages_and_signed_ones_are_left_to_the_parser():
    packer = Packer(245, 190)
    assert read_setpoint(packer.pack(dialect.MAVLink_ping_message(1, 2, 0, 0))) is None
    level = (1.0, 0.0, 0.0, 0.0)
    setpoint = dialect.MAVLink_set_attitude_target_message(1, 1, 1, 7, level, 0, 0, 0, 0.5)
    assert read_setpoint(packer.pack(setpoint)) is not None
    packer.sign(bytes(32), 0, lambda: 1)
    assert read_setpoint(packer.pack(setpoint)) is None


@pytest.mark.parametrize("split", [None, 20])
def test_a_setpoint_counts_the_same_whole_or_in_two_pieces(split):
    client = ShimClient(ShimOptions(), (LinkKind.ONBOARD,))
    client.run(2.0)
    half = math.sqrt(0.5)
    frame = Packer(245, 190).pack(
        dialect.MAVLink_set_attitude_target_message(
            1, 1, 1, 7, (half, 0, half, 0), 0.1, 0.2, 0.3, 0.25
        )
    )
    taken = []
    client.simulation.autopilot.receive_attitude_target = taken.append
    for piece in (frame,) if split is None else (frame[:split], frame[split:]):
        client.shim.receive(0, piece, client.shim.time_s)
        client.run(0.1)
    assert len(taken) == 1
    assert taken[0].type_mask == 7
    assert taken[0].thrust == 0.25
    assert taken[0].rate_flu_rad_s == pytest.approx((0.1, -0.2, -0.3))
