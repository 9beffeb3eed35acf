"""Where the shim answers other than the real vehicle did, aspect by aspect.

Each aspect is a function of both conversations that gives what differs, as texts.  The texts name
the difference without its noise (no times, no measured digits where those vary), so that a known
difference can be listed by its text.
"""

import difflib
import math
import re
import struct
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import Any

from companion.mavlink.dialect import message_name
from tests.sitl_shim.captures.conversation import Capture, Conversation

HEARTBEAT, SYS_STATUS, PING, PARAM_VALUE, COMMAND_ACK = 0, 1, 4, 22, 77
FTP, TIMESYNC, VERSION, MESSAGE_INTERVAL, LANDED = 110, 111, 148, 244, 245
ATTITUDE_QUATERNION, POSITION, ATTITUDE_TARGET, SET_ATTITUDE_TARGET = 31, 32, 83, 82
GLOBAL_ORIGIN, STATUSTEXT, PARAM_ERROR, PROTOCOL_VERSION, EVENT = 49, 253, 345, 300, 410
AVAILABLE_MODES, CURRENT_MODE = 435, 436
COMMAND_LONG, _DO_SET_MODE = 76, 176
MISSION_IDS = (39, 40, 44, 45, 47, 51, 73)
PARAM_REQUEST_READ, PARAM_REQUEST_LIST, PARAM_SET = 20, 21, 23

# A heartbeat may show a change a whole period late, here and there.
_HEARTBEAT_S = 1.2
# Climb and descent take as long as vehicle and estimator let them.
_MOTION_S = 2.5
_ACK_S = 0.15
_ARDUPILOT_LAND = 9
_SAID_AGAIN_S = 0.2
_RATE_SHARE, _RATE_COUNT = 0.2, 4

_NOT_STREAMS = frozenset(
    {PARAM_VALUE, COMMAND_ACK, FTP, VERSION, MESSAGE_INTERVAL, STATUSTEXT, PARAM_ERROR, EVENT}
    | {PROTOCOL_VERSION, AVAILABLE_MODES, GLOBAL_ORIGIN, 76, 395, 397, *MISSION_IDS}
)
"""Messages that answer or tell, and so have aspects of their own."""

Timed = tuple[float, Hashable]
Aspect = Callable[[Capture, Conversation], list[str]]


def name_of(message_id: int) -> str:
    return message_name(message_id)


# --- sequences ---


def changes(timed: Iterable[Timed]) -> list[Timed]:
    """Each value when it first comes after another one."""
    found: list[Timed] = []
    for time_s, value in timed:
        if not found or found[-1][1] != value:
            found.append((time_s, value))
    return found


def sequence_differences(
    theirs: Sequence[Timed],
    ours: Sequence[Timed],
    *,
    within_s: float | Callable[[Any], float],
    ends_s: float,
    says: Callable[[Any], str] = str,
) -> list[str]:
    """What one sequence has and the other has not, and what came at another time.

    What the shim says at the end of the recording, where the real one may not have come to it
    yet, counts only where the real one said it, too.
    """

    def limit_s(value: Hashable) -> float:
        return within_s if isinstance(within_s, float) else within_s(value)

    their_values, our_values = [v for _, v in theirs], [v for _, v in ours]
    matcher = difflib.SequenceMatcher(None, their_values, our_values, autojunk=False)
    found = []
    for tag, i1, i2, j1, j2 in matcher.get_opcodes():
        if tag == "equal":
            for (their_s, value), (our_s, _) in zip(theirs[i1:i2], ours[j1:j2], strict=True):
                if abs(our_s - their_s) > limit_s(value):
                    late = "later" if our_s > their_s else "earlier"
                    found.append(f"{says(value)} comes {late}")
        else:
            found += [f"{says(value)} does not come" for value in their_values[i1:i2]]
            found += [
                f"{says(value)} comes, the real one has none"
                for time_s, value in ours[j1:j2]
                if time_s <= ends_s - limit_s(value)
            ]
    return found


