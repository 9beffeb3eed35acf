from pathlib import Path

import pytest

from companion.mavlink.codec import Packer, decode
from companion.mavlink.commands import ack_from_frame
from companion.mavlink.dialects import dialect_for, dialect_named, dialect_names
from companion.mavlink.dialects.ardupilot import ArduPilot
from companion.mavlink.dialects.base import AutopilotDialect, ReadinessFacts
from companion.mavlink.exchange import Verdict
from companion.mavlink.framing import Framer
from companion.mavlink.messages import MessageId, Target
from companion.mavlink.mode_change import ModeChange
from companion.recording.tlog import read_tlog
from companion.thrust_meaning import COLLECTIVE, ThrustMeaning

ARDUPILOT: AutopilotDialect = ArduPilot()
DATA = Path(__file__).parents[2] / "data" / "ardupilot"
WELL = (0x5371FC2F, 0x5361FC2F, 0x5771FC2F)
"""As a real ArduCopter reports itself when it can be armed."""
USES_GPS = 0x33F
GUIDED = 4


def recorded(name):
    """(seconds since the beginning, frame) of a recording, in order."""
    start_us = None
    framer = Framer()
    for packet in read_tlog(DATA / name):
        start_us = start_us or packet.time_us
        for frame in framer.feed(packet.raw):
            yield (packet.time_us - start_us) / 1e6, frame


def sent(command):
    (frame,) = Framer().feed(Packer(1).pack(command.as_long()))
    return decode(frame)


def test_the_dialect_is_found_by_heartbeat_and_by_name():
    assert dialect_for(3).name == "ardupilot"
    assert dialect_for(12).name == "px4"
    assert dialect_for(0) is None
    assert dialect_names() == ("px4", "ardupilot")
    for name in dialect_names():
        assert dialect_named(name).name == name
        assert dialect_for(dialect_named(name).autopilot_id) is dialect_named(name)
    with pytest.raises(KeyError, match="px4, ardupilot"):
        dialect_named("betaflight")


@pytest.mark.parametrize(
    ("name", "number"),
    [("stabilize", 0), ("guided", 4), ("loiter", 5), ("rtl", 6), ("land", 9), ("brake", 17)],
)
def test_modes_have_the_numbers_of_a_real_ardupilot(name, number):
    assert ARDUPILOT.custom_mode(name) == number
    assert ARDUPILOT.mode_name(number) == name
    message = sent(ARDUPILOT.set_mode(Target(1), name))
    assert (message.command, message.param1, message.param2, message.param3) == (176, 1, number, 0)


def test_an_unknown_mode_is_described_or_refused():
    assert ARDUPILOT.mode_name(99) == "ArduCopter mode 99"
    with pytest.raises(KeyError, match="guided"):
        ARDUPILOT.custom_mode("offboard")


def test_every_mode_that_the_flight_uses_exists():
    for name in (
        ARDUPILOT.mode_before_arming,
        ARDUPILOT.setpoint_mode,
        *ARDUPILOT.takeoff_modes,
        *ARDUPILOT.hand_over.modes,
        "land",
    ):
        assert ARDUPILOT.mode_name(ARDUPILOT.custom_mode(name)) == name


def test_a_take_off_carries_its_height_in_parameter_7():
    message = sent(ARDUPILOT.takeoff(Target(1), 2.5))
    assert (message.command, message.param7) == (22, 2.5)
    for nonsense in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="take-off"):
            ARDUPILOT.takeoff(Target(1), nonsense)


def test_the_state_is_asked_for_in_parts():
    asked = {stream.message_id for stream in ARDUPILOT.streams}
    assert {MessageId.LOCAL_POSITION_NED, MessageId.ATTITUDE_QUATERNION} <= asked
    assert MessageId.ODOMETRY not in asked


def facts(**changes):
    given = {
        "custom_mode": GUIDED,
        "sensors": WELL,
        "sensors_of_mode": True,
        "estimator_flags": USES_GPS,
        "position_arrives": True,
    }
    return ReadinessFacts(**(given | changes))


def test_it_is_ready_when_all_is_well():
    assert ARDUPILOT.readiness(facts()).ready
    assert ARDUPILOT.readiness(facts()).missing == ()


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"custom_mode": 0}, "mode guided (it is in stabilize)"),
        ({"custom_mode": None}, "mode guided (it is in unknown)"),
        ({"sensors": None}, "SYS_STATUS"),
        # The pre-arm bit of a SYS_STATUS from before GUIDED is one of STABILIZE: it says nothing.
        ({"sensors_of_mode": False}, "SYS_STATUS in this mode"),
        ({"sensors": (*WELL[:2], WELL[2] & ~0x1000_0000)}, "pre-arm check"),
        ({"sensors": (*WELL[:2], WELL[2] & ~0x1000_0020)}, "GPS"),
        ({"estimator_flags": None}, "EKF_STATUS_REPORT"),
        ({"estimator_flags": 0xA7}, "a position of its estimator"),
        ({"position_arrives": False}, "LOCAL_POSITION_NED"),
    ],
)
def test_each_thing_that_is_missing_is_named(changes, text):
    readiness = ARDUPILOT.readiness(facts(**changes))
    assert not readiness.ready
    assert len(readiness.missing) == 1
    assert text in readiness.missing[0]


