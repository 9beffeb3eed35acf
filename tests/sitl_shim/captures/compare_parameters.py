"""Parameters: the list, the answers to questions, and what is told unasked."""

import math
import struct
from collections.abc import Hashable, Mapping, Sequence
from typing import Any

from tests.sitl_shim.captures.conversation import Capture, Conversation
from tests.sitl_shim.captures.ids import (
    PARAM_ERROR,
    PARAM_REQUEST_LIST,
    PARAM_REQUEST_READ,
    PARAM_SET,
    PARAM_VALUE,
)
from tests.sitl_shim.captures.sequences import Comparison, Timed, sequence_differences

_SAID_AGAIN_S = 0.2
_ANSWERED_S = 1.0
_LEARNED: Mapping[str, float] = {"MOT_THST_HOVER": 0.005}
"""What the vehicle learns in flight, and how far the shim's may be from the real one's."""


def parameters(capture: Capture, ours: Conversation) -> Comparison:
    asked = [
        (said.time_s, _id(said.message), getattr(said.message, "param_index", -1))
        for said in capture.clients
        if said.frame.message_id in (PARAM_REQUEST_READ, PARAM_SET)
    ]
    begin_s, end_s = _list_time(capture)

    def is_answer(time_s: float, m: Any) -> bool:
        return any(
            0.0 <= time_s - asked_s <= _ANSWERED_S
            and (_id(m) == name or (not name and m.param_index == index))
            for asked_s, name, index in asked
        )

    def told(side: Conversation, *, as_answer: bool) -> list[tuple[float, Any]]:
        return [
            (time_s, m)
            for time_s, m in side.messages(PARAM_VALUE, PARAM_ERROR)
            if not begin_s <= time_s < end_s and is_answer(time_s, m) == as_answer
        ]

    def answers(side: Conversation) -> list[Timed]:
        return [(time_s, _parameter(m)) for time_s, m in told(side, as_answer=True)]

    def unasked(side: Conversation) -> dict[str, Any]:
        return {_id(m): m for t, m in told(side, as_answer=False) if t <= ours.ends_s}

    theirs, here = answers(capture.vehicle), answers(ours)
    again, here_again = (len(side) - len(_once(side)) for side in (theirs, here))
    repeated = []
    if again > here_again:
        repeated.append("a change is told once more a moment later")
    elif again < here_again:
        repeated.append("a change is told once more, which the real one does not do")
    return (
        _listed(capture, ours)
        + _told_unasked(unasked(capture.vehicle), unasked(ours))
        + Comparison(0, repeated)
        + sequence_differences(_once(theirs), _once(here), within_s=0.3, ends_s=ours.ends_s)
        + _learned(capture.vehicle, ours)
    )


def _told_unasked(theirs: Mapping[str, Any], here: Mapping[str, Any]) -> Comparison:
    found = [f"{name} is not told unasked" for name in sorted(theirs.keys() - here.keys())]
    found += [
        f"{name} is told unasked, which the real one does not do"
        for name in sorted(here.keys() - theirs.keys())
    ]
    for name in sorted(theirs.keys() & here.keys()):
        if _parameter(theirs[name]) != _parameter(here[name]):
            found.append(f"{name} is told unasked with another value")
    return Comparison(len(theirs), found)


def _learned(theirs: Conversation, ours: Conversation) -> Comparison:
    """The n-th time that a learned value is told, both tell about the same."""

    def values(side: Conversation, name: str) -> list[float]:
        told = [m.param_value for _, m in side.messages(PARAM_VALUE) if _id(m) == name]
        # Each once: an answer may be sent twice.
        return list(dict.fromkeys(told))

    found = []
    for name, tolerance in _LEARNED.items():
        for real, shim in zip(values(theirs, name), values(ours, name), strict=False):
            if abs(real - shim) > tolerance:
                found.append(f"{name} is learned as {shim:.3f}, not {real:.3f}")
    return Comparison(0, found)


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


def _listed(capture: Capture, ours: Conversation) -> Comparison:
    begin_s, end_s = _list_time(capture)

    def values(side: Conversation) -> dict[str, Any]:
        return {_id(m): m for t, m in side.messages(PARAM_VALUE) if begin_s <= t < end_s}

    theirs, here = values(capture.vehicle), values(ours)
    if not theirs:
        return Comparison(0, [])
    if not here:
        return Comparison(len(theirs), ["no list comes"])
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
    return Comparison(len(theirs), found)


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
    if name == "_HASH_CHECK" or name in _LEARNED:
        return f"PARAM_VALUE of {name}, type {message.param_type}"
    value = struct.pack("<f", message.param_value).hex()
    return f"PARAM_VALUE of {name}, type {message.param_type}, bytes {value}"
