"""What is packed ahead is, byte for byte, what pymavlink packs."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.mavlink.packets import Layout, Packet
from sitl_shim.mavlink.wire import Packer, Parser, dialect

LAW = settings(deadline=None, derandomize=True, max_examples=60)
KEY = bytes(range(32))
MESSAGES = (
    dialect.MAVLink_attitude_message,
    dialect.MAVLink_attitude_quaternion_message,
    dialect.MAVLink_local_position_ned_message,
    dialect.MAVLink_global_position_int_message,
    dialect.MAVLink_highres_imu_message,
    dialect.MAVLink_odometry_message,
    dialect.MAVLink_altitude_message,
    dialect.MAVLink_attitude_target_message,
    dialect.MAVLink_position_target_local_ned_message,
    dialect.MAVLink_vfr_hud_message,
    dialect.MAVLink_debug_vect_message,
)
RANGES = {
    "uint8_t": (0, 255),
    "int8_t": (-128, 127),
    "uint16_t": (0, 65535),
    "int16_t": (-32768, 32767),
    "uint32_t": (0, 2**32 - 1),
    "int32_t": (-(2**31), 2**31 - 1),
    "uint64_t": (0, 2**64 - 1),
}
FLOATS = st.floats(width=32) | st.just(0.0)


@st.composite
def contents(draw):
    """One message: its class, and its fields in pymavlink's order."""
    message = draw(st.sampled_from(MESSAGES))
    fields = {}
    arrays = dict(zip(message.ordered_fieldnames, message.array_lengths, strict=True))
    for name, kind in zip(message.fieldnames, message.fieldtypes, strict=True):
        if kind == "char":
            fields[name] = draw(st.binary(min_size=arrays[name], max_size=arrays[name]))
            continue
        one = FLOATS if kind == "float" else st.integers(*RANGES[kind]) | st.just(0)
        length = arrays[name]
        fields[name] = (
            draw(st.lists(one, min_size=length, max_size=length)) if length else draw(one)
        )
    return message, fields


def packet_of(message, fields):
    """The same as a packet: its fields in the order of the wire, arrays in place."""
    layout = Layout(message)
    values = []
    for name in message.ordered_fieldnames:
        value = fields[name]
        values += value if isinstance(value, list) else [value]
    return Packet(layout, layout.pack(*values))


@LAW
@given(several=st.lists(contents(), min_size=1, max_size=4))
def test_frames_and_their_numbers_are_those_of_pymavlink(several):
    ours, theirs = Packer(7, 240), Packer(7, 240)
    for message, fields in several:
        assert ours.pack(packet_of(message, fields)) == theirs.pack(message(**fields))


def test_the_numbers_go_round():
    ours, theirs = Packer(7, 240), Packer(7, 240)
    layout = Layout(dialect.MAVLink_timesync_message)
    for k in range(600):
        packet = Packet(layout, layout.pack(k, 5))
        assert ours.pack(packet) == theirs.pack(dialect.MAVLink_timesync_message(k, 5))


@LAW
@given(content=contents(), stamp=st.integers(0, 2**48 - 1), link_id=st.integers(0, 255))
def test_signed_frames_are_those_of_pymavlink(content, stamp, link_id):
    message, fields = content
    ours, theirs = Packer(1, 1), Packer(1, 1)
    for packer in (ours, theirs):
        packer.sign(KEY, link_id, lambda: stamp)
    assert ours.pack(packet_of(message, fields)) == theirs.pack(message(**fields))
    for packer in (ours, theirs):
        packer.sign(None, link_id, lambda: stamp)
    assert ours.pack(packet_of(message, fields)) == theirs.pack(message(**fields))


def test_packets_and_messages_share_one_numbering():
    packer, parser = Packer(1, 1), Parser()
    layout = Layout(dialect.MAVLink_attitude_message)
    packet = Packet(layout, layout.pack(1, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0))
    frames = [packer.pack(m) for m in (packet, dialect.MAVLink_ping_message(1, 2, 0, 0), packet)]
    read = list(parser.parse(b"".join(frames)))
    assert [message.get_type() for message in read] == ["ATTITUDE", "PING", "ATTITUDE"]
    assert [message.get_seq() for message in read] == [0, 1, 2]


def test_numbers_that_stand_as_one_piece_change_nothing():
    plain = Layout(dialect.MAVLink_odometry_message)
    grouped = Layout(dialect.MAVLink_odometry_message, "<Q13f168s5B")
    covariances = [0.5 * k for k in range(42)]
    motion, end = [0.1 * k for k in range(13)], [1, 1, 3, 8, 0]
    piece = struct.pack("<42f", *covariances)
    assert plain.pack(9, *motion, *covariances, *end) == grouped.pack(9, *motion, piece, *end)


def test_a_grouping_of_another_length_is_refused():
    with pytest.raises(ValueError, match="ODOMETRY has 233 bytes"):
        Layout(dialect.MAVLink_odometry_message, "<Q13f164s5B")
