"""What a message from a client is to a vehicle that the companion flies, id by id.

Every message of the dialect has its class here, and a test sees to that.  One that has none, of a
newer protocol or somebody's own, may be anything.
"""

from enum import Enum, auto


class MessageClass(Enum):
    """What a client's message does."""

    HARMLESS = auto()
    """A question, an answer, a report; or it goes to a camera, a gimbal, a transponder."""
    COMMAND = auto()
    """COMMAND_LONG and COMMAND_INT: judged by the command."""
    MODE = auto()
    """SET_MODE: judged by the mode."""
    MISSION = auto()
    """Writes to what is stored of missions: judged by its kind."""
    FILES = auto()
    """FILE_TRANSFER_PROTOCOL: judged by the operation."""
    TIME = auto()
    """TIMESYNC: judged by whether it asks or answers."""
    RATES = auto()
    """REQUEST_DATA_STREAM: see `stream_requests`."""
    STICKS = auto()
    STEERS = auto()
    """A setpoint, or an input of the estimator: who moves the estimate moves the vehicle."""
    CHANGES = auto()
    """Changes what the flight rests on, on the ground, too."""
    CHANGES_IN_FLIGHT = auto()
    """The same, but of no account before the vehicle is armed."""
    LOCKS_OUT = auto()
    """SETUP_SIGNING."""


_SETPOINTS = (81, 82, 84, 86, 139, 144, 149, 223, 224, 332, 333, 8008)
"""Of position, attitude, actuators, manual ones; targets to follow or land on; trajectories;
commands at a time."""
_ESTIMATES = (
    *(90, 91, 92, 93, 100, 101, 102, 103, 104, 106, 107, 113, 114, 115, 132, 138, 232),
    *(295, 296, 330, 331, 513, 11011, 11037),
)
"""Poses, simulated sensors, GNSS, beacons, airspeed, distances of obstacles."""
_CHANGES = (5, 48, 50, 109, 126, 151, 166, 243, 60047)
"""CHANGE_OPERATOR_CONTROL, origin and home, PARAM_MAP_RC, SERIAL_CONTROL, SET_MAG_OFFSETS; and
reports of a radio's full buffer, on which an autopilot sends less of everything: a client's radio
is not on the vehicle's link."""
_CHANGES_IN_FLIGHT = (
    *(23, 323),  # PARAM_SET, PARAM_EXT_SET
    *(54, 160),  # allowed area and fence: one that excludes the vehicle moves it
    *(386, 387, 11000, 11002, 11004, 8002),  # CAN and device buses, SECURE_COMMAND, power
    *(147, 181),  # batteries: PX4 takes them for its own, and acts on an empty one
    *(7, 121, 248, 299, 385, 11033),  # keys, erased logs, tunnels, Wi-Fi, OSD
    *(10001, 10004, 10005, 10007, 42000, 42001, 50004, 52000),  # transponder, avoidance, firmware
)
_QUESTIONS_AND_ANSWERS = (
    *(0, 2, 4, 6, 20, 21, 22, 37, 40, 41, 42, 43, 46, 47, 51, 53, 67, 77, 8, 380),
    *(117, 118, 119, 120, 122, 123, 127, 128, 130, 131, 133, 134, 135, 136, 142, 148, 161, 162),
    *(175, 176, 183, 184, 185, 233, 244, 253, 257, 258, 266, 267, 268, 300, 310, 311, 320, 321),
    *(
        322,
        324,
        345,
        370,
        388,
        395,
        396,
        397,
        410,
        411,
        412,
        413,
        435,
        436,
        437,
        11001,
        11003,
        11005,
        11034,
        11035,
        11036,
    ),
    *(10002, 10003, 10006, 10008, 50005, 52001, 60041),
)
"""Among them corrections of GNSS and terrain, which a ground station provides, and rally points."""
_CAMERAS_AND_GIMBALS = (
    *(112, 154, 155, 156, 157, 158, 179, 180, 186, 200, 201, 214, 215, 216, 217, 218, 219),
    *(259, 260, 261, 262, 263, 264, 265, 269, 270, 271, 275, 276, 277, 280, 281, 282, 283, 284),
    *(285, 286, 287, 288, 50002, 60000, 60010, 60011, 60012, 60013, 60014, 60020),
)
_TRAFFIC = (246, 247, 301, 340, *range(12900, 12906), 12915, 12918, 12919)
"""Others in the air.  An autopilot that is set to avoid them does so by a mode of its own, which
ends the companion's flight: it is a person's decision, and not to be taken from him."""
_REPORTS = (
    *(1, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 49, 55, 61, 62, 63, 64, 65, 74, 83),
    *(85, 87, 89, 105, 108, 116, 124, 125, 129, 137, 140, 141, 143, 146, 150, 152, 153, 163, 164),
    *(165, 167, 168, 169, 170, 171, 172, 173, 174, 177, 178, 182, 191, 192, 193, 194, 195, 220),
    *(221, 222, 225, 226, 230, 231, 234, 235, 241, 242, 245, 249, 250, 251, 252, 254, 335, 339),
    *(350, 360, 373, 375, 376, 390, 441, 8003, 8004, 8005, 8006, 8007, 8009, 8010, 8011, 8012),
    *(8013, 8014, 8015, 8016, 9000, 9005, 10151, 11010, 11020, 11030, 11031, 11032, 11038, 11039),
    *(11040, 11041, 11042, 11043, 11044, 11060, 12920, 50001, 50003, 60040, 60045, 60046),
    *(60050, 60051, 60052, 60053, 17000, 17150, 17151, 17153, 17154, 17155, 17156, 17157, 17158),
)
"""What vehicles and programs say of themselves; an autopilot reads none of it."""

_CLASSES: dict[int, MessageClass] = {
    **dict.fromkeys(_QUESTIONS_AND_ANSWERS, MessageClass.HARMLESS),
    **dict.fromkeys(_CAMERAS_AND_GIMBALS, MessageClass.HARMLESS),
    **dict.fromkeys(_TRAFFIC, MessageClass.HARMLESS),
    **dict.fromkeys(_REPORTS, MessageClass.HARMLESS),
    **dict.fromkeys(_SETPOINTS, MessageClass.STEERS),
    **dict.fromkeys(_ESTIMATES, MessageClass.STEERS),
    **dict.fromkeys(_CHANGES, MessageClass.CHANGES),
    **dict.fromkeys(_CHANGES_IN_FLIGHT, MessageClass.CHANGES_IN_FLIGHT),
    11: MessageClass.MODE,
    38: MessageClass.MISSION,
    39: MessageClass.MISSION,
    44: MessageClass.MISSION,
    45: MessageClass.MISSION,
    66: MessageClass.RATES,
    69: MessageClass.STICKS,
    70: MessageClass.STICKS,
    73: MessageClass.MISSION,
    75: MessageClass.COMMAND,
    76: MessageClass.COMMAND,
    110: MessageClass.FILES,
    111: MessageClass.TIME,
    256: MessageClass.LOCKS_OUT,
    420: MessageClass.STICKS,
}

STATED_IDS = frozenset(_CLASSES)
"""Ids whose class is known."""


def class_of(message_id: int) -> MessageClass:
    """The class of a message; one that is not known here may be anything."""
    return _CLASSES.get(message_id, MessageClass.CHANGES_IN_FLIGHT)
