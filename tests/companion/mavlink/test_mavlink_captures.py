"""The parser against packets of a real PX4 v1.17 and of its clients."""

from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as pymavlink

from companion.mavlink.codec import decode
from companion.mavlink.framing import Framer
from companion.mavlink.telemetry import Attitude, attitude_from_frame, state_from_odometry
from companion.recording.tlog import read_tlog
from companion.vehicle_state import VehicleState

CAPTURES = sorted((Path(__file__).parents[2] / "data" / "captures").glob("*.tlog"))
UNKNOWN_TO_PYMAVLINK = {8, 300, 380, 395, 397, 410, 411}

pytestmark = pytest.mark.parametrize("path", CAPTURES, ids=lambda path: path.stem)


def frames_of(path):
    framer = Framer()
    return [frame for record in read_tlog(path) for frame in framer.feed(record.raw)]


def same(ours, theirs):
    """Equal, where NaN equals NaN."""
    return repr(ours) == repr(theirs)


def test_the_whole_recording_parses_and_no_byte_is_left_over(path):
    packets = [record.raw for record in read_tlog(path)]
    framer = Framer()

    frames = framer.feed(b"".join(packets))

    assert [frame.raw for frame in frames] == packets
    assert framer.counters.bytes_skipped == framer.counters.crc_errors == framer.pending_bytes == 0
    assert framer.counters.unknown_ids.keys() <= UNKNOWN_TO_PYMAVLINK
    assert sum(framer.counters.unknown_ids.values()) == sum(not f.decodable for f in frames)


def test_framing_and_decoding_agree_with_pymavlink(path):
    mav = pymavlink.MAVLink(None)
    mav.robust_parsing = True
    theirs = mav.parse_buffer(b"".join(record.raw for record in read_tlog(path)))
    ours = frames_of(path)

    assert [frame.raw for frame in ours] == [bytes(message.get_msgbuf()) for message in theirs]
    for frame, reference in zip(ours, theirs, strict=True):
        if frame.decodable:
            message = decode(frame)
            expected = reference.to_dict()
            fields = message.to_dict()
            assert fields.keys() == expected.keys()
            for name, value in fields.items():
                if isinstance(value, tuple):
                    value = list(value)
                assert same(value, expected[name]), (message.get_type(), name)
            assert message.get_srcComponent() == reference.get_srcComponent()


def test_every_odometry_and_attitude_is_usable_as_state(path):
    frames = frames_of(path)

    states = [state_from_odometry(frame) for frame in frames if frame.message_id == 331]
    attitudes = [attitude_from_frame(frame) for frame in frames if frame.message_id == 31]

    assert all(isinstance(state, VehicleState) for state in states)
    assert all(isinstance(attitude, Attitude) for attitude in attitudes)