# --- aspects ---


def acknowledgements(capture: Capture, ours: Conversation) -> list[str]:
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


def heartbeats(capture: Capture, ours: Conversation) -> list[str]:
    return sequence_differences(
        _heartbeats(capture.vehicle),
        _heartbeats(ours),
        within_s=lambda v: _HEARTBEAT_S + (_MOTION_S if _waits_for_motion(v) else 0.0),
        ends_s=ours.ends_s,
        says=lambda v: f"HEARTBEAT base {v[0]:#x} custom {v[1]:#x} status {v[2]}",
    )


def current_modes(capture: Capture, ours: Conversation) -> list[str]:
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


def landed_states(capture: Capture, ours: Conversation) -> list[str]:
    def states(side: Conversation) -> list[Timed]:
        return changes((time_s, m.landed_state) for time_s, m in side.messages(LANDED))

    return sequence_differences(
        states(capture.vehicle),
        states(ours),
        within_s=_MOTION_S,
        ends_s=ours.ends_s,
        says=lambda value: f"landed_state {value}",
    )


def health(capture: Capture, ours: Conversation) -> list[str]:
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


def texts(capture: Capture, ours: Conversation) -> list[str]:
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


def events(capture: Capture, ours: Conversation) -> list[str]:
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
            often = (
                "comes more often" if shim > real else "comes less often" if shim else "is missing"
            )
            found.append(f"EVENT {number} {often}")
    return found


def parameters(capture: Capture, ours: Conversation) -> list[str]:
    found = _listed(capture, ours)
    asked: dict[str, float] = {}
    for said in capture.clients:
        if said.frame.message_id in (PARAM_REQUEST_READ, PARAM_SET):
            asked.setdefault(_id(said.message), said.time_s)

    def told(side: Conversation, *, as_answer: bool) -> list[tuple[float, Any]]:
        begin_s, end_s = _list_time(capture)
        return [
            (time_s, m)
            for time_s, m in side.messages(PARAM_VALUE, PARAM_ERROR)
            if not begin_s <= time_s < end_s
            and (asked.get(_id(m), math.inf) <= time_s) == as_answer
        ]

    def unasked(side: Conversation) -> set[str]:
        return {_id(m) for _, m in told(side, as_answer=False)}

    if "" not in asked and unasked(capture.vehicle) != unasked(ours):
        found.append("other parameters are told unasked")

    def answers(side: Conversation) -> list[Timed]:
        return [(time_s, _parameter(m)) for time_s, m in told(side, as_answer=True)]

    theirs, here = answers(capture.vehicle), answers(ours)
    again, here_again = (len(side) - len(_once(side)) for side in (theirs, here))
    if again > here_again:
        found.append("a change is told once more a moment later")
    elif again < here_again:
        found.append("a change is told once more, which the real one does not do")
    return found + sequence_differences(
        _once(theirs), _once(here), within_s=0.3, ends_s=ours.ends_s
    )


def _once(timed: Sequence[Timed]) -> list[Timed]:
    """Without what was said just before already."""
    last: dict[Hashable, float] = {}
    found = []
    for time_s, value in timed:
        if time_s - last.get(value, -math.inf) > _SAID_AGAIN_S:
            found.append((time_s, value))
        last[value] = time_s
    return found


def _list_time(capture: Capture) -> tuple[float, float]:
    asked = [s.time_s for s in capture.clients if s.frame.message_id == PARAM_REQUEST_LIST]
    return (asked[0], asked[0] + 1.4) if asked else (math.inf, math.inf)


