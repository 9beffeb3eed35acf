"""The command protocol: every command is acknowledged, by the link or by the autopilot.

https://mavlink.io/en/services/command.html
"""

import math
from collections.abc import Iterator

from sitl_shim.autopilot.interface import Command, StatusText
from sitl_shim.mavlink import messages_status as status
from sitl_shim.mavlink.geodesy import local_position
from sitl_shim.mavlink.link import Link
from sitl_shim.mavlink.personality import Personality
from sitl_shim.mavlink.statustext import status_messages
from sitl_shim.mavlink.streams import AVAILABLE_MODES_ID, TRUTH_BUILDERS, StreamSet
from sitl_shim.mavlink.wire import Message, dialect
from sitl_shim.simulation import GlobalOrigin, Simulation

ACCEPTED, DENIED, UNSUPPORTED, FAILED = 0, 2, 3, 4
_INFO = 6
_GET_INTERVAL, _SET_INTERVAL, _REQUEST_MESSAGE = 510, 511, 512
_REQUEST_PROTOCOL, _REQUEST_CAPABILITIES = 519, 520
_LOCAL_FRAMES, _RELATIVE_FRAMES = (1, 7, 8, 9, 12, 20, 21), (3, 6)
_UNSET = 2**31 - 1
"""A latitude or longitude that says nothing."""
_STOP, _RESTORE = -1, 0
_VERSION_ID: int = dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION
_PROTOCOL_ID = 300
_LONGEST_US = 2**31 - 1
"""What MESSAGE_INTERVAL can say."""
_NEVER_US = 1e12
"""PX4 turns intervals into rates, and takes a rate of 1e-6 Hz or less for none."""
_ZERO_US = 1e-5
"""PX4 takes what is no more than this for 0."""


def command_of(message: Message, origin: GlobalOrigin) -> Command:
    """The command that a COMMAND_LONG or COMMAND_INT carries.

    Args:
        message: one of the two.
        origin: of the local frame, to which places are brought.
    """
    above_home = False
    if message.get_type() == "COMMAND_LONG":
        last = (message.param5, message.param6, message.param7)
    else:
        scale = 1.0 if message.frame in _LOCAL_FRAMES else 1e-7
        x, y = (math.nan if value == _UNSET else value * scale for value in (message.x, message.y))
        last = (x, y, message.z)
        above_home = message.frame in _RELATIVE_FRAMES
    first = (message.param1, message.param2, message.param3, message.param4)
    latitude, longitude, altitude = last
    known = abs(latitude) <= 90.0 and abs(longitude) <= 180.0
    return Command(
        message.command,
        (*first, *last),
        local_position(origin, latitude, longitude) if known else None,
        altitude if above_home else altitude - origin.altitude_amsl_m,
        above_home,
    )


def acknowledgement(request: Message, result: int) -> Message:
    """COMMAND_ACK to whoever sent ``request``."""
    return dialect.MAVLink_command_ack_message(
        request.command, result, 0, 0, request.get_srcSystem(), request.get_srcComponent()
    )


def handle_link_command(
    command: Command, link: Link, sim: Simulation
) -> tuple[list[Message], int] | None:
    """Commands about messages, which concern only the link that they came by.

    Returns:
        What to send beside the acknowledgement, and its result; None if the command is not one
        of these.
    """
    streams, personality = link.streams, link.personality
    kind, wanted = command.command, _whole(command.parameters[0])
    if kind == _SET_INTERVAL:
        return _set_interval(wanted, command.parameters[1], link, sim)
    if kind == _GET_INTERVAL:
        interval = streams.interval_us(wanted)
        if interval is None:
            return [dialect.MAVLink_message_interval_message(wanted & 0xFFFF, 0)], ACCEPTED
        return [dialect.MAVLink_message_interval_message(wanted, interval)], ACCEPTED
    if kind == _REQUEST_MESSAGE:
        return _request(wanted, _whole(command.parameters[1]), personality, sim)
    if kind == _REQUEST_CAPABILITIES and wanted == 1:
        return _request(_VERSION_ID, 0, personality, sim)
    if kind == _REQUEST_PROTOCOL and wanted == 1 and _PROTOCOL_ID in personality.requestable:
        return [status.protocol_version(sim)], ACCEPTED
    return None


def handle_truth_command(
    command: Command, streams: StreamSet, sim: Simulation
) -> tuple[list[Message], int]:
    """Commands to the component that sends the truth: its rates, nothing else."""
    wanted = _whole(command.parameters[0])
    if command.command == _SET_INTERVAL:
        interval_us = _interval_us(command.parameters[1])
        known = streams.set_interval(wanted, interval_us, sim.time_us)
        return [], ACCEPTED if known else FAILED
    if command.command == _REQUEST_MESSAGE:
        builder = TRUTH_BUILDERS.get(wanted)
        message = builder(sim) if builder else None
        return ([], DENIED) if message is None else ([message], ACCEPTED)
    return [], UNSUPPORTED


def _set_interval(
    wanted: int, asked_us: float, link: Link, sim: Simulation
) -> tuple[list[Message], int]:
    personality = link.personality
    interval_us = _interval_us(asked_us)
    if interval_us > 0:
        step_us = personality.interval_step_us
        interval_us = interval_us // step_us * step_us
        if interval_us < personality.shortest_interval_us:
            return [], DENIED
    if link.streams.set_interval(wanted, interval_us, sim.time_us):
        return [], ACCEPTED
    texts: list[Message] = []
    if personality.says_unknown_message:
        text = StatusText(_INFO, f"No ap_message for mavlink id ({wanted})")
        texts = list(status_messages(text, 0))
    return texts, personality.unknown_interval_result


def _request(
    wanted: int, index: int, personality: Personality, sim: Simulation
) -> tuple[list[Message], int]:
    if wanted == AVAILABLE_MODES_ID:
        rows = list(_mode_rows(index, sim))
        return rows, ACCEPTED if rows else DENIED
    builder = personality.requestable.get(wanted)
    if builder is None:
        return [], personality.unknown_request_result
    message = builder(sim)
    # Something that exists but has nothing to say yet is acknowledged all the same.
    return ([] if message is None else [message]), ACCEPTED


def _mode_rows(index: int, sim: Simulation) -> Iterator[Message]:
    """Row ``index`` from 1 on; all of them for 0 (and for NaN)."""
    indices = [index] if index > 0 else range(1, len(sim.autopilot.available_modes) + 1)
    for row in indices:
        message = status.available_modes(sim, row)
        if message is not None:
            yield message


def _whole(value: float) -> int:
    """A parameter that means a whole number; what is none counts as 0."""
    return int(value) if math.isfinite(value) else 0


def _interval_us(value: float) -> int:
    """An interval asked for, as PX4 understands it: what is no number restores the default."""
    if math.isnan(value) or abs(value) <= _ZERO_US:
        return _RESTORE
    if value < 0.0 or value >= _NEVER_US:
        return _STOP
    return max(1, int(min(value, _LONGEST_US)))
