"""PX4's flight modes and how they look on the wire.

custom_mode = (sub mode << 24) | (main mode << 16).
"""

from dataclasses import dataclass
from enum import IntEnum

from sitl_shim.autopilot.interface import ModeInfo


class Mode(IntEnum):
    """Flight modes, by their custom_mode."""

    MANUAL = 0x00010000
    ALTCTL = 0x00020000
    POSCTL = 0x00030000
    AUTO_TAKEOFF = 0x02040000
    AUTO_LOITER = 0x03040000
    AUTO_MISSION = 0x04040000
    AUTO_RTL = 0x05040000
    AUTO_LAND = 0x06040000
    ACRO = 0x00050000
    OFFBOARD = 0x00060000
    STABILIZED = 0x00070000

    @property
    def is_auto(self) -> bool:
        """Whether the mode flies by itself, without sticks and without a stream."""
        return (self >> 16) & 0xFF == 4

    @property
    def needs_sticks(self) -> bool:
        """Whether the mode is a person's, with sticks; this vehicle has none."""
        return not self.is_auto and self is not Mode.OFFBOARD


@dataclass(frozen=True, slots=True)
class _Wire:
    base_mode: int
    """MAV_MODE_FLAG, without the bit for armed."""
    standard_mode: int
    """MAV_STANDARD_MODE."""
    name: str
    """As PX4's texts call the mode."""
    navigation: int
    """As PX4's events number the mode."""


_WIRE: dict[Mode, _Wire] = {
    Mode.MANUAL: _Wire(0x41, 0, "Manual", 0),
    Mode.ALTCTL: _Wire(0x51, 4, "Altitude", 1),
    Mode.POSCTL: _Wire(0x51, 1, "Position", 2),
    Mode.AUTO_TAKEOFF: _Wire(0x1D, 8, "Takeoff", 10),
    Mode.AUTO_LOITER: _Wire(0x1D, 0, "Hold", 4),
    Mode.AUTO_MISSION: _Wire(0x1D, 6, "Mission", 3),
    Mode.AUTO_RTL: _Wire(0x1D, 5, "Return", 5),
    Mode.AUTO_LAND: _Wire(0x1D, 7, "Land", 11),
    Mode.ACRO: _Wire(0x41, 0, "Acro", 6),
    Mode.OFFBOARD: _Wire(0x01, 0, "Offboard", 7),
    Mode.STABILIZED: _Wire(0x51, 0, "Stabilized", 8),
}

_ARMED = 0x80
_STABILIZE = 0x10


def base_mode(mode: Mode, *, armed: bool, attitude_controlled: bool) -> int:
    """HEARTBEAT's base_mode; in OFFBOARD the stream says whether attitude is controlled."""
    bits = _WIRE[mode].base_mode
    if mode is Mode.OFFBOARD and attitude_controlled:
        bits |= _STABILIZE
    return bits | _ARMED if armed else bits


def standard_mode(mode: Mode) -> int:
    """MAV_STANDARD_MODE of a mode; 0 where it is none of them."""
    return _WIRE[mode].standard_mode


def mode_name(mode: Mode) -> str:
    """The mode's name in texts."""
    return _WIRE[mode].name


def navigation_number(mode: Mode) -> int:
    """The mode as PX4's events number it."""
    return _WIRE[mode].navigation


def mode_of(main: int, sub: int) -> Mode | None:
    """The mode that DO_SET_MODE asks for by main and sub mode; None if it is none of these."""
    try:
        return Mode((sub << 24) | (main << 16))
    except ValueError:
        return None


def mode_named(name: str) -> Mode:
    """The mode of a name: as here (`AUTO_LAND`), without `AUTO_`, or as in texts (`Hold`).

    Raises:
        ValueError: there is none of this name; the text says which there are.
    """
    wanted = name.upper()
    for mode in Mode:
        if wanted in (mode.name, mode.name.removeprefix("AUTO_"), mode_name(mode).upper()):
            return mode
    known = ", ".join(mode.name for mode in Mode)
    raise ValueError(f"there is no mode {name!r} of PX4 here; there are {known}")


_NOT_BY_USER = 1
"""MAV_MODE_PROPERTY_ADVANCED: for those who know it."""

AVAILABLE_MODES: tuple[ModeInfo, ...] = tuple(
    ModeInfo(
        custom_mode=mode.value,
        standard_mode=standard_mode(mode),
        properties=0 if mode in (Mode.ALTCTL, Mode.POSCTL) else _NOT_BY_USER,
        name=mode_name(mode) if standard_mode(mode) == 0 else "",
    )
    for mode in Mode
)
"""What AVAILABLE_MODES lists: a standard mode goes without a name, as PX4 sends it."""
