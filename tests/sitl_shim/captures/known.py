"""The differences between the shim and the real autopilots that are known, and why they are.

docs/differences.md is written from this table, by ``python tools/differences.py``.
"""

import re
from dataclasses import dataclass
from fnmatch import fnmatchcase

_PX4, _ARDUPILOT, _ALL = "px4-*", "ardupilot-*", "*"


@dataclass(frozen=True)
class Known:
    """One known difference."""

    captures: str
    """Names of the recordings in which it shows, as a pattern."""
    aspect: str
    text: str
    """Regular expression of the whole text that `compare` gives for it."""
    what: str
    """What differs, as a sentence."""
    why: str

    def covers(self, capture: str, aspect: str, text: str) -> bool:
        return (
            aspect == self.aspect
            and fnmatchcase(capture, self.captures)
            and re.fullmatch(self.text, text) is not None
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
        _PX4,
        "messages",
        "POSITION_TARGET_GLOBAL_INT does not come",
        "POSITION_TARGET_GLOBAL_INT is not streamed.",
        "POSITION_TARGET_LOCAL_NED tells the same.",
    ),
    Known(
        "px4-stream-loss-hold",
        "rates",
        "CURRENT_MODE comes faster",
        "CURRENT_MODE, asked for at 10 Hz, comes at 10 Hz; the real one sends it twice a second "
        "and at each change.",
        "A change is seen as early; nobody is hurt by being told again.",
    ),
    Known(
        "px4-boot-onboard",
        "acknowledgements",
        r"ACK (0 to command 512 does not come|2 to command 512 comes, the real one has none)",
        "Requests for COMPONENT_INFORMATION (395) and COMPONENT_METADATA (397) are denied.",
        "The files that they point to are PX4's own; a ground station goes on without them.",
    ),
    Known(
        "px4-boot-onboard",
        "answers",
        r"COMPONENT_\w+ \(\d+\) does not come",
        "COMPONENT_INFORMATION (395) and COMPONENT_METADATA (397) do not exist.",
        "As above.",
    ),
    Known(
        "px4-boot-onboard",
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
        _ALL,
        "parameters",
        "other parameters are told unasked",
        "While booting and in flight other parameters are told unasked.",
        "The real ones tell what calibrations and counters of flight time (CAL_*, INS_*, STAT_*) "
        "they have changed themselves; the shim has none of these, or leaves them as they are.",
    ),
    Known(
        "px4-offboard",
        "parameters",
        r"PARAM_(VALUE of|ERROR 1 for) MAV_0_BROADCAST.*",
        "MAV_0_BROADCAST does not exist.",
        "The list of the real one has not got it either; asked for by its name it was there.",
    ),
    Known(
        "px4-params-mission",
        "parameters",
        "a change is told once more a moment later",
        "A parameter that is set to what it is already is told once, as the answer.",
        "The real one tells it again with the next change of any other.",
    ),
    # --- PX4: health, events, order ---
    Known(
        "px4-params-mission",
        "health",
        r"SYS_STATUS \w+ \w+ \w+ (does not come|comes, the real one has none|comes earlier)",
        "Which sensors are up at which moment of the boot.",
        "It differs from boot to boot of the real one: this one was 2 s slower than the others.",
    ),
    Known(
        "px4-offboard",
        "health",
        r"SYS_STATUS 0x300402f 0x301402f 0x1?320c83f (comes later|does not come)",
        "After a change to OFFBOARD with a stream that had just begun, the real one clears "
        "PREARM_CHECK in SYS_STATUS for 0.6 s.",
        "The vehicle flies then; nobody asks whether it may be armed.",
    ),
    Known(
        _PX4,
        "events",
        r"EVENT 23579003 is missing",
        "One event of the report of health (23579003) is not told.",
        "Which of PX4's checks it belongs to is not known here.",
    ),
    Known(
        "px4-params-mission",
        "events",
        r"EVENT (27227279 is missing|(26788467|30612409) comes less often)",
        "The report of health is told less often.",
        "The slower boot, as above: the real one reported once more.",
    ),
    Known(
        "px4-params-mission",
        "events",
        r"EVENT (23752078|25297520) is missing",
        "What goes wrong with a mission's transfer is told as text alone, not as an event, too.",
        "The text says the same.",
    ),
    Known(
        "px4-mavproxy",
        "events",
        r"EVENT (17154777|17231145|18691879|19865031|27825120) is missing",
        "When a ground station is heard for the first time, the real one reports its health anew.",
        "The health that the shim reports does not depend on ground stations.",
    ),
    Known(
        "px4-params-mission",
        "missions",
        r"MISSION_COUNT \{'count': 4, 'mission_type': 0\} (does not come|comes, .*)",
        "Answers that are due within the same 4 ms (the last MISSION_ACK of an upload and the "
        "MISSION_COUNT of a download asked for at once) may leave in the other order.",
        "Time goes in ticks of 4 ms; no client may count on that order.",
    ),
    Known(
        "px4-offboard",
        "landed state",
        "landed_state 2 comes earlier",
        "Take-off to 2.5 m is over up to 2.6 s earlier.",
        "The real one's own take-offs took between 6 and 8 s.",
    ),
    # --- ArduPilot ---
    Known(
        "ardupilot-boot",
        "health",
        r"SYS_STATUS 0x5371fc2f 0x5361fc2f 0x[45]771fc2f comes, the real one has none",
        "After disarming in GUIDED the PREARM_CHECK bit is clear for 0.6 s.",
        "The checks are made once a second; the real one made them in the same moment.",
    ),
    Known(
        "ardupilot-*",
        "texts",
        r"'SIM Hit ground at \* m/s' \(severity 6\) does not come",
        "The text 'SIM Hit ground at …' does not come.",
        "It is ArduPilot's own simulation that says it, no autopilot.",
    ),
    Known(
        "ardupilot-flight",
        "landed state",
        "landed_state 1 comes earlier",
        "The vehicle is on the ground up to 3 s earlier.",
        "In the minute in which the client's own thrust loop flew the real one, it ended higher.",
    ),
    Known(
        "ardupilot-flight",
        "parameters",
        r"PARAM_VALUE of MOT_THST_HOVER, .*",
        "MOT_THST_HOVER stays as it is.",
        "The real one learns it in flight, from 0.39 to 0.366.",
    ),
    Known(
        "ardupilot-mavsdk",
        "parameters",
        r"PARAM_VALUE of GUID_OPTIONS, type 9, bytes 00000000 does not come"
        r"|a change is told once more, which the real one does not do",
        "The answer to a PARAM_SET of an integer names its true type (6).",
        "The real one answered one of MAVSDK's with type 9, and one of pymavlink's with 6.",
    ),
    Known(
        "ardupilot-flight",
        "effects of setpoints",
        r"mask (3|71|7), thrust 0.5, tilt 6°, .*: tilt( echoed)?, ° differs",
        "A rejected setpoint (some rates masked, thrust ignored, a quaternion of another norm) "
        "stops the vehicle gently.",
        "The real one, told to stop fifty times a second, sways by 10° while it stops.",
    ),
)
