"""What clients of a forwarding endpoint may do to the vehicle, message by message."""

import math

import pytest

from companion.mavlink import message_classes
from companion.mavlink.client_filter import Situation, judge
from companion.mavlink.codec import Packer, decode, encode
from companion.mavlink.commands import Result
from companion.mavlink.dialect import MESSAGE_CLASSES, MAVLink, message_class
from companion.mavlink.dialects.ardupilot import ArduPilot
from companion.mavlink.dialects.px4 import Px4
from companion.mavlink.framing import Frame, Framer
from companion.mavlink.message_classes import STATED_IDS, MessageClass, class_of
from companion.mavlink.messages import Outgoing, Target

VEHICLE = Target(1, 1)
NOWHERE = 0x7FFFFFFF


def frame(outgoing, system=255, component=190):
    (made,) = Framer().feed(Packer(system, component).pack(outgoing))
    return made


def situation(dialect=None, **changes):
    facts = {"armed": True, "pilot_flies": False} | changes
    return Situation(VEHICLE, dialect or Px4(), **facts)


def long(command, *params, system=1, component=1):
    p = [*params, *[0.0] * (7 - len(params))]
    return frame(
        encode(
            "COMMAND_LONG",
            target_system=system, target_component=component, command=command, confirmation=0,
            param1=p[0], param2=p[1], param3=p[2], param4=p[3], param5=p[4], param6=p[5],
            param7=p[6],
        )
    )  # fmt: skip


def integer(command, *params, x=0, y=0, z=0.0, system=1):
    p = [*params, *[0.0] * (4 - len(params))]
    return frame(
        encode(
            "COMMAND_INT",
            target_system=system, target_component=1, frame=0, command=command, current=0,
            autocontinue=0, param1=p[0], param2=p[1], param3=p[2], param4=p[3], x=x, y=y, z=z,
        )
    )  # fmt: skip


def mode(dialect, name):
    return frame(dialect.set_mode(VEHICLE, name).as_long())


def plain(name, **fields):
    """A message with zeros in the fields that are not given."""
    message = decode(frame(Outgoing(message_class(name).id, b"\0")))
    for field, value in fields.items():
        assert hasattr(message, field)
        setattr(message, field, value)
    message.pack(MAVLink(None))
    return frame(Outgoing(message_class(name).id, bytes(message.get_payload())))


SETPOINTS = [
    "SET_ATTITUDE_TARGET", "SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT",
    "SET_ACTUATOR_CONTROL_TARGET", "MANUAL_SETPOINT", "FOLLOW_TARGET", "LANDING_TARGET",
    "TRAJECTORY_REPRESENTATION_WAYPOINTS",
]  # fmt: skip
POSES = [
    "VISION_POSITION_ESTIMATE", "VICON_POSITION_ESTIMATE", "ATT_POS_MOCAP", "ODOMETRY",
    "VISION_POSITION_DELTA", "VISION_SPEED_ESTIMATE", "OBSTACLE_DISTANCE",
    "OBSTACLE_DISTANCE_3D", "GLOBAL_POSITION_SENSOR", "RANGING_BEACON", "AIRSPEED",
    "GPS_INPUT", "HIL_GPS", "HIL_SENSOR", "HIL_STATE_QUATERNION",
]  # fmt: skip
STICKS = ["MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE"]


@pytest.mark.parametrize("name", SETPOINTS + POSES)
def test_only_the_companion_steers_unless_it_is_allowed(name):
    said = plain(name)

    refusal = judge(said, situation())

    assert refusal.what == name
    assert refusal.command_id is None
    assert judge(said, situation(allow_commands=True)) is not None
    assert judge(said, situation(pilot_flies=True)) is not None, "automatic ones never mix"
    assert judge(said, situation(allow_setpoints=True)) is None


@pytest.mark.parametrize("name", STICKS)
def test_sticks_pass_once_the_companion_has_handed_over(name):
    said = plain(name)

    assert judge(said, situation()) is not None
    assert judge(said, situation(pilot_flies=True)) is None
    assert judge(said, situation(allow_setpoints=True)) is None


