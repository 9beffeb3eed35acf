"""The differences between the shim and the real autopilots that are known, and why they are.

docs/differences.md is written from this table, by ``python tools/differences.py``.
"""

import re
from dataclasses import dataclass
from itertools import chain

_PX4_FLOWN = ("px4-offboard", "px4-stream-loss-hold", "px4-mavsdk")
_PX4_BOOTED = (*_PX4_FLOWN, "px4-params-mission")
_PX4 = (*_PX4_BOOTED, "px4-boot-onboard", "px4-mavproxy")
_ARDUPILOT_FLOWN = ("ardupilot-flight", "ardupilot-mavsdk")


@dataclass(frozen=True)
class Known:
    """One known difference."""

    captures: tuple[str, ...]
    """The recordings in which it shows, each of them."""
    aspect: str
    text: str
    """Regular expression of the whole text that `compare` gives for it.  A group named `size` is
    the size of the difference."""
    what: str
    """What differs, as a sentence."""
    why: str
    up_to: float | None = None
    """The largest size that is covered."""

    def covers(self, capture: str, aspect: str, text: str) -> bool:
        if aspect != self.aspect or capture not in self.captures:
            return False
        found = re.fullmatch(self.text, text)
        if found is None or self.up_to is None:
            return found is not None
        return float(found["size"]) <= self.up_to


@dataclass(frozen=True)
class NotCompared:
    """What no recording of a flavour holds."""

    flavour: str
    aspect: str
    what: str
    wholly: bool = True
    """Whether nothing at all of the aspect is compared."""


NOT_COMPARED: tuple[NotCompared, ...] = (
    NotCompared(
        "px4",
        "effects of setpoints",
        "No recording has a setpoint whose thrust is masked (64), nor a yaw rate beside an "
        "attitude (mask 3). What the shim does then is what a real one was measured to do; "
        "`tests/sitl_shim/autopilot/test_px4_offboard.py` holds it to that.",
        wholly=False,
    ),
    NotCompared("ardupilot", "current mode", "This ArduCopter sends no CURRENT_MODE."),
    NotCompared("ardupilot", "events", "ArduPilot has no EVENT."),
    NotCompared("ardupilot", "missions", "No recording has one."),
    NotCompared("ardupilot", "files", "No recording has one read."),
    NotCompared(
        "ardupilot",
        "parameters",
        "No recording has the parameter list. The shim has about 110 parameters of the real "
        "one's 1,348.",
        wholly=False,
    ),
)


def _names(*names: str) -> str:
    return f"({'|'.join(names)})"


_PX4_CALIBRATIONS = _names(
    *(f"CAL_{sensor}_ID" for sensor in ("ACC0", "ACC1", "ACC2", "GYRO0", "GYRO1", "GYRO2")),
    *(f"CAL_BARO0_{what}" for what in ("ID", "OFF", "PRIO")),
    *chain.from_iterable((f"CAL_MAG{n}_ID", f"CAL_MAG{n}_PRIO") for n in (0, 1)),
    "SENS_BOARD_X_OFF",
    "SENS_DPRES_OFF",
    "SYS_AUTOCONFIG",
    "SYS_AUTOSTART",
)
_ARDUPILOT_CALIBRATIONS = _names(
    "INS_ACC_ID",
    "INS_ACC2_ID",
    *(f"INS_GYR{n}_ID" for n in ("", "2", "3")),
    *(f"INS_GYR{n}_CALTEMP" for n in ("1", "2")),
    *(f"INS_GYR{n}OFFS_{axis}" for n in ("", "2", "3") for axis in "XYZ"),
    "EK3_SRC1_POSXY",
)
_EXACT_SYS_STATUS = (
    r"SYS_STATUS 0x300400f 0x321480f 0x300803f does not come"
    r"|SYS_STATUS 0x300402f 0x301402f 0x320883f does not come"
    r"|SYS_STATUS 0x300400f 0x301400f 0x320883f comes, the real one has none"
)

