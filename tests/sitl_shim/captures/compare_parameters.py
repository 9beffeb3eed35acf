"""Parameters: the list, the answers to questions, and what is told unasked."""

import math
import struct
from collections.abc import Hashable, Sequence
from typing import Any

from tests.sitl_shim.captures.conversation import Capture, Conversation
from tests.sitl_shim.captures.ids import (
    PARAM_ERROR,
    PARAM_REQUEST_LIST,
    PARAM_REQUEST_READ,
    PARAM_SET,
    PARAM_VALUE,
)
from tests.sitl_shim.captures.sequences import Timed, sequence_differences

_SAID_AGAIN_S = 0.2


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