def test_a_setpoint_for_another_vehicle_is_none_of_ours():
    assert judge(plain("SET_ATTITUDE_TARGET", target_system=7), situation()) is None
    assert judge(plain("MANUAL_CONTROL", target=7), situation()) is None
    assert judge(plain("SET_ATTITUDE_TARGET", target_system=1), situation()) is not None
    assert judge(long(400, 1.0, system=7), situation()) is None


@pytest.mark.parametrize("name", ["loiter", "land", "rtl", "posctl", "altctl"])
def test_on_px4_a_person_can_always_take_over(name):
    assert judge(mode(Px4(), name), situation()) is None


@pytest.mark.parametrize(
    "name", ["brake", "land", "rtl", "smart_rtl", "loiter", "poshold", "alt_hold"]
)
def test_on_ardupilot_a_person_can_always_take_over(name):
    assert judge(mode(ArduPilot(), name), situation(ArduPilot())) is None


@pytest.mark.parametrize("name", ["offboard", "mission", "takeoff", "manual", "acro", "stabilized"])
def test_on_px4_no_client_starts_another_flight(name):
    said = mode(Px4(), name)

    refusal = judge(said, situation())

    assert (refusal.what, refusal.command_id) == ("DO_SET_MODE", 176)
    assert refusal.target == VEHICLE
    assert refusal.result is Result.DENIED
    assert name in refusal.why
    assert judge(said, situation(allow_setpoints=True)) is not None
    assert judge(said, situation(allow_commands=True)) is None
    assert judge(said, situation(pilot_flies=True)) is None


@pytest.mark.parametrize("name", ["guided", "auto", "stabilize", "acro", "flip", "guided_nogps"])
def test_on_ardupilot_no_client_starts_another_flight(name):
    assert judge(mode(ArduPilot(), name), situation(ArduPilot())) is not None


def test_a_mode_is_read_as_the_vehicles_own():
    # 6 is RTL to ArduPilot and OFFBOARD to PX4.
    said = long(176, 1.0, 6.0)

    assert judge(said, situation(ArduPilot())) is None
    assert judge(said, situation(Px4())) is not None


@pytest.mark.parametrize(
    "params", [(0.0, 4.0, 6.0), (math.nan, 4.0, 6.0), (1.0, math.nan), (1.0, -4.0), (1.0, math.inf)]
)
def test_a_mode_that_cannot_be_read_does_not_pass(params):
    assert judge(long(176, *params), situation()) is not None


def test_the_legacy_set_mode_is_judged_alike_and_answered():
    def legacy(custom_mode, base_mode=1, system=1):
        return frame(
            encode("SET_MODE", target_system=system, base_mode=base_mode, custom_mode=custom_mode)
        )

    px4 = Px4()
    assert judge(legacy(px4.custom_mode("land")), situation()) is None
    refusal = judge(legacy(px4.custom_mode("offboard")), situation())
    assert (refusal.command_id, refusal.target) == (11, VEHICLE)
    assert judge(legacy(0, base_mode=0x80), situation()) is not None
    assert judge(legacy(px4.custom_mode("offboard"), system=7), situation()) is None


@pytest.mark.parametrize("make", [long, integer])
@pytest.mark.parametrize(
    ("command", "param1"),
    [
        (20, 0.0),  # return to launch
        (21, 0.0),  # land
        (17, 0.0),  # loiter
        (400, 0.0),  # disarm
        (185, 1.0),  # flight termination
        (193, 0.0),  # pause
        (252, 0.0),  # hold
        (512, 148.0),  # request a message
        (2000, 0.0),  # take a picture
    ],
)
def test_what_ends_a_flight_or_asks_for_something_passes(make, command, param1):
    assert judge(make(command, param1), situation()) is None