def _listed(capture: Capture, ours: Conversation) -> list[str]:
    begin_s, end_s = _list_time(capture)

    def values(side: Conversation) -> dict[str, Any]:
        return {_id(m): m for t, m in side.messages(PARAM_VALUE) if begin_s <= t < end_s}

    theirs, here = values(capture.vehicle), values(ours)
    if not theirs:
        return []
    if not here:
        return ["no list comes"]
    found = ["the list has fewer parameters"] if theirs.keys() - here.keys() else []
    found += [
        f"{name} is listed, the real one has none" for name in sorted(here.keys() - theirs.keys())
    ]
    for name in sorted(theirs.keys() & here.keys()):
        if theirs[name].param_type != here[name].param_type:
            found.append(f"{name} has another type")
        elif name != "_HASH_CHECK" and not _same(theirs[name].param_value, here[name].param_value):
            found.append(f"{name} has another value")
    if next(iter(here)) != next(iter(theirs)):
        found.append("the list begins with another parameter")
    if [name for name in here if name in theirs] != [name for name in theirs if name in here]:
        found.append("the list has another order")
    return found


def _id(message: Any) -> str:
    name = message.param_id
    return str(name).rstrip("\0")


def _same(theirs: float, ours: float) -> bool:
    return struct.pack("<f", theirs) == struct.pack("<f", ours) or math.isclose(
        theirs, ours, rel_tol=1e-5
    )


def _parameter(message: Any) -> str:
    name = _id(message)
    if message.get_type() == "PARAM_ERROR":
        return f"PARAM_ERROR {message.error} for {name}"
    if name == "_HASH_CHECK":
        return f"PARAM_VALUE of {name}, type {message.param_type}"
    value = struct.pack("<f", message.param_value).hex()
    return f"PARAM_VALUE of {name}, type {message.param_type}, bytes {value}"


def missions(capture: Capture, ours: Conversation) -> list[str]:
    def said(side: Conversation) -> list[Timed]:
        return [(time_s, _mission(m)) for time_s, m in side.messages(*MISSION_IDS)]

    return sequence_differences(said(capture.vehicle), said(ours), within_s=0.3, ends_s=ours.ends_s)


_NOT_COMPARED = ("mavpackettype", "target_system", "target_component", "opaque_id", "mission_id")


def _mission(message: Any) -> str:
    fields = {key: value for key, value in message.to_dict().items() if key not in _NOT_COMPARED}
    return f"{message.get_type()} {fields}"


def files(capture: Capture, ours: Conversation) -> list[str]:
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


def answers(capture: Capture, ours: Conversation) -> list[str]:
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
        found += [(each.time_s, "PROTOCOL_VERSION") for each in side.frames(PROTOCOL_VERSION)]
        found += [(each.time_s, "COMPONENT_INFORMATION (395)") for each in side.frames(395)]
        found += [(each.time_s, "COMPONENT_METADATA (397)") for each in side.frames(397)]
        found += [
            (t, f"PING answered, seq {m.seq}") for t, m in side.messages(PING) if m.target_system
        ]
        found += [(t, "TIMESYNC answered") for t, m in side.messages(TIMESYNC) if m.tc1]
        return sorted(found, key=lambda timed: (round(timed[0], 1), str(timed[1])))

    return sequence_differences(said(capture.vehicle), said(ours), within_s=0.3, ends_s=ours.ends_s)


def message_sets(capture: Capture, ours: Conversation) -> list[str]:
    theirs = {number for number in capture.vehicle.counts if number not in _NOT_STREAMS}
    here = {
        number
        for number in ours.counts
        if number not in _NOT_STREAMS and ours.frames(number)[0].time_s <= ours.ends_s
    }
    return [f"{name_of(number)} does not come" for number in sorted(theirs - here)] + [
        f"{name_of(number)} comes, the real one has none" for number in sorted(here - theirs)
    ]


def rates(capture: Capture, ours: Conversation) -> list[str]:
    """Messages whose count differs by a fifth in more than a third of the windows."""
    windows = capture.vehicle.whole_windows
    found = []
    for number in sorted(capture.vehicle.counts.keys() & ours.counts.keys() - _NOT_STREAMS):
        theirs, here = capture.vehicle.counts[number], ours.counts[number]
        off = Counter[str]()
        for window in windows:
            real, shim = theirs.get(window, 0), here.get(window, 0)
            if abs(real - shim) > max(_RATE_COUNT, _RATE_SHARE * real):
                off["faster" if shim > real else "slower"] += 1
        if sum(off.values()) * 3 > len(windows):
            found.append(f"{name_of(number)} comes {max(off, key=lambda key: off[key])}")
    return found


