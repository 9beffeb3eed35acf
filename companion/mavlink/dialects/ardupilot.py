"""ArduCopter, as a running 4.7 behaves on the wire."""

import math
from collections.abc import Mapping

from companion.mavlink.commands import Command, CommandId, takeoff_to
from companion.mavlink.dialects.base import (
    PREARM_CHECK,
    HandOver,
    ParameterEncoding,
    Readiness,
    ReadinessFacts,
    Stream,
    unwell_sensors,
)
from companion.mavlink.messages import MessageId, Target
from companion.thrust_meaning import ThrustMeaning

_CUSTOM_MODE_ENABLED = 1.0
_HORIZONTAL_POSITION = 0x10
"""ESTIMATOR_POS_HORIZ_ABS of EKF_STATUS_REPORT's flags."""
_THRUST_AS_THRUST = 8
"""Bit of GUID_OPTIONS: the thrust field is a throttle, not a climb rate."""
_DEFAULT_TIMEOUT_S = 3.0
_CM = 0.01

_SPEEDS = (("WP_SPD_UP", "WP_SPD_DN", 1.0), ("WPNAV_SPEED_UP", "WPNAV_SPEED_DN", _CM))
"""Names of the climb and descent speeds and their unit in m/s: newer builds first, which renamed
them when they went from cm/s to m/s."""

_MODES: dict[str, int] = {
    "stabilize": 0,
    "acro": 1,
    "alt_hold": 2,
    "auto": 3,
    "guided": 4,
    "loiter": 5,
    "rtl": 6,
    "circle": 7,
    "land": 9,
    "drift": 11,
    "sport": 13,
    "flip": 14,
    "autotune": 15,
    "poshold": 16,
    "brake": 17,
    "throw": 18,
    "avoid_adsb": 19,
    "guided_nogps": 20,
    "smart_rtl": 21,
    "flowhold": 22,
    "follow": 23,
    "zigzag": 24,
    "systemid": 25,
    "autorotate": 26,
    "auto_rtl": 27,
    "turtle": 28,
}

_NAMES = {number: name for name, number in _MODES.items()}