KNOWN: tuple[Known, ...] = (
    # --- PX4: what it streams and has ---
    Known(
        _PX4,
        "messages",
        r"(message (8|380)|SCALED_PRESSURE|DISTANCE_SENSOR|GNSS_INTEGRITY|OPEN_DRONE_ID_\w+)"
        r" does not come",
        "LINK_NODE_STATUS (8), TIME_ESTIMATE_TO_TARGET (380), SCALED_PRESSURE, DISTANCE_SENSOR, "
        "GNSS_INTEGRITY and OPEN_DRONE_ID_* are not streamed.",
        "Nothing in the simulation stands behind them, and no client looked at needs them.",
    ),
    Known(
        _PX4_FLOWN,
        "messages",
        "POSITION_TARGET_GLOBAL_INT does not come",
        "POSITION_TARGET_GLOBAL_INT is not streamed.",
        "POSITION_TARGET_LOCAL_NED tells the same.",
    ),
    Known(
        ("px4-offboard",),
        "rates",
        r"ATTITUDE_TARGET comes (?P<size>\d+) % more often",
        "ATTITUDE_TARGET comes at its rate also while setpoints come more slowly than it, or have "
        "stopped (up to 16 % more over the whole of a recording full of pauses).",
        "The real one sends it when there is a new one. An echo told again says nothing false.",
        up_to=16,
    ),
    Known(
        ("px4-boot-onboard",),
        "acknowledgements",
        r"ACK (0 to command 512 does not come|2 to command 512 comes, the real one has none)",
        "Requests for COMPONENT_INFORMATION (395) and COMPONENT_METADATA (397) are denied.",
        "The files that they point to are PX4's own; a ground station goes on without them.",
    ),
    Known(
        ("px4-boot-onboard",),
        "answers",
        r"COMPONENT_\w+ \(\d+\) does not come",
        "COMPONENT_INFORMATION (395) and COMPONENT_METADATA (397) do not exist.",
        "As above.",
    ),
    Known(
        ("px4-boot-onboard",),
        "answers",
        r"mode (Position Slow|Altitude Cruise|Termination|Follow Target|Precision Landing"
        r"|VTOL Takeoff|\(Mode not available\)|) 0x(2030000|b0000|a0000|8040000|9040000|1030000"
        r"|\w+040000) standard [02] [0123] does not come",
        "AVAILABLE_MODES lists 11 modes, not 26.",
        "The shim lists the modes that it has. It has no Position Slow, Altitude Cruise, "
        "Termination, Follow Target, Orbit, Precision Landing and VTOL Takeoff, and none of the "
        "eight places for modes of one's own.",
    ),
    # --- PX4: parameters ---
    Known(
        _PX4_BOOTED,
        "parameters",
        rf"{_PX4_CALIBRATIONS} is not told unasked",
        "While booting the identities and corrections of sensors (CAL_ACC*, CAL_BARO0_*, "
        "CAL_GYRO*, CAL_MAG*, SENS_BOARD_X_OFF, SENS_DPRES_OFF), SYS_AUTOCONFIG and "
        "SYS_AUTOSTART are not told unasked.",
        "The real one's drivers and start script set them; the shim has no drivers.",
    ),
    Known(
        ("px4-offboard",),
        "parameters",
        r"PARAM_(VALUE of|ERROR 1 for) MAV_0_BROADCAST.*",
        "MAV_0_BROADCAST does not exist.",
        "The list of the real one has not got it either; asked for by its name it was there.",
    ),
    Known(
        ("px4-params-mission",),
        "parameters",
        "a change is told once more a moment later",
        "A parameter that is set to what it is already is told once, as the answer.",
        "The real one tells it again with the next change of any other.",
    ),
    # --- PX4: health, events, order ---
    Known(
        ("px4-params-mission",),
        "health",
        _EXACT_SYS_STATUS,
        "SYS_STATUS between 2 s and 6 s of the boot (present, enabled, healthy): 0x300400f, "
        "0x321480f, 0x300803f and then 0x300402f, 0x301402f, 0x320883f, where the shim has "
        "0x300400f, 0x301400f, 0x320883f.",
        "In which order sensors come up differs from boot to boot of the real one: the others did "
        "as the shim does.",
    ),
    Known(
        ("px4-params-mission",),
        "health",
        r"SYS_STATUS 0x300402f 0x301402f 0x1320c83f comes (?P<size>[\d.]+) s earlier",
        "Booting is over up to 2.2 s earlier.",
        "This boot of the real one was 2 s slower than its others.",
        up_to=2.2,
    ),
    Known(
        ("px4-offboard",),
        "health",
        r"SYS_STATUS 0x300402f 0x301402f 0x1?320c83f does not come",
        "After a change to OFFBOARD with a stream that had just begun, the real one clears "
        "PREARM_CHECK (0x10000000) in SYS_STATUS for 0.6 s.",
        "The vehicle flies then; nobody asks whether it may be armed.",
    ),
    Known(
        _PX4_BOOTED,
        "events",
        r"EVENT 23579003 comes 0 times, the real one's [14] times",
        "One event of the report of health (23579003) is not told.",
        "Which of PX4's checks it belongs to is not known here.",
    ),
    Known(
        ("px4-params-mission",),
        "events",
        r"EVENT (27227279 comes 0 times, the real one's 1 times"
        r"|(26788467|30612409) comes 1 times, the real one's 2 times)",
        "The report of health (26788467, 27227279, 30612409) is told once less.",
        "The slower boot, as above: the real one reported once more.",
    ),
    Known(
        ("px4-params-mission",),
        "events",
        r"EVENT (23752078|25297520) comes 0 times, the real one's 1 times",
        "What goes wrong with a mission's transfer is told as text alone, not as an event "
        "(23752078, 25297520), too.",
        "The text says the same.",
    ),
    Known(
        ("px4-mavproxy",),
        "events",
        r"EVENT (17154777|17231145|18691879|19865031|27825120) comes 0 times, "
        r"the real one's 1 times",
        "When a ground station is heard for the first time, the real one reports its health anew "
        "(17154777, 17231145, 18691879, 19865031, 27825120).",
        "The health that the shim reports does not depend on ground stations.",
    ),
    Known(
        ("px4-params-mission",),
        "missions",
        r"MISSION_(ACK \{'type': 0|COUNT \{'count': 4), 'mission_type': 0\} "
        r"(does not come|comes, the real one has none)",
        "Answers that are due within the same 4 ms (the last MISSION_ACK of an upload and the "
        "MISSION_COUNT of a download asked for at once) may leave in the other order.",
        "Time goes in ticks of 4 ms; no client may count on that order.",
    ),
    Known(
        ("px4-offboard",),
        "landed state",
        r"landed_state 2 comes (?P<size>[\d.]+) s earlier",
        "Take-off to 2.5 m is over up to 2.8 s earlier.",
        "The real one's own take-offs took between 6 and 8 s.",
        up_to=2.8,
    ),
    # --- ArduPilot ---
    Known(
        ("ardupilot-boot",),
        "health",
        r"SYS_STATUS 0x5371fc2f 0x5361fc2f 0x[45]771fc2f comes, the real one has none",
        "After disarming in GUIDED the PREARM_CHECK bit (0x10000000) is clear for 0.6 s.",
        "The checks are made once a second; the real one made them in the same moment.",
    ),
    Known(
        _ARDUPILOT_FLOWN,
        "texts",
        r"'SIM Hit ground at \* m/s' \(severity 6\) does not come",
        "The text 'SIM Hit ground at …' does not come.",
        "It is ArduPilot's own simulation that says it, no autopilot.",
    ),
    Known(
        ("ardupilot-flight",),
        "landed state",
        r"landed_state 1 comes (?P<size>[\d.]+) s earlier",
        "The vehicle is on the ground up to 3 s earlier.",
        "In the minute in which the client's own thrust loop flew the real one, it ended higher.",
        up_to=3,
    ),
    Known(
        ("ardupilot-boot", *_ARDUPILOT_FLOWN),
        "parameters",
        r"(BARO[12]_GND_PRESS|MIS_TOTAL|STAT_(RUN|FLT)TIME|MOT_THST_HOVER) is not told unasked",
        "The pressure at the ground (BARO*_GND_PRESS), the number of mission items (MIS_TOTAL), "
        "times of running and flying (STAT_*) and, when disarming, MOT_THST_HOVER are not told "
        "unasked.",
        "The real one tells what it saves. The shim has no barometers and no counters of time; "
        "MIS_TOTAL and what it has learned for MOT_THST_HOVER it tells when asked.",
    ),
    Known(
        _ARDUPILOT_FLOWN,
        "parameters",
        rf"{_ARDUPILOT_CALIBRATIONS} is not told unasked",
        "While booting the identities and corrections of sensors (INS_ACC*_ID, INS_GYR*) and "
        "EK3_SRC1_POSXY are not told unasked.",
        "The real one's drivers set them; the shim has no drivers. What sets EK3_SRC1_POSXY, to "
        "what it is already, is not known here.",
    ),
    Known(
        ("ardupilot-mavsdk",),
        "parameters",
        r"PARAM_VALUE of GUID_OPTIONS, type 9, bytes 00000000 does not come"
        r"|a change is told once more, which the real one does not do",
        "The answer to a PARAM_SET of an integer names its true type (6).",
        "The real one answered one of MAVSDK's with type 9, and one of pymavlink's with 6.",
    ),
    Known(
        ("ardupilot-flight",),
        "effects of setpoints",
        r"mask (3, thrust 0.5, tilt 5°, rates \(0.0, 0.0, 0.3\)|71, thrust 0.5, tilt 5°"
        r"|7, thrust 0.5, tilt 5°, norm 1.01): (echoed tilt|tilt|heading) \(°\) differs by "
        r"(?P<size>[\d.]+)",
        "A rejected setpoint (some rates masked: 3; thrust ignored: 71; a quaternion of norm 1.01) "
        "stops the vehicle gently: tilt and heading differ by up to 12°.",
        "The real one, told to stop fifty times a second, sways by 10° while it stops.",
        up_to=12,
    ),
)