def test_disarming_in_an_emergency_passes_and_arming_does_not():
    assert judge(long(400, 0.0, 21196.0), situation()) is None
    assert "arms" in judge(long(400, 1.0), situation()).why
    assert judge(long(400, 1.0, 21196.0), situation()) is not None
    assert judge(long(400, math.nan), situation()) is not None


@pytest.mark.parametrize("make", [long, integer])
@pytest.mark.parametrize(
    ("command", "param1"),
    [(22, 0.0), (300, 0.0), (246, 1.0), (241, 1.0), (245, 2.0), (193, 1.0), (252, 1.0), (192, -1.0),
     (16, 0.0), (178, 0.0), (179, 1.0), (42424, 0.0), (31010, 0.0)],
)  # fmt: skip
def test_what_starts_steers_or_is_unknown_does_not_pass(make, command, param1):
    said = make(command, param1)

    refusal = judge(said, situation())

    assert refusal.command_id == command
    assert judge(said, situation(allow_commands=True)) is None
    assert judge(said, situation(pilot_flies=True)) is None


def test_a_ground_stations_pause_passes_and_its_go_to_does_not():
    nan = math.nan
    assert judge(long(192, -1.0, 1.0, 0.0, nan, nan, nan, nan), situation()) is None
    assert judge(integer(192, -1.0, 1.0, x=NOWHERE, y=NOWHERE, z=nan), situation()) is None
    assert judge(long(192, -1.0, 1.0, 0.0, nan, 47.4, 8.5, nan), situation()) is not None
    assert judge(integer(192, -1.0, 1.0, x=474_000_000, y=85_000_000), situation()) is not None


def test_to_go_to_another_height_is_no_pause():
    nan = math.nan
    assert judge(long(192, -1.0, 1.0, 0.0, nan, nan, nan, 500.0), situation()) is not None
    assert judge(integer(192, -1.0, 1.0, x=NOWHERE, y=NOWHERE, z=500.0), situation()) is not None


@pytest.mark.parametrize(
    "said",
    [
        long(193, 0.0),
        long(252, 0.0),
        long(192, -1.0, 1.0, 0.0, math.nan, math.nan, math.nan, math.nan),
        integer(192, -1.0, 1.0, x=NOWHERE, y=NOWHERE, z=math.nan),
    ],
)
def test_a_pause_that_ardupilot_would_not_heed_is_for_the_companion_to_make(said):
    for allowed in (situation(ArduPilot()), situation(ArduPilot(), allow_commands=True)):
        refusal = judge(said, allowed)
        assert refusal.pauses
        assert "brake" in refusal.why
        assert refusal.command_id in (192, 193, 252)
    assert judge(said, situation(ArduPilot(), pilot_flies=True)) is None
    assert judge(said, situation(ArduPilot(), armed=False)) is None
    assert judge(said, situation()) is None


def test_naming_another_component_is_no_way_around():
    assert judge(long(400, 1.0, component=0), situation()) is not None
    assert judge(long(400, 1.0, component=42), situation()) is not None
    assert judge(long(400, 1.0, system=0), situation()) is not None


def test_parameters_are_set_on_the_ground_only():
    said = plain("PARAM_SET", target_system=1, target_component=1, param_type=9)

    assert judge(said, situation(armed=False)) is None
    assert judge(said, situation()).what == "PARAM_SET"
    assert judge(said, situation(allow_commands=True)) is None
    assert judge(plain("PARAM_REQUEST_LIST", target_system=1), situation()) is None


@pytest.mark.parametrize(
    "name",
    ["SET_GPS_GLOBAL_ORIGIN", "SET_HOME_POSITION", "SERIAL_CONTROL", "RADIO_STATUS", "RADIO"],
)
def test_what_moves_the_ground_under_the_flight_does_not_pass(name):
    assert judge(plain(name), situation(armed=False)) is not None
    assert judge(plain(name), situation(allow_commands=True)) is None


