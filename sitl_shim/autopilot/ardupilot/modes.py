"""ArduCopter's flight modes and their faces on the wire."""

from enum import IntEnum

from sitl_shim.autopilot.interface import ModeInfo


class Mode(IntEnum):
    """Flight modes, by their custom_mode."""

    STABILIZE = 0
    ALT_HOLD = 2
    AUTO = 3
    GUIDED = 4
    LOITER = 5
    RTL = 6
    LAND = 9
    BRAKE = 17
    GUIDED_NOGPS = 20

    @property
    def needs_position(self) -> bool:
        """Whether the mode cannot run, nor be armed in, without a position."""
        return self in _NEED_POSITION

    @property
    def may_arm(self) -> bool:
        """Whether the vehicle may be armed in it."""
        return self not in _NO_ARMING_IN

    @property
    def is_guided(self) -> bool:
        """Whether it obeys attitude setpoints."""
        return self in (Mode.GUIDED, Mode.GUIDED_NOGPS)


_NEED_POSITION = (Mode.AUTO, Mode.GUIDED, Mode.LOITER, Mode.RTL, Mode.BRAKE)
_NO_ARMING_IN = (Mode.AUTO, Mode.RTL, Mode.LAND, Mode.BRAKE)

_MANUAL, _STABILIZE, _GUIDED, _CUSTOM, _ARMED = 0x40, 0x10, 0x08, 0x01, 0x80
_FROM_STICKS = (Mode.STABILIZE, Mode.ALT_HOLD)


def base_mode(*, armed: bool, position_controlled: bool) -> int:
    """HEARTBEAT's base_mode: of the modes it tells only whether a position is controlled."""
    bits = _MANUAL | _STABILIZE | _CUSTOM
    if position_controlled:
        bits |= _GUIDED
    return bits | _ARMED if armed else bits


def mode_of(number: int) -> Mode | None:
    """The mode of a custom_mode; None if it is none of these."""
    try:
        return Mode(number)
    except ValueError:
        return None


def mode_named(name: str) -> Mode:
    """The mode of a name.

    Raises:
        ValueError: there is none of this name; the text says which there are.
    """
    try:
        return Mode[name.upper()]
    except KeyError:
        known = ", ".join(mode.name for mode in Mode)
        raise ValueError(
            f"there is no mode {name!r} of ArduCopter here; there are {known}"
        ) from None


_STANDARD: dict[Mode, int] = {Mode.AUTO: 6, Mode.RTL: 5, Mode.LAND: 7, Mode.LOITER: 1}
"""MAV_STANDARD_MODE, where a mode is one: MISSION, SAFE_RECOVERY, LAND, POSITION_HOLD."""
_ADVANCED = 1


def standard_mode(mode: Mode) -> int:
    """MAV_STANDARD_MODE of a mode; 0 where it is none of them."""
    return _STANDARD.get(mode, 0)


def mode_name(mode: Mode) -> str:
    """The mode's name in texts."""
    return mode.name


AVAILABLE_MODES: tuple[ModeInfo, ...] = tuple(
    ModeInfo(
        custom_mode=mode.value,
        standard_mode=standard_mode(mode),
        properties=0 if mode in _FROM_STICKS else _ADVANCED,
        name=mode.name,
    )
    for mode in Mode
)
"""What AVAILABLE_MODES lists."""
