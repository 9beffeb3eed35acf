import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink

from companion.mavlink.crc import crc16, crc16_by_table
from companion.mavlink.framing import LARGEST_FRAME, Frame, Framer


def packed(message, *, sequence=0, system=1, component=1, version=2, key=None):
    mav = pymavlink.MAVLink(None, srcSystem=system, srcComponent=component)
    mav.seq = sequence
    if key is not None:
        mav.signing.secret_key = key
        mav.signing.sign_outgoing = True
        mav.signing.timestamp = 1
    return bytes(message.pack(mav, force_mavlink1=version == 1))


def unknown_frame(message_id, payload, extra=77):
    body = struct.pack(
        "<BBBBBBHB", len(payload), 0, 0, 0, 1, 1, message_id & 0xFFFF, message_id >> 16
    )
    crc = crc16_by_table(bytes([extra]), crc16_by_table(body + payload))
    return b"\xfd" + body + payload + struct.pack("<H", crc)


small_floats = st.floats(-100, 100, width=32)
messages = st.one_of(
    st.builds(
        pymavlink.MAVLink_attitude_message,
        st.integers(0, 2**32 - 1),
        *[small_floats] * 6,
    ),
    st.builds(
        pymavlink.MAVLink_heartbeat_message,
        st.just(2),
        st.just(12),
        st.integers(0, 255),
        st.integers(0, 2**32 - 1),
        st.integers(0, 8),
        st.just(3),
    ),
    st.builds(
        pymavlink.MAVLink_statustext_message,
        st.integers(0, 7),
        # Payloads full of bytes that begin frames are the hard case.
        st.lists(st.sampled_from(b"\xfd\xfe\x01A"), max_size=50).map(bytes),
    ),
)
packets = st.one_of(
    st.builds(packed, messages, sequence=st.integers(0, 255), version=st.sampled_from([1, 2])),
    st.builds(packed, messages, key=st.just(b"k" * 32)),
)
noise = st.one_of(
    st.binary(max_size=40),
    st.lists(st.sampled_from(b"\xfd\xfe\x00\x01\x1c\xff"), max_size=40).map(bytes),
)


def frames_of(data):
    framer = Framer()
    return [frame.raw for frame in framer.feed(data) + framer.finish()]


@settings(deadline=None, derandomize=True)
@given(st.lists(packets, max_size=8))
def test_a_clean_stream_is_cut_into_exactly_its_packets(stream):
    framer = Framer()

    frames = framer.feed(b"".join(stream))

    assert [frame.raw for frame in frames] == stream
    assert framer.pending_bytes == 0


@settings(deadline=None, derandomize=True)
@given(st.lists(packets, min_size=2, max_size=8))
def test_packets_that_come_alone_are_the_frames_that_they_are_in_a_stream(stream):
    alone, together = Framer(), Framer()

    one_by_one = [frame for raw in stream for frame in alone.feed(raw)]

    assert one_by_one == together.feed(b"".join(stream))
    assert alone.looks == together.looks
    assert all(type(frame) is Frame for frame in one_by_one)


@settings(deadline=None, derandomize=True)
@given(messages, st.binary(min_size=1, max_size=20))
def test_a_packet_with_something_before_or_behind_it_is_found_all_the_same(message, more):
    raw = packed(message)

    assert raw in frames_of(raw + more)
    assert raw in frames_of(more.replace(b"\xfd", b"").replace(b"\xfe", b"") + raw)


@settings(deadline=None, derandomize=True)
@given(st.lists(st.one_of(packets, noise), max_size=8), st.data())
def test_how_the_stream_is_chunked_makes_no_difference(pieces, data):
    stream = b"".join(pieces)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=20)))
    whole, chunked = Framer(), Framer()

    expected = whole.feed(stream) + whole.finish()
    frames = [
        frame
        for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True)
        for frame in chunked.feed(stream[start:end])
    ]
    frames += chunked.finish()

    assert frames == expected


@settings(deadline=None, derandomize=True, max_examples=500)
@given(st.lists(st.tuples(noise, packets), min_size=1, max_size=5), noise)
def test_noise_between_packets_loses_none_of_them(pairs, tail):
    found = frames_of(b"".join(garbage + packet for garbage, packet in pairs) + tail)

    remaining = iter(found)
    assert all(packet in remaining for _, packet in pairs), "each, in order"


