import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink

from companion.mavlink import commands, messages
from companion.mavlink.codec import Packer, UnknownMessageError, decode, encode
from companion.mavlink.framing import Frame, Framer
from companion.mavlink.messages import Outgoing, Severity, Target, VehicleStateOfHealth

TARGET = Target(3, 1)


def sent(outgoing):
    (frame,) = Framer().feed(Packer(3).pack(outgoing))
    return decode(frame)


def test_a_packet_is_what_pymavlink_would_make():
    packer = Packer(7, 191)
    mav = pymavlink.MAVLink(None, srcSystem=7, srcComponent=191)
    message = pymavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)

    for sequence in range(3):
        mav.seq = sequence
        reference = bytes(message.pack(mav))
        assert packer.pack(Outgoing(76, bytes(message.get_payload()))) == reference


def test_the_sequence_counts_each_packet_and_wraps():
    packer = Packer(1)
    heartbeat = messages.heartbeat(VehicleStateOfHealth.ACTIVE)

    frames = Framer().feed(b"".join(packer.pack(heartbeat) for _ in range(258)))

    assert [frame.sequence for frame in frames] == [*range(256), 0, 1]
    assert {(frame.system_id, frame.component_id) for frame in frames} == {(1, 191)}


@settings(deadline=None, derandomize=True)
@given(st.binary(min_size=1, max_size=30))
def test_trailing_zeros_are_cut_off_and_come_back(payload):
    (frame,) = Framer().feed(Packer(1).pack(Outgoing(76, payload)))

    assert frame.payload == (payload.rstrip(b"\0") or b"\0")


@pytest.mark.parametrize("ids", [(0, 191), (256, 1), (1, 0)])
def test_ids_that_no_packet_can_carry_are_refused(ids):
    with pytest.raises(ValueError, match=r"1\.\.255"):
        Packer(*ids)


def test_encode_makes_any_message_of_the_dialect():
    message = sent(encode("DEBUG_VECT", name=b"wind", time_usec=5, x=1.0, y=2.0, z=3.0))

    assert (message.get_type(), message.name, message.y) == ("DEBUG_VECT", "wind", 2.0)
    with pytest.raises(KeyError, match="NO_SUCH"):
        encode("NO_SUCH")


def test_decoding_an_unknown_id_is_an_error_that_names_it():
    with pytest.raises(UnknownMessageError, match="410"):
        decode(Frame(b"\xfd" + bytes(11), 2, 410, 1, 1, 0, signed=False))


def test_the_heartbeat_is_that_of_an_onboard_controller():
    message = sent(messages.heartbeat(VehicleStateOfHealth.CRITICAL))

    assert (message.type, message.autopilot, message.system_status) == (18, 8, 5)
    assert message.mavlink_version == 3


@pytest.mark.parametrize("length", [0, 5, 50, 51, 100, 120])
def test_texts_come_in_chunks_that_join_again(length):
    text = "".join(chr(97 + i % 26) for i in range(length))

    parts = [sent(part) for part in messages.status_texts(Severity.WARNING, text, text_id=9)]

    assert "".join(part.text for part in parts) == text
    assert [part.chunk_seq for part in parts] == list(range(len(parts)))
    assert {part.id for part in parts} == ({0} if length <= 50 else {9})
    assert {part.severity for part in parts} == {4}
    if len(parts) > 1:
        assert len(parts[-1].text) < 50, "a chunk that is not full ends the text"


def test_arming_and_disarming_force_only_when_told():
    params = [
        (message.command, message.param1, message.param2)
        for message in (
            sent(commands.arm(TARGET).as_long()),
            sent(commands.arm(TARGET, force=True).as_long()),
            sent(commands.disarm(TARGET).as_long()),
            sent(commands.disarm(TARGET, force=True).as_long()),
        )
    ]

    assert params == [(400, 1, 0), (400, 1, 21196), (400, 0, 0), (400, 0, 21196)]


def test_a_command_names_its_target_and_its_repetition():
    message = sent(commands.message_interval(TARGET, 148, 1e-6).as_long(confirmation=2))

    assert (message.target_system, message.target_component) == (3, 1)
    assert (message.command, message.param1, message.confirmation) == (511, 148, 2)


def test_takeoff_here_leaves_everything_to_the_autopilot():
    message = sent(commands.takeoff_here(TARGET).as_long())

    assert message.command == 22
    assert all(math.isnan(getattr(message, f"param{i}")) for i in range(1, 8))


@pytest.mark.parametrize(
    ("interval_s", "expected_us"), [(0.01, 10_000), (0.0, 0), (None, -1), (1.0, 1_000_000)]
)
def test_message_intervals_are_in_microseconds(interval_s, expected_us):
    message = sent(commands.message_interval(TARGET, 331, interval_s).as_long())

    assert (message.command, message.param1, message.param2) == (511, 331, expected_us)


@pytest.mark.parametrize("interval_s", [-0.1, math.nan, math.inf])
def test_an_interval_that_is_none_is_refused(interval_s):
    with pytest.raises(ValueError, match="interval"):
        commands.message_interval(TARGET, 331, interval_s)


def test_acknowledgements_are_read_with_and_without_their_extensions():
    full = encode(
        "COMMAND_ACK",
        command=176, result=5, progress=30, result_param2=-4, target_system=3, target_component=191,
    )  # fmt: skip
    (frame,) = Framer().feed(Packer(1, 1).pack(full))
    (short,) = Framer().feed(Packer(1, 1).pack(Outgoing(77, b"\xb0\x00\x01")))

    assert commands.ack_from_frame(frame) == commands.Ack(176, 5, 30, -4, 3, 191)
    assert commands.ack_from_frame(short) == commands.Ack(176, 1)


@settings(deadline=None, derandomize=True, max_examples=300)
@given(st.sampled_from(sorted(pymavlink.mavlink_map)), st.binary(max_size=255))
def test_any_payload_of_any_known_message_can_be_decoded(message_id, payload):
    (frame,) = Framer().feed(Packer(1, 1).pack(Outgoing(message_id, payload)))

    message = decode(frame)

    assert message.get_msgId() == message_id
    assert message.get_type() == pymavlink.mavlink_map[message_id].msgname
