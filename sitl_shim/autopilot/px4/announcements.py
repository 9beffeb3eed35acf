"""What PX4 says: texts for a person, and events, which are the same for a program.

An event's id is the component's number and the FNV-1a hash of its name; names and arguments are
those of PX4 v1.17, checked against recorded ones.  https://mavlink.io/en/services/events.html
"""

import struct
from collections.abc import Sequence
from enum import IntEnum

from sitl_shim.autopilot.interface import Event, StatusText
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.failsafe import Action, CauseNumber

_AUTOPILOT = 1 << 24
_FNV_BASIS, _FNV_PRIME = 0x811C9DC5, 0x01000193
CRITICAL, ERROR, WARNING, INFO, PROTOCOL = 2, 3, 4, 6, 8
"""Log levels: MAV_SEVERITY, and what is for programs alone."""

LANDING_HERE_ID = 0x0132B2DE
"""Of the event that goes with the land command; its name is not known."""


class ArmReason(IntEnum):
    """PX4's arm_disarm_reason_t."""

    COMMAND = 4
    MISSION_START = 5
    LANDING = 6
    PREFLIGHT_INACTION = 7
    FAILSAFE = 14


REASON_TEXTS = {
    ArmReason.COMMAND: "external command",
    ArmReason.MISSION_START: "mission start",
    ArmReason.LANDING: "landing",
    ArmReason.PREFLIGHT_INACTION: "auto preflight disarming",
    ArmReason.FAILSAFE: "failsafe",
}


_WARNINGS = {
    CauseNumber.BATTERY_LOW: "commander_failsafe_enter_low_bat",
    CauseNumber.BATTERY_CRITICAL: "commander_failsafe_enter_crit_bat_warn",
    CauseNumber.BATTERY_EMERGENCY: "commander_failsafe_enter_crit_low_bat_warn",
}


def event_id(name: str) -> int:
    """The id of one of the autopilot's events."""
    value = _FNV_BASIS
    for byte in name.encode():
        value = ((value ^ byte) * _FNV_PRIME) & 0xFFFFFFFF
    return _AUTOPILOT | (value & 0xFFFFFF)


def make_event(
    name: str, arguments: bytes = b"", *, external: int = INFO, internal: int = INFO
) -> Event:
    """One event.

    Args:
        name: as PX4 names it.
        arguments: packed as its definition says.
        external: log level for others.
        internal: log level for the autopilot's own log.
    """
    return Event(event_id(name), internal << 4 | external, arguments)


def mode_arguments(custom_mode: int, number: int) -> bytes:
    """Arguments of the events about a mode: the mode, and one small number."""
    return struct.pack("<IB", custom_mode, number)


def failsafe_event(
    custom_mode: int,
    action: Action,
    put_off: Action,
    number: CauseNumber,
    parameters: ParameterStore,
) -> Event:
    """The event of a failsafe that begins.

    Args:
        custom_mode: of the intended mode.
        action: what is done.
        put_off: what follows after a hold; NONE: nothing.
        number: of the cause.
        parameters: for the length of the hold.
    """
    caused = number is not CauseNumber.GENERIC
    if put_off is not Action.NONE:
        arguments = struct.pack("<IBH", custom_mode, put_off, round(parameters["COM_FAIL_ACT_T"]))
        name = (
            "commander_failsafe_enter_hold" if caused else "commander_failsafe_enter_generic_hold"
        )
    elif action is Action.WARN:
        arguments = b"" if caused else struct.pack("<I", custom_mode)
        name = _WARNINGS.get(number, "commander_failsafe_enter_generic_warn")
    else:
        arguments = mode_arguments(custom_mode, action)
        name = "commander_failsafe_enter" if caused else "commander_failsafe_enter_generic"
    if caused and action is not Action.WARN:
        arguments += bytes([number])
    return make_event(name, arguments, external=CRITICAL, internal=WARNING)


class Announcer:
    """Texts and events that wait to be sent."""

    __slots__ = ("_events", "_texts")

    def __init__(self) -> None:
        self._texts: list[StatusText] = []
        self._events: list[Event] = []

    def say(self, severity: int, text: str) -> None:
        """Queue a text; PX4 ends most of its texts in a tab."""
        self._texts.append(StatusText(severity, text + "\t"))

    def tell(self, event: Event) -> None:
        """Queue an event."""
        self._events.append(event)

    def take_texts(self) -> Sequence[StatusText]:
        """Texts since the last call."""
        texts = self._texts
        if not texts:
            return ()
        self._texts = []
        return texts

    def take_events(self) -> Sequence[Event]:
        """Events since the last call."""
        events = self._events
        if not events:
            return ()
        self._events = []
        return events
