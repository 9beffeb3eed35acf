"""Which messages are streamed, and how often each."""

from collections.abc import Sequence

from companion.mavlink.dialect import message_name
from tests.sitl_shim.captures.conversation import Capture, Conversation
from tests.sitl_shim.captures.ids import (
    AVAILABLE_MODES,
    COMMAND_ACK,
    COMMAND_INT,
    COMMAND_LONG,
    COMPONENT_INFORMATION,
    COMPONENT_METADATA,
    EVENT,
    FTP,
    GLOBAL_ORIGIN,
    MESSAGE_INTERVAL,
    MISSION_IDS,
    PARAM_ERROR,
    PARAM_VALUE,
    PROTOCOL_VERSION,
    REQUEST_DATA_STREAM,
    STATUSTEXT,
    VERSION,
)
from tests.sitl_shim.captures.sequences import Comparison

_SET_MESSAGE_INTERVAL = 511
_SHARE, _COUNT = 0.05, 2

_NOT_STREAMS = frozenset(
    {PARAM_VALUE, COMMAND_ACK, FTP, VERSION, MESSAGE_INTERVAL, STATUSTEXT, PARAM_ERROR, EVENT}
    | {PROTOCOL_VERSION, AVAILABLE_MODES, GLOBAL_ORIGIN, COMMAND_LONG, *MISSION_IDS}
    | {COMPONENT_INFORMATION, COMPONENT_METADATA}
)
"""Messages that answer or tell, and so have aspects of their own."""


def message_sets(capture: Capture, ours: Conversation) -> Comparison:
    theirs = {number for number in capture.vehicle.counts if number not in _NOT_STREAMS}
    here = {
        number
        for number in ours.counts
        if number not in _NOT_STREAMS and ours.frames(number)[0].time_s <= ours.ends_s
    }
    found = [f"{message_name(number)} does not come" for number in sorted(theirs - here)]
    found += [
        f"{message_name(number)} comes, the real one has none" for number in sorted(here - theirs)
    ]
    return Comparison(len(theirs), found)


def rates(capture: Capture, ours: Conversation) -> Comparison:
    """How many of each message came between one request for an interval and the next."""
    segments = _segments(capture)
    compared, found = 0, []
    for number in sorted(capture.vehicle.counts.keys() & ours.counts.keys() - _NOT_STREAMS):
        theirs, here = capture.vehicle.counts[number], ours.counts[number]
        for segment in segments:
            real = sum(theirs.get(window, 0) for window in segment)
            shim = sum(here.get(window, 0) for window in segment)
            compared += bool(real)
            if abs(shim - real) > _COUNT + _SHARE * real:
                often = "more" if shim > real else "less"
                percent = round(100.0 * abs(shim - real) / max(real, 1))
                found.append(f"{message_name(number)} comes {percent} % {often} often")
    return Comparison(compared, found)


def _segments(capture: Capture) -> list[Sequence[int]]:
    """The windows that lie wholly between two requests for intervals."""
    vehicle = capture.vehicle
    requested = {
        int(said.time_s / vehicle.window_s)
        for said in capture.clients
        if said.frame.message_id == REQUEST_DATA_STREAM
        or (
            said.frame.message_id in (COMMAND_LONG, COMMAND_INT)
            and said.message.command == _SET_MESSAGE_INTERVAL
        )
    }
    segments: list[list[int]] = [[]]
    for window in vehicle.whole_windows:
        if window in requested:
            segments.append([])
        else:
            segments[-1].append(window)
    return [segment for segment in segments if segment]