class ArduPilot:
    """ArduCopter's dialect.

    Modes are judged by `custom_mode` alone: the GUIDED bit of `base_mode` drops while attitude
    targets are obeyed.
    """

    name = "ardupilot"
    title = "ArduPilot"
    autopilot_id = 3
    streams = (
        # It has no ODOMETRY. Both in steps of 8 to 12 ms; whole milliseconds are exact on average.
        Stream(MessageId.ATTITUDE_QUATERNION, 0.010, required=True),
        Stream(MessageId.LOCAL_POSITION_NED, 0.010, required=True),
        # HEARTBEAT comes once a second and at each change; this, where it exists, bears it out.
        Stream(MessageId.CURRENT_MODE, 0.100, required=False),
        Stream(MessageId.SYS_STATUS, 0.200, required=True),
        Stream(MessageId.EKF_STATUS_REPORT, 0.200, required=True),
        Stream(MessageId.EXTENDED_SYS_STATE, 0.200, required=True),
        Stream(MessageId.ATTITUDE_TARGET, 0.100, required=False),
        Stream(MessageId.BATTERY_STATUS, 1.000, required=False),
    )
    stream_remedy = (
        "Raise the link's baud rate (SERIALn_BAUD, up to 921), set its legacy stream rates "
        "(MAVn_*, in builds before 4.7 SRn_*) to 0, or let fewer streams share the link"
    )
    state_before_position = False
    """LOCAL_POSITION_NED is granted and stays silent until the estimator has a position."""
    parameter_encoding = ParameterEncoding.C_CAST
    flight_parameters = (
        "GUID_OPTIONS",
        "GUID_TIMEOUT",
        "ATC_ANGLE_BOOST",
        "WPNAV_SPEED_UP",
        "WPNAV_SPEED_DN",
        "WP_SPD_UP",
        "WP_SPD_DN",
    )
    hand_over = HandOver(
        modes=("brake", "land"),
        explanation="ArduPilot is commanded to BRAKE, or to LAND if it refuses, and the setpoint "
        "stream stops once it does",
    )
    """Without a stream it would keep the last target for GUID_TIMEOUT and then drift, level."""
    mode_before_arming = "guided"
    arms_in_setpoint_mode = False
    takeoff_modes = ("guided",)
    setpoint_mode = "guided"
    stream_before_mode_s = 0.0
    """GUIDED obeys a setpoint at once."""

    def custom_mode(self, name: str) -> int:
        """The `custom_mode` of a mode.

        Raises:
            KeyError: ArduCopter has no such mode.
        """
        if name not in _MODES:
            raise KeyError(f"ArduCopter has no mode {name!r}; it has {', '.join(_MODES)}")
        return _MODES[name]

    def mode_name(self, custom_mode: int) -> str:
        """The name of a `custom_mode`, or a description of an unknown one."""
        return _NAMES.get(custom_mode, f"ArduCopter mode {custom_mode}")

    def set_mode(self, target: Target, name: str) -> Command:
        """DO_SET_MODE; while ArduPilot boots, its acknowledgement means nothing (`mode_change`).

        Raises:
            KeyError: ArduCopter has no such mode.
        """
        number = float(self.custom_mode(name))
        return Command(
            CommandId.DO_SET_MODE,
            target,
            (_CUSTOM_MODE_ENABLED, number, 0.0, 0.0, 0.0, 0.0, 0.0),
        )

    def takeoff(self, target: Target, height_m: float) -> Command:
        """NAV_TAKEOFF to a height above where the vehicle stands, in parameter 7."""
        return takeoff_to(target, height_m)

    def thrust_meaning(self, parameters: Mapping[str, float]) -> ThrustMeaning | str:
        """By GUID_OPTIONS: a climb rate by default, else a throttle that angle boost may raise."""
        options = parameters.get("GUID_OPTIONS")
        if options is None:
            return (
                "ArduPilot did not answer what GUID_OPTIONS is, so it is not known whether it "
                "takes the thrust field for a climb rate or for a throttle. ArduCopter 4.1 or "
                "later is needed, and a link on which parameters can be read"
            )
        if int(options) & _THRUST_AS_THRUST:
            boost = parameters.get("ATC_ANGLE_BOOST")
            if boost is None:
                return (
                    "ArduPilot takes the thrust field for a throttle (GUID_OPTIONS 8) and did not "
                    "answer what ATC_ANGLE_BOOST is, so it is not known who makes up for tilt. "
                    "Set GUID_OPTIONS to 0 for a climb rate, or see that parameters can be read"
                )
            return ThrustMeaning("vertical" if boost else "collective")
        for up, down, unit_m_s in _SPEEDS:
            climb = parameters.get(up, math.nan) * unit_m_s
            descent = abs(parameters.get(down, math.nan)) * unit_m_s
            if climb > 0.0 and descent > 0.0:
                return ThrustMeaning("climb_rate", climb, descent)
        return (
            "ArduPilot takes the thrust field for a climb rate (GUID_OPTIONS 0), and of "
            "WPNAV_SPEED_UP and WPNAV_SPEED_DN (in newer builds WP_SPD_UP and WP_SPD_DN), which "
            "scale it, it did not say what they are, or not above 0. Set them"
        )

    def setpoint_timeout_s(self, parameters: Mapping[str, float]) -> float:
        """GUID_TIMEOUT, for which it keeps the last target before it levels and drifts."""
        return parameters.get("GUID_TIMEOUT", _DEFAULT_TIMEOUT_S)

    def takeoff_height_m(self, parameters: Mapping[str, float], wanted_m: float) -> float:
        """What is wanted."""
        return wanted_m

    def readiness(self, facts: ReadinessFacts) -> Readiness:
        """GUIDED, a position of the estimator that arrives, and the pre-arm check passed in GUIDED.

        The PREARM_CHECK bit depends on the mode: in STABILIZE it is set without a position.
        """
        missing: list[str] = []
        if facts.custom_mode != _MODES["guided"]:
            now = "unknown" if facts.custom_mode is None else self.mode_name(facts.custom_mode)
            missing.append(f"mode guided (it is in {now})")
        if facts.estimator_flags is None:
            missing.append("EKF_STATUS_REPORT")
        elif not facts.estimator_flags & _HORIZONTAL_POSITION:
            missing.append("a position of its estimator (GPS or another source)")
        elif not facts.position_arrives:
            missing.append("the state's stream (LOCAL_POSITION_NED, ATTITUDE_QUATERNION)")
        if facts.sensors is None or not facts.sensors_of_mode:
            missing.append("a SYS_STATUS in this mode")
        elif not facts.sensors[2] & PREARM_CHECK:
            missing += unwell_sensors(facts.sensors) or ("its pre-arm check",)
        return Readiness(not missing, tuple(missing))
