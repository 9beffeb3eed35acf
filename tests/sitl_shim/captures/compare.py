"""Where the shim answers other than the real vehicle did, aspect by aspect.

Each aspect is a function of both conversations that gives what differs, as texts.  The texts name
the difference without its noise (no times, no measured digits where those vary), so that a known
difference can be listed by its text.
"""

import re
import struct
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

from tests.sitl_shim.captures.compare_effects import effects
from tests.sitl_shim.captures.compare_parameters import parameters
from tests.sitl_shim.captures.compare_streams import message_sets, rates
from tests.sitl_shim.captures.conversation import Capture, Conversation
from tests.sitl_shim.captures.ids import (
    AVAILABLE_MODES,
    COMMAND_ACK,
    COMPONENT_INFORMATION,
    COMPONENT_METADATA,
    CURRENT_MODE,
    EVENT,
    FTP,
    GLOBAL_ORIGIN,
    HEARTBEAT,
    LANDED,
    MESSAGE_INTERVAL,
    MISSION_IDS,
    PING,
    PROTOCOL_VERSION,
    STATUSTEXT,
    SYS_STATUS,
    TIMESYNC,
    VERSION,
)
from tests.sitl_shim.captures.sequences import Comparison, Timed, changes, sequence_differences

# A heartbeat may show a change a whole period late, here and there.
_HEARTBEAT_S = 1.2
# Climb and descent take as long as vehicle and estimator let them.
_MOTION_S = 2.5
_ACK_S = 0.15
_ARDUPILOT_LAND = 9

Aspect = Callable[[Capture, Conversation], Comparison]


def acknowledgements(capture: Capture, ours: Conversation) -> Comparison:
    def acks(side: Conversation) -> list[Timed]:
        return [
            (time_s, (m.command, m.result, m.target_system, m.target_component))
            for time_s, m in side.messages(COMMAND_ACK)
        ]

    return sequence_differences(
        acks(capture.vehicle),
        acks(ours),
        within_s=_ACK_S,
        ends_s=ours.ends_s,
        says=lambda v: f"ACK {v[1]} to command {v[0]}",
    )


def _heartbeats(side: Conversation) -> list[Timed]:
    return changes(
        (time_s, (m.base_mode, m.custom_mode, m.system_status))
        for time_s, m in side.messages(HEARTBEAT)
    )


def _waits_for_motion(value: tuple[int, int, int]) -> bool:
    """Whether a heartbeat's contents may come of a climb or a descent that is over."""
    base_mode, custom_mode, _ = value
    return base_mode in (0x1D, 0x9D, 0x11, 0xD9) or custom_mode == _ARDUPILOT_LAND


def heartbeats(capture: Capture, ours: Conversation) -> Comparison:
    return sequence_differences(
        _heartbeats(capture.vehicle),
        _heartbeats(ours),
        within_s=lambda v: _HEARTBEAT_S + (_MOTION_S if _waits_for_motion(v) else 0.0),
        ends_s=ours.ends_s,
        says=lambda v: f"HEARTBEAT base {v[0]:#x} custom {v[1]:#x} status {v[2]}",
    )


def current_modes(capture: Capture, ours: Conversation) -> Comparison:
    def modes(side: Conversation) -> list[Timed]:
        return changes(
            (time_s, (m.custom_mode, m.intended_custom_mode))
            for time_s, m in side.messages(CURRENT_MODE)
        )

    theirs = modes(capture.vehicle)
    # Every 2 s a mode that lasted a second is seen or not, by chance.
    return sequence_differences(
        theirs,
        modes(ours),
        within_s=2.2 + _MOTION_S,
        ends_s=ours.ends_s,
        says=lambda v: f"CURRENT_MODE {v[0]:#x} intended {v[1]:#x}",
    )


def landed_states(capture: Capture, ours: Conversation) -> Comparison:
    def states(side: Conversation) -> list[Timed]:
        return changes((time_s, m.landed_state) for time_s, m in side.messages(LANDED))

    return sequence_differences(
        states(capture.vehicle),
        states(ours),
        within_s=_MOTION_S,
        ends_s=ours.ends_s,
        says=lambda value: f"landed_state {value}",
    )


def health(capture: Capture, ours: Conversation) -> Comparison:
    def masks(side: Conversation) -> list[Timed]:
        return changes(
            (
                time_s,
                (
                    m.onboard_control_sensors_present,
                    m.onboard_control_sensors_enabled,
                    m.onboard_control_sensors_health,
                ),
            )
            for time_s, m in side.messages(SYS_STATUS)
        )

    return sequence_differences(
        masks(capture.vehicle),
        masks(ours),
        within_s=2.0,
        ends_s=ours.ends_s,
        says=lambda v: f"SYS_STATUS {v[0]:#x} {v[1]:#x} {v[2]:#x}",
    )


