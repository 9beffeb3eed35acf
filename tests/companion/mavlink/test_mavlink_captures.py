"""The parser against packets of a real PX4 v1.17 and of its clients."""

import math
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as pymavlink

from companion.frames import swap_enu_ned
from companion.mavlink.codec import decode
from companion.mavlink.commands import ack_from_frame
from companion.mavlink.dialects.base import ReadinessFacts
from companion.mavlink.dialects.px4 import Px4, decode_mode
from companion.mavlink.exchange import Verdict
from companion.mavlink.framing import Framer
from companion.mavlink.messages import Target
from companion.mavlink.mode_change import ModeChange
from companion.mavlink.peers import PeerTable
from companion.mavlink.telemetry import state_from_odometry
from companion.recording.tlog import read_tlog
from companion.vehicle_state import VehicleState

CAPTURES = sorted((Path(__file__).parents[2] / "data" / "captures").glob("*.tlog"))
UNKNOWN_TO_PYMAVLINK = {8, 300, 380, 395, 397, 410, 411}

each_capture = pytest.mark.parametrize("path", CAPTURES, ids=lambda path: path.stem)


def frames_of(path):
    framer = Framer()
    return [frame for record in read_tlog(path) for frame in framer.feed(record.raw)]


def same(ours, theirs):
    """Equal, where NaN equals NaN."""
    return repr(ours) == repr(theirs)


@each_capture
def test_the_whole_recording_parses_and_no_byte_is_left_over(path):
    packets = [record.raw for record in read_tlog(path)]
    framer = Framer()

    frames = framer.feed(b"".join(packets))

    assert [frame.raw for frame in frames] == packets
    assert framer.pending_bytes == 0
    unknown = {frame.message_id for frame in frames if not frame.decodable}
    assert unknown <= UNKNOWN_TO_PYMAVLINK


@each_capture
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


@each_capture
def test_every_odometry_is_usable_as_state(path):
    frames = frames_of(path)

    states = [state_from_odometry(frame) for frame in frames if frame.message_id == 331]

    assert all(isinstance(state, VehicleState) for state in states)


def test_the_recordings_hold_every_id_that_pymavlink_lacks():
    unknown = {
        frame.message_id for path in CAPTURES for frame in frames_of(path) if not frame.decodable
    }

    assert unknown == UNKNOWN_TO_PYMAVLINK


def mode_changes(path, name):
    """Follow a recording's requests for a mode: the verdict on each, and when it was reached."""
    px4 = Px4()
    changes, current = [], None
    framer = Framer()
    start_us = None
    for record in read_tlog(path):
        start_us = start_us or record.time_us
        now_s = (record.time_us - start_us) / 1e6
        for frame in framer.feed(record.raw):
            if not frame.decodable:
                continue
            message = decode(frame)
            if message.get_type() == "COMMAND_LONG" and message.command == 176:
                current = None
                if decode_mode(px4.custom_mode(name))[0] == message.param2:
                    current = ModeChange(px4.set_mode(Target(1), name), px4.custom_mode(name), name)
                    current.outgoing(now_s)
                    changes.append(current)
            elif current is not None and message.get_type() == "COMMAND_ACK":
                current.on_ack(now_s, ack_from_frame(frame))
            elif (
                current is not None
                and message.get_type() in ("HEARTBEAT", "CURRENT_MODE")
                and frame.component_id == 1
            ):
                current.on_mode(message.custom_mode)
    return changes


def test_a_real_px4s_answers_are_judged_rightly():
    """Disarmed without a stream: taken. In the air without one: 0, then 1. With one: taken."""
    path = next(path for path in CAPTURES if path.stem == "px4-offboard-events")

    verdicts = [change.verdict for change in mode_changes(path, "offboard")]

    accepted, refused = Verdict.ACCEPTED, Verdict.REFUSED
    assert verdicts[:4] == [accepted, refused, accepted, refused]
    assert set(verdicts[4:]) == {accepted}


def test_a_real_px4s_readiness_and_mode_are_understood():
    path = next(path for path in CAPTURES if path.stem == "px4-boot-onboard")
    px4, table, ready, modes = Px4(), PeerTable(), [], []
    for frame in frames_of(path):
        if frame.message_id in (0, 1, 436) and frame.component_id == 1:
            message = decode(frame)
            if frame.message_id == 0:
                table.on_heartbeat(frame, message)
            if frame.message_id == 1:
                sensors = (
                    message.onboard_control_sensors_present,
                    message.onboard_control_sensors_enabled,
                    message.onboard_control_sensors_health,
                )
                facts = ReadinessFacts(None, sensors, True, None, True)
                ready.append(px4.readiness(facts).ready)
            else:
                modes.append(px4.mode_name(message.custom_mode))

    assert ready
    assert all(ready)
    assert set(modes) == {"loiter"}
    assert table.vehicle.autopilot == px4.autopilot_id


def test_odometry_and_local_position_of_one_time_agree():
    """Both are read alike, which shows that PX4's ODOMETRY has its velocity in NED."""
    fastest_m_s = 0.0
    for path in CAPTURES:
        position = None
        for frame in frames_of(path):
            if frame.message_id == 32:
                position = decode(frame)
            elif frame.message_id == 331 and position is not None:
                state = state_from_odometry(frame)
                if abs(state.time_s - position.time_boot_ms * 1e-3) < 1e-4:
                    velocity_ned_m_s = (position.vx, position.vy, position.vz)
                    position_ned_m = (position.x, position.y, position.z)
                    assert state.velocity_enu_m_s == swap_enu_ned(velocity_ned_m_s)
                    assert state.position_enu_m == swap_enu_ned(position_ned_m)
                    fastest_m_s = max(fastest_m_s, math.hypot(*state.velocity_enu_m_s))
    assert fastest_m_s > 0.5, "the vehicle moved, so a wrong frame would have shown"
