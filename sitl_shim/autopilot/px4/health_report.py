"""The report of the health and arming checks, as events: which modes can run, and why others not.

Bits and arguments as recorded from PX4 v1.17 without a radio control.
"""

import struct

from sitl_shim.autopilot.interface import Event
from sitl_shim.autopilot.px4.announcements import ERROR, INFO, PROTOCOL, WARNING, make_event

FIRST_US = 2_084_000
"""Boot time of the first report."""
_MODES_BOOTING, _MODES_READY = 0x80012A80, 0x807F3AB0
_MISSION_BIT, _OFFBOARD_BIT = 1 << 3, 1 << 14
_ALL_MODES = 0xFFFFFFFF
_LOCAL_POSITION_MODES, _GLOBAL_POSITION_MODES = 0x007E007C, 0x38
_ERRORS_BOOTING, _ERROR_OFFBOARD = 0x01130000, 0x00100000
_WARNING_RADIO_CONTROL = 0x80
_PRESENT_BOOTING, _PRESENT_READY = 0x38020C02, 0x38021C0A


def health_report(*, ready: bool, stream: bool, mission: bool) -> tuple[Event, ...]:
    """The events of one report.

    Args:
        ready: booting is over.
        stream: offboard setpoints come in.
        mission: there is a mission that can be flown.
    """
    modes = _MODES_READY if ready else _MODES_BOOTING
    modes |= (_OFFBOARD_BIT if stream else 0) | (_MISSION_BIT if mission else 0)
    errors = (0 if stream else _ERROR_OFFBOARD) | (0 if ready else _ERRORS_BOOTING)
    summary = struct.pack("<BIIII", 0, errors, _WARNING_RADIO_CONTROL, modes, modes)
    present = struct.pack("<BI", 0, _PRESENT_READY if ready else _PRESENT_BOOTING)
    events = [_protocol("commander_arming_check_summary", summary)]
    if not ready:
        events += [
            _check("check_modes_local_pos", _LOCAL_POSITION_MODES, 0x11, ERROR),
            _check("check_modes_global_pos", _GLOBAL_POSITION_MODES, 0x18, ERROR),
        ]
    if not mission:
        events.append(_check("check_modes_mission", _MISSION_BIT, 0x14, INFO))
    if not stream:
        events.append(_check("check_modes_offboard_signal", _OFFBOARD_BIT, 0x14, ERROR))
    events.append(_check("check_modes_manual_control", _ALL_MODES, 0x07, WARNING))
    events.append(_protocol("commander_health_summary", present))
    return tuple(events)


def _check(name: str, modes: int, component: int, level: int) -> Event:
    arguments = struct.pack("<IB", modes, component)
    return make_event(name, arguments, external=level, internal=level)


def _protocol(name: str, arguments: bytes) -> Event:
    return make_event(name, arguments, external=PROTOCOL, internal=PROTOCOL)