def texts(capture: Capture, ours: Conversation) -> Comparison:
    def said(side: Conversation) -> list[Timed]:
        whole: list[tuple[float, int, str]] = []
        for time_s, m in side.messages(STATUSTEXT):
            if m.chunk_seq and whole:
                whole[-1] = (*whole[-1][:2], whole[-1][2] + m.text)
            else:
                whole.append((time_s, m.severity, m.text))
        return [
            (time_s, (severity, re.sub(r"\d[\d_/.:-]{7,}", "*", text)))
            for time_s, severity, text in whole
        ]

    return sequence_differences(
        said(capture.vehicle),
        said(ours),
        within_s=_MOTION_S + 1.0,
        ends_s=ours.ends_s,
        says=lambda v: f"{v[1].strip()!r} (severity {v[0]})",
    )


def events(capture: Capture, ours: Conversation) -> Comparison:
    """How often each; when the reports of health come depends on how a boot goes."""

    def told(side: Conversation) -> Counter[int]:
        within = [each for each in side.frames(EVENT) if each.time_s <= ours.ends_s]
        return Counter(
            struct.unpack_from("<I", each.frame.payload.ljust(4, b"\0"))[0] for each in within
        )

    theirs, here = told(capture.vehicle), told(ours)
    found = []
    for number in sorted(theirs.keys() | here.keys()):
        real, shim = theirs[number], here[number]
        if real != shim:
            found.append(f"EVENT {number} comes {shim} times, the real one's {real} times")
    return Comparison(sum(theirs.values()), found)


def missions(capture: Capture, ours: Conversation) -> Comparison:
    def said(side: Conversation) -> list[Timed]:
        return [(time_s, _mission(m)) for time_s, m in side.messages(*MISSION_IDS)]

    return sequence_differences(said(capture.vehicle), said(ours), within_s=0.3, ends_s=ours.ends_s)


_NOT_COMPARED = ("mavpackettype", "target_system", "target_component", "opaque_id", "mission_id")


def _mission(message: Any) -> str:
    fields = {key: value for key, value in message.to_dict().items() if key not in _NOT_COMPARED}
    return f"{message.get_type()} {fields}"


def files(capture: Capture, ours: Conversation) -> Comparison:
    def payloads(side: Conversation) -> list[Timed]:
        found = side.messages(FTP)
        return [(time_s, bytes(m.payload).rstrip(b"\0")[:40].hex()) for time_s, m in found]

    return sequence_differences(
        payloads(capture.vehicle),
        payloads(ours),
        within_s=0.3,
        ends_s=ours.ends_s,
        says=lambda v: f"FTP answer {v}",
    )


_VERSION_FIELDS = ("capabilities", "flight_sw_version", "board_version", "vendor_id", "product_id")


_BY_ID_ALONE: Mapping[int, str] = {
    PROTOCOL_VERSION: "PROTOCOL_VERSION",
    COMPONENT_INFORMATION: "COMPONENT_INFORMATION (395)",
    COMPONENT_METADATA: "COMPONENT_METADATA (397)",
}
"""Messages that no dialect of pymavlink decodes."""


def answers(capture: Capture, ours: Conversation) -> Comparison:
    """What came when it was asked for: versions, origin, modes, intervals, PING, TIMESYNC."""

    def said(side: Conversation) -> list[Timed]:
        found: list[Timed] = []
        for time_s, m in side.messages(VERSION):
            found += [(time_s, f"AUTOPILOT_VERSION {f} {getattr(m, f)}") for f in _VERSION_FIELDS]
        for time_s, m in side.messages(MESSAGE_INTERVAL):
            found.append((time_s, f"MESSAGE_INTERVAL {m.message_id} {m.interval_us}"))
        for time_s, m in side.messages(AVAILABLE_MODES):
            what = f"{m.mode_name} {m.custom_mode:#x} standard {m.standard_mode} {m.properties}"
            found.append((time_s, f"mode {what}"))
        for time_s, m in side.messages(GLOBAL_ORIGIN):
            place = (round(m.latitude, -4), round(m.longitude, -4), round(m.altitude, -4))
            found.append((time_s, f"GPS_GLOBAL_ORIGIN {place}"))
        for number, name in _BY_ID_ALONE.items():
            found += [(each.time_s, name) for each in side.frames(number)]
        found += [
            (t, f"PING answered, seq {m.seq}") for t, m in side.messages(PING) if m.target_system
        ]
        found += [(t, "TIMESYNC answered") for t, m in side.messages(TIMESYNC) if m.tc1]
        return sorted(found, key=lambda timed: (round(timed[0], 1), str(timed[1])))

    return sequence_differences(said(capture.vehicle), said(ours), within_s=0.3, ends_s=ours.ends_s)


ASPECTS: Mapping[str, Aspect] = {
    "acknowledgements": acknowledgements,
    "heartbeats": heartbeats,
    "current mode": current_modes,
    "landed state": landed_states,
    "health": health,
    "texts": texts,
    "events": events,
    "parameters": parameters,
    "missions": missions,
    "files": files,
    "answers": answers,
    "messages": message_sets,
    "rates": rates,
    "effects of setpoints": effects,
}


def compare(capture: Capture, ours: Conversation) -> dict[str, Comparison]:
    """What was compared and what differs, by aspect."""
    return {name: aspect(capture, ours) for name, aspect in ASPECTS.items()}