def test_a_real_ardupilot_is_found_ready_when_it_armed_and_not_before():
    """It denied every attempt to arm before 41.0 s."""
    mode = flags = sensors = None
    sensors_of_mode = False
    position_s, ready_s, armed_s = -1e9, None, None
    for time_s, frame in recorded("boot.tlog"):
        message = decode(frame)
        kind = message.get_type()
        if kind == "HEARTBEAT":
            sensors_of_mode = sensors_of_mode and message.custom_mode == mode
            mode = message.custom_mode
            if message.base_mode & 0x80 and armed_s is None:
                armed_s = time_s
        elif kind == "SYS_STATUS":
            sensors = (
                message.onboard_control_sensors_present,
                message.onboard_control_sensors_enabled,
                message.onboard_control_sensors_health,
            )
            sensors_of_mode = mode is not None
        elif kind == "EKF_STATUS_REPORT":
            flags = message.flags
        elif kind == "LOCAL_POSITION_NED":
            position_s = time_s
        found = ARDUPILOT.readiness(
            ReadinessFacts(mode, sensors, sensors_of_mode, flags, time_s - position_s < 1.0)
        )
        if found.ready and ready_s is None:
            ready_s = time_s
    assert 41.0 < ready_s < 41.5
    assert armed_s == pytest.approx(41.0, abs=0.1)


def test_a_mode_that_a_booting_ardupilot_overwrites_is_seen_to_be_lost():
    """GUIDED is asked for at 1.9 s, acknowledged, reported once, and gone 0.2 s later."""
    change, acknowledged, modes = None, [], []
    for time_s, frame in recorded("early-guided.tlog"):
        message = decode(frame)
        if message.get_type() == "COMMAND_LONG" and message.command == 176 and change is None:
            change = ModeChange(ARDUPILOT.set_mode(Target(1), "guided"), GUIDED, "guided")
            change.outgoing(time_s)
        elif change is not None and message.get_type() == "COMMAND_ACK":
            change.on_ack(time_s, ack_from_frame(frame))
            if message.command == 176:
                acknowledged.append((message.result, change.verdict))
        elif message.get_type() == "HEARTBEAT":
            if change is not None:
                change.on_mode(message.custom_mode)
            modes.append(ARDUPILOT.mode_name(message.custom_mode))
    assert acknowledged[0] == (0, Verdict.PENDING)  # an acknowledgement proves nothing
    first = modes.index("guided")
    assert modes[first + 1] == "stabilize"
    assert change.verdict is Verdict.ACCEPTED  # it was in GUIDED; only readiness sees it lost
    assert modes[-1] == "guided"


DEFAULTS = {
    "GUID_OPTIONS": 0.0,
    "GUID_TIMEOUT": 3.0,
    "ATC_ANGLE_BOOST": 1.0,
    "WPNAV_SPEED_UP": 250.0,
    "WPNAV_SPEED_DN": 150.0,
}


def test_by_default_the_thrust_field_is_a_climb_rate():
    meaning = ARDUPILOT.thrust_meaning(DEFAULTS)
    assert meaning == ThrustMeaning("climb_rate", 2.5, 1.5)


def test_newer_builds_call_the_speeds_otherwise_and_give_them_in_metres():
    newer = {"GUID_OPTIONS": 0.0, "WP_SPD_UP": 3.0, "WP_SPD_DN": 2.0}
    assert ARDUPILOT.thrust_meaning(newer) == ThrustMeaning("climb_rate", 3.0, 2.0)
    for name in (*DEFAULTS, *newer):
        assert name in ARDUPILOT.flight_parameters


@pytest.mark.parametrize(("boost", "kind"), [(1.0, "vertical"), (0.0, "collective")])
def test_as_a_throttle_the_angle_boost_says_who_makes_up_for_tilt(boost, kind):
    options = DEFAULTS | {"GUID_OPTIONS": 8.0 + 1.0, "ATC_ANGLE_BOOST": boost}
    assert ARDUPILOT.thrust_meaning(options) == ThrustMeaning(kind)


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({"GUID_OPTIONS": None}, "GUID_OPTIONS"),
        ({"GUID_OPTIONS": 8.0, "ATC_ANGLE_BOOST": None}, "ATC_ANGLE_BOOST"),
        ({"WPNAV_SPEED_UP": None}, "WPNAV_SPEED_UP"),
        ({"WPNAV_SPEED_DN": 0.0}, "WPNAV_SPEED_DN"),
        ({"WPNAV_SPEED_UP": float("nan")}, "WPNAV_SPEED_UP"),
    ],
)
def test_a_meaning_that_is_not_known_is_refused_with_the_remedy(changes, names):
    given = {k: v for k, v in (DEFAULTS | changes).items() if v is not None}
    found = ARDUPILOT.thrust_meaning(given)
    assert isinstance(found, str)
    assert names in found
    assert "Set" in found or "needed" in found


def test_the_autopilots_own_timeouts_are_read():
    assert ARDUPILOT.setpoint_timeout_s({"GUID_TIMEOUT": 0.4}) == 0.4
    assert ARDUPILOT.setpoint_timeout_s({}) == 3.0
    px4 = dialect_named("px4")
    assert px4.setpoint_timeout_s({"COM_OF_LOSS_T": 0.7}) == 0.7
    assert px4.setpoint_timeout_s({}) == 1.0
    assert px4.thrust_meaning({}) is COLLECTIVE
    assert px4.takeoff_height_m({"MIS_TAKEOFF_ALT": 3.0}, 2.5) == 3.0
    assert ARDUPILOT.takeoff_height_m({"MIS_TAKEOFF_ALT": 3.0}, 2.5) == 2.5