def effects(capture: Capture, ours: Conversation) -> list[str]:
    """What each run of setpoints does: its echo, tilt, turn and climb at the end of the run."""
    found = []
    for _, end_s, setpoint in _runs(capture):
        mask, thrust = setpoint[0], setpoint[-1]
        label = f"mask {mask}, thrust {thrust:g}, {setpoint[1]}"
        real, shim = (_state_at(side, end_s) for side in (capture.vehicle, ours))
        if real is None or shim is None or not _follows(capture, end_s):
            continue
        for what, limit in _EFFECTS.items():
            if abs(real[what] - shim[what]) > limit:
                found.append(f"{label}: {what} differs")
    return found


_FOLLOWING = (0x00060000, 4)
"""PX4's OFFBOARD, ArduPilot's GUIDED."""
_EFFECTS: Mapping[str, float] = {
    "thrust echoed": 0.06,
    "tilt, °": 3.0,
    "tilt echoed, °": 3.0,
    "yaw rate echoed, rad/s": 0.15,
    "climb, m/s": 0.7,
}


def _follows(capture: Capture, time_s: float) -> bool:
    """Whether the real vehicle was in a mode that follows setpoints."""
    heard = [m for t, m in capture.vehicle.messages(HEARTBEAT) if t < time_s]
    return bool(heard) and heard[-1].custom_mode in _FOLLOWING


def _runs(capture: Capture) -> list[tuple[float, float, tuple[Any, ...]]]:
    """(begin, end, setpoint) of setpoints that stayed the same for a second."""
    runs: list[list[Any]] = []
    for said in capture.clients:
        if said.frame.message_id == COMMAND_LONG and said.message.command == _DO_SET_MODE and runs:
            # Another mode, another effect: a run ends with it.
            runs.append([said.time_s, said.time_s, None])
        if said.frame.message_id != SET_ATTITUDE_TARGET:
            continue
        m = said.message
        rates = tuple(round(r, 2) for r in (m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate))
        tilt = round(math.degrees(_tilt(m.q)) / 2.0) * 2
        key = (m.type_mask, f"tilt {tilt}°, rates {rates}", round(m.thrust, 2))
        if not runs or runs[-1][2] != key or said.time_s - runs[-1][1] > 0.5:
            runs.append([said.time_s, said.time_s, key])
        runs[-1][1] = said.time_s
    return [(begin, end, key) for begin, end, key in runs if key and end - begin > 1.0]


def _state_at(side: Conversation, time_s: float) -> dict[str, float] | None:
    def last(number: int) -> Any:
        before = [s for s in side.frames(number) if time_s - 0.5 <= s.time_s <= time_s - 0.05]
        return before[-1].message if before else None

    attitude, position, target = last(ATTITUDE_QUATERNION), last(POSITION), last(ATTITUDE_TARGET)
    if attitude is None or position is None or target is None:
        return None
    return {
        "thrust echoed": target.thrust,
        "tilt, °": math.degrees(_tilt((attitude.q1, attitude.q2, attitude.q3, attitude.q4))),
        "tilt echoed, °": math.degrees(_tilt(target.q)),
        "yaw rate echoed, rad/s": target.body_yaw_rate,
        "climb, m/s": -position.vz,
    }


def _tilt(q: Sequence[float]) -> float:
    norm = math.fsum(c * c for c in q)
    if not norm > 0.0:
        return 0.0
    return math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2]) / norm)))


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


def differences(capture: Capture, ours: Conversation) -> dict[str, list[str]]:
    """What differs, by aspect, each text once."""
    return {name: list(dict.fromkeys(aspect(capture, ours))) for name, aspect in ASPECTS.items()}