def test_a_mission_may_be_uploaded_but_no_place_to_fly_to():
    item = {"target_system": 1, "target_component": 1}
    for name in ("MISSION_ITEM", "MISSION_ITEM_INT"):
        assert judge(plain(name, **item, current=1), situation()) is None
        assert judge(plain(name, **item, current=2), situation()) is not None
        assert judge(plain(name, **item, current=3), situation()) is not None
    assert judge(plain("MISSION_COUNT", **item), situation()) is None


def file_operation(code):
    payload = bytearray(251)
    payload[0:2], payload[2], payload[3], payload[4] = b"\x07\x00", 3, code, 20
    return frame(
        encode(
            "FILE_TRANSFER_PROTOCOL",
            target_network=0, target_system=1, target_component=1, payload=list(payload),
        )
    )  # fmt: skip


def only_in_flight(said, **facts):
    """True if it is kept back in flight, and then alone."""
    assert judge(said, situation(armed=False, **facts)) is None
    assert judge(said, situation(allow_commands=True, **facts)) is None
    assert judge(said, situation(pilot_flies=True, **facts)) is None
    return judge(said, situation(**facts)) is not None


def test_files_are_read_in_flight_and_not_written():
    reads = [code for code in range(256) if not only_in_flight(file_operation(code))]

    assert reads == [0, 1, 2, 3, 4, 5, 14, 15]


@pytest.mark.parametrize("kind", ["MISSION_COUNT", "MISSION_CLEAR_ALL",
                                  "MISSION_WRITE_PARTIAL_LIST", "MISSION_ITEM_INT"])  # fmt: skip
def test_the_fence_stays_in_flight(kind):
    item = {"target_system": 1, "target_component": 1}

    assert only_in_flight(plain(kind, **item, mission_type=1))
    assert only_in_flight(plain(kind, **item, mission_type=255))
    assert not only_in_flight(plain(kind, **item, mission_type=0))
    assert only_in_flight(plain("FENCE_POINT", **item))


@pytest.mark.parametrize(
    "name", ["DEVICE_OP_WRITE", "CAN_FRAME", "CANFD_FRAME", "PARAM_EXT_SET", "SECURE_COMMAND",
             "BATTERY_STATUS", "TUNNEL", "LOG_ERASE"],
)  # fmt: skip
def test_no_way_around_lets_a_client_change_an_armed_vehicle(name):
    assert only_in_flight(plain(name))


@pytest.mark.parametrize("message_id", sorted(MESSAGE_CLASSES))
def test_every_message_of_the_dialect_has_a_stated_class(message_id):
    assert message_id in STATED_IDS


def test_no_message_is_in_two_classes():
    groups = [
        getattr(message_classes, name)
        for name in ("_SETPOINTS", "_ESTIMATES", "_CHANGES", "_CHANGES_IN_FLIGHT",
                     "_QUESTIONS_AND_ANSWERS", "_CAMERAS_AND_GIMBALS", "_TRAFFIC", "_REPORTS")
    ]  # fmt: skip
    assert sum(len(group) for group in groups) == len({i for group in groups for i in group})


def test_a_message_that_nobody_knows_is_kept_back_in_flight():
    unknown = Frame(b"\xfd" + bytes(11), 2, 54321, 255, 190, 0, False)

    assert class_of(54321) is MessageClass.CHANGES_IN_FLIGHT
    assert only_in_flight(unknown)


def test_nobody_changes_the_signing_key_over_an_endpoint():
    said = plain("SETUP_SIGNING")
    everything = situation(allow_commands=True, allow_setpoints=True, pilot_flies=True, armed=False)

    assert judge(said, everything) is not None


@pytest.mark.parametrize(
    "name", ["HEARTBEAT", "PING", "TIMESYNC", "GPS_RTCM_DATA", "FILE_TRANSFER_PROTOCOL",
             "LOG_REQUEST_LIST", "MISSION_REQUEST_LIST", "PARAM_REQUEST_READ"],
)  # fmt: skip
def test_what_neither_starts_nor_steers_passes(name):
    assert judge(plain(name), situation()) is None