@settings(deadline=None, derandomize=True)
@given(st.lists(packets, min_size=1, max_size=5), st.data())
def test_a_truncated_stream_gives_the_packets_that_are_whole(stream, data):
    whole = b"".join(stream)
    length = data.draw(st.integers(0, len(whole)))
    ends = [len(b"".join(stream[: i + 1])) for i in range(len(stream))]

    frames = Framer().feed(whole[:length])

    assert [frame.raw for frame in frames] == stream[: sum(end <= length for end in ends)]


@settings(deadline=None, derandomize=True)
@given(messages, st.data())
def test_one_wrong_bit_in_payload_or_crc_makes_it_no_frame(message, data):
    raw = bytearray(packed(message))
    bit = data.draw(st.integers(10 * 8, len(raw) * 8 - 1))
    raw[bit // 8] ^= 1 << bit % 8

    framer = Framer()
    frames = framer.feed(bytes(raw)) + framer.finish()

    assert all(frame.message_id != message.id for frame in frames)


@settings(deadline=None, derandomize=True)
@given(st.lists(st.one_of(st.binary(max_size=600), noise), max_size=10))
def test_memory_stays_below_one_frame_whatever_comes(chunks):
    framer = Framer()

    for chunk in chunks:
        framer.feed(chunk)
        assert framer.pending_bytes < LARGEST_FRAME


@pytest.mark.parametrize("version", [1, 2])
def test_header_fields_and_payload_are_those_of_the_packet(version):
    message = pymavlink.MAVLink_attitude_message(7, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    raw = packed(message, sequence=200, system=42, component=191, version=version)

    (frame,) = Framer().feed(raw)

    assert frame.version == version
    assert (frame.system_id, frame.component_id, frame.sequence) == (42, 191, 200)
    assert frame.message_id == 30
    assert frame.payload == bytes(message.get_payload())
    assert frame.decodable
    assert not frame.signed


def test_a_signed_packet_is_one_frame_and_says_so():
    raw = packed(pymavlink.MAVLink_system_time_message(1, 2), key=b"x" * 32)

    (frame,) = Framer().feed(raw)

    assert frame.signed
    assert frame.raw == raw


def test_a_packet_with_an_unknown_incompatibility_flag_is_skipped():
    raw = bytearray(packed(pymavlink.MAVLink_system_time_message(1, 2)))
    raw[2] = 0x02
    following = packed(pymavlink.MAVLink_system_time_message(3, 4))

    assert frames_of(bytes(raw) + following) == [following]


def test_unknown_ids_are_delimited_once_their_seed_is_confirmed():
    first, second, third = (unknown_frame(54321, text) for text in (b"abc", b"defg", b"h"))
    known = packed(pymavlink.MAVLink_system_time_message(1, 2))
    framer = Framer()

    frames = framer.feed(first + known + second + third)

    assert [frame.raw for frame in frames] == [known, second, third]
    assert [frame.decodable for frame in frames] == [True, False, False]


def test_ids_that_px4_sends_and_pymavlink_lacks_are_delimited_from_the_first():
    event = unknown_frame(410, b"an event", extra=160)
    framer = Framer()

    assert [frame.raw for frame in framer.feed(event)] == [event]


def test_an_unknown_id_whose_seed_changes_is_not_believed():
    framer = Framer()

    for extra in (1, 2, 1, 2):
        assert framer.feed(unknown_frame(54321, b"abc", extra)) == []


def test_the_table_of_unknown_ids_does_not_grow_without_end():
    framer = Framer()

    found = sum(
        len(framer.feed(2 * unknown_frame(message_id, b"x")))
        for message_id in range(700_000, 701_000)
    )

    assert found == 1000
    assert len(framer._learned) == 64


def test_the_first_packet_of_an_unknown_id_does_not_hide_a_known_frame():
    known = packed(pymavlink.MAVLink_system_time_message(123456, 2))

    assert known in frames_of(unknown_frame(54321, b"ab" + known + b"c"))


@settings(deadline=None, derandomize=True)
@given(st.binary(max_size=300))
def test_the_compiled_and_the_table_crc_agree(data):
    assert crc16(data) == crc16_by_table(data) == pymavlink.x25crc(data).crc
