"""PX4, as a running v1.17 behaves on the wire."""

from collections.abc import Mapping

from companion.mavlink.commands import Command, CommandId, takeoff_here
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
from companion.thrust_meaning import COLLECTIVE, ThrustMeaning

_CUSTOM_MODE_ENABLED = 1.0
_DEFAULT_TIMEOUT_S = 1.0
_DEFAULT_TAKEOFF_M = 2.5

_MODES: dict[str, tuple[int, int]] = {
    "manual": (1, 0),
    "altctl": (2, 0),
    "posctl": (3, 0),
    "ready": (4, 1),
    "takeoff": (4, 2),
    "loiter": (4, 3),
    "mission": (4, 4),
    "rtl": (4, 5),
    "land": (4, 6),
    "acro": (5, 0),
    "offboard": (6, 0),
    "stabilized": (7, 0),
}
"""(main mode, sub mode) of each."""

_NAMES = {modes: name for name, modes in _MODES.items()}


def encode_mode(main: int, sub: int = 0) -> int:
    """PX4's `custom_mode` of a main and a sub mode."""
    return sub << 24 | main << 16


def decode_mode(custom_mode: int) -> tuple[int, int]:
    """Main and sub mode of PX4's `custom_mode`."""
    return (custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF)


class Px4:
    """PX4's dialect."""

    name = "px4"
    title = "PX4"
    autopilot_id = 12
    streams = (
        # PX4 rounds to its 4 ms tick: 10 ms gives 99 Hz.
        Stream(MessageId.ODOMETRY, 0.010, required=True),
        # HEARTBEAT cannot be asked for faster than 1 Hz; this shows a mode change at once.
        Stream(MessageId.CURRENT_MODE, 0.100, required=False),
        Stream(MessageId.SYS_STATUS, 0.200, required=True),
        Stream(MessageId.EXTENDED_SYS_STATE, 0.200, required=True),
        # ODOMETRY goes on, by dead reckoning, when the position is lost: this tells.
        Stream(MessageId.ESTIMATOR_STATUS, 0.100, required=False),
        Stream(MessageId.ATTITUDE_TARGET, 0.100, required=False),
        Stream(MessageId.BATTERY_STATUS, 1.000, required=False),
    )
    stream_remedy = (
        "Raise the link's baud rate (SER_*_BAUD, up to 921600) and MAV_n_RATE, set MAV_n_MODE to "
        "Onboard, or let fewer streams share the link"
    )
    state_before_position = True
    parameter_encoding = ParameterEncoding.BYTEWISE
    flight_parameters = ("COM_OF_LOSS_T", "MIS_TAKEOFF_ALT")
    hand_over = HandOver(
        modes=(),
        explanation="the setpoint stream stops and PX4's failsafe (COM_OBL_RC_ACT) acts after "
        "COM_OF_LOSS_T, 1 s by default",
    )
    mode_before_arming = None
    arms_in_setpoint_mode = True
    takeoff_modes = ("takeoff", "loiter")
    setpoint_mode = "offboard"
    stream_before_mode_s = 1.0
    """100 ms were enough; PX4's documentation asks for 1 s."""

    def custom_mode(self, name: str) -> int:
        """The `custom_mode` of a mode.

        Raises:
            KeyError: PX4 has no such mode.
        """
        if name not in _MODES:
            raise KeyError(f"PX4 has no mode {name!r}; it has {', '.join(_MODES)}")
        return encode_mode(*_MODES[name])

    def mode_name(self, custom_mode: int) -> str:
        """The name of a `custom_mode`, or a description of an unknown one."""
        main, sub = decode_mode(custom_mode)
        return _NAMES.get((main, sub), f"PX4 mode {main}.{sub}")

    def set_mode(self, target: Target, name: str) -> Command:
        """DO_SET_MODE; its first acknowledgement means nothing (see `mode_change`).

        Raises:
            KeyError: PX4 has no such mode.
        """
        main, sub = decode_mode(self.custom_mode(name))
        return Command(
            CommandId.DO_SET_MODE,
            target,
            (_CUSTOM_MODE_ENABLED, float(main), float(sub), 0.0, 0.0, 0.0, 0.0),
        )

    def takeoff(self, target: Target, height_m: float) -> Command:
        """NAV_TAKEOFF to MIS_TAKEOFF_ALT: PX4's parameter 7 is above sea level, not ground."""
        return takeoff_here(target)

    def thrust_meaning(self, parameters: Mapping[str, float]) -> ThrustMeaning | str:
        """Collective thrust, whatever the parameters."""
        return COLLECTIVE

    def setpoint_timeout_s(self, parameters: Mapping[str, float]) -> float:
        """COM_OF_LOSS_T, after which COM_OBL_RC_ACT says what PX4 does."""
        return parameters.get("COM_OF_LOSS_T", _DEFAULT_TIMEOUT_S)

    def takeoff_height_m(self, parameters: Mapping[str, float], wanted_m: float) -> float:
        """MIS_TAKEOFF_ALT, whatever is wanted."""
        return parameters.get("MIS_TAKEOFF_ALT", _DEFAULT_TAKEOFF_M)

    def readiness(self, facts: ReadinessFacts) -> Readiness:
        """PX4 arms once the PREARM_CHECK bit is set; the other bits say what it waits for."""
        if facts.sensors is None:
            return Readiness(False, ("no SYS_STATUS came yet",))
        if facts.sensors[2] & PREARM_CHECK:
            return Readiness(True, ())
        return Readiness(False, unwell_sensors(facts.sensors) or ("PX4's pre-arm check",))
