"""MAVLink FTP: directories are listed and files read; nothing can be written.

A client that tries files first (MAVProxy its parameters, QGroundControl its metadata) falls back
at once when it is told that there are none, and after many seconds when it is told nothing.
https://mavlink.io/en/services/ftp.html
"""

import struct
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from sitl_shim.mavlink.services.context import NEVER_US, Context
from sitl_shim.mavlink.services.file_tree import FileTree
from sitl_shim.mavlink.wire import Message, dialect

_HEADER = struct.Struct("<HBBBBBxI")
"""Sequence number, session, opcode, size, requested opcode, burst complete, offset."""
_PAYLOAD_BYTES = 251
_DATA_BYTES = _PAYLOAD_BYTES - _HEADER.size
_NONE, _TERMINATE, _RESET, _LIST, _OPEN, _READ = 0, 1, 2, 3, 4, 5
_CRC, _BURST = 14, 15
_WRITING = frozenset({6, 7, 8, 9, 10, 11, 12, 13})
"""Create, write, remove, make and remove a directory, open to write, truncate, rename."""
_ACK, _NAK = 128, 129
_INVALID_SIZE, _INVALID_SESSION, _NO_SESSIONS, _EOF = 3, 4, 5, 6
_UNKNOWN_COMMAND, _PROTECTED, _NOT_FOUND = 7, 9, 10
_MOST_SESSIONS = 4
_IDLE_US = 10_000_000
"""A file nobody has read for so long is closed: its client went away."""
_BURST_PER_TICK = 4
_BURST_LENGTH = 100
"""Packets of one burst."""


class _Request(NamedTuple):
    sequence: int
    session: int
    opcode: int
    size: int
    offset: int
    data: bytes
    partner: tuple[int, int]


class _RefusalError(Exception):
    """A request is refused, for this reason."""

    def __init__(self, reason: int) -> None:
        super().__init__(reason)
        self.reason = reason


@dataclass(slots=True)
class _Burst:
    """A burst that is being sent."""

    request: _Request
    sequence: int
    offset: int
    left: int


@dataclass(slots=True)
class _OpenFile:
    """A file with its contents as they were when it was opened."""

    content: bytes
    used_us: int


@dataclass(slots=True)
class _Desk:
    """State of one link."""

    sessions: dict[int, _OpenFile] = field(default_factory=dict)
    answered: _Request | None = None
    answer: bytes = b""
    burst: _Burst | None = None


class Files:
    """FTP on all links.

    Args:
        context: of the vehicle.
        tree: what there is.
    """

    def __init__(self, context: Context, tree: FileTree) -> None:
        self._context = context
        self._tree = tree
        self._desks = [_Desk() for _ in context.links]

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        return {"FILE_TRANSFER_PROTOCOL": self._receive}

    def step(self, now_us: int) -> int:
        """Send the next part of the bursts, and close what is no longer read.

        Returns:
            When there is more to do: at the next tick while a file is open.
        """
        wake_us = NEVER_US
        for link, desk in enumerate(self._desks):
            if desk.burst is None and not desk.sessions:
                continue
            wake_us = 0
            if desk.burst is not None:
                self._note_use(desk, desk.burst.request)
            if desk.sessions:
                for session, file in list(desk.sessions.items()):
                    if now_us - file.used_us > _IDLE_US:
                        del desk.sessions[session]
            for _ in range(_BURST_PER_TICK):
                if desk.burst is not None:
                    self._send_burst(link, desk, desk.burst)
        return wake_us

    def _receive(self, link: int, message: Message) -> None:
        if not self._context.concerns(message):
            return
        request = _read(message)
        desk = self._desks[link]
        if request == desk.answered:  # the answer was lost
            self._send(link, request.partner, desk.answer)
            return
        desk.burst = None
        self._note_use(desk, request)
        try:
            answer = self._answer(desk, request)
        except _RefusalError as nak:
            answer = _refusal(request, nak.reason)
        if answer is not None:
            desk.answered, desk.answer = request, answer
            self._send(link, request.partner, answer)

    def _note_use(self, desk: _Desk, request: _Request) -> None:
        file = desk.sessions.get(request.session)
        if file is not None:
            file.used_us = self._context.sim.time_us

    def _answer(self, desk: _Desk, request: _Request) -> bytes | None:
        """The reply; None where a burst follows instead.

        Raises:
            _RefusalError: the request is refused.
        """
        opcode = request.opcode
        if opcode == _NONE:
            return _reply(request, b"")
        if opcode == _RESET:
            desk.sessions.clear()
            return _reply(request, b"")
        if opcode == _TERMINATE:
            if desk.sessions.pop(request.session, None) is None:
                raise _RefusalError(_INVALID_SESSION)
            return _reply(request, b"")
        if opcode == _LIST:
            return _reply(request, self._entries(request))
        if opcode == _OPEN:
            return self._open(desk, request)
        if opcode == _CRC:
            return _reply(request, struct.pack("<I", zlib.crc32(self._content(request))))
        if opcode == _READ:
            return _reply(request, _piece(desk, request, request.offset))
        if opcode == _BURST:
            _piece(desk, request, request.offset)  # refuses what cannot be read
            desk.burst = _Burst(
                request, (request.sequence + 1) & 0xFFFF, request.offset, _BURST_LENGTH
            )
            return None
        raise _RefusalError(_PROTECTED if opcode in _WRITING else _UNKNOWN_COMMAND)

    def _content(self, request: _Request) -> bytes:
        content = self._tree.read(_path(request))
        if content is None:
            raise _RefusalError(_NOT_FOUND)
        return content

    def _open(self, desk: _Desk, request: _Request) -> bytes:
        content = self._content(request)
        free = (n for n in range(_MOST_SESSIONS) if n not in desk.sessions)
        session = next(free, None)
        if self._context.personality.client_numbers_files:
            desk.sessions.pop(request.session, None)  # opened anew
            session = request.session if len(desk.sessions) < _MOST_SESSIONS else None
        if session is None:
            raise _RefusalError(_NO_SESSIONS)
        desk.sessions[session] = _OpenFile(content, self._context.sim.time_us)
        return _reply(request, struct.pack("<I", len(content)), session=session)

    def _entries(self, request: _Request) -> bytes:
        entries = self._tree.list(_path(request))
        if entries is None:
            raise _RefusalError(_NOT_FOUND)
        data = b""
        for entry in entries[request.offset :]:
            encoded = entry.encode() + b"\0"
            if len(data) + len(encoded) > _DATA_BYTES:
                break
            data += encoded
        if not data:
            raise _RefusalError(_EOF)
        return data

    def _send_burst(self, link: int, desk: _Desk, burst: _Burst) -> None:
        request = burst.request
        try:
            data = _piece(desk, request, burst.offset)
        except _RefusalError as nak:
            desk.burst = None
            reply = _packet(request, _NAK, bytes([nak.reason]), burst.sequence, burst.offset, 0)
        else:
            burst.left -= 1
            complete = burst.left == 0
            reply = _packet(request, _ACK, data, burst.sequence, burst.offset, int(complete))
            burst.offset += len(data)
            burst.sequence = (burst.sequence + 1) & 0xFFFF
            if complete:
                desk.burst = None
        self._send(link, request.partner, reply)

    def _send(self, link: int, partner: tuple[int, int], payload: bytes) -> None:
        message = dialect.MAVLink_file_transfer_protocol_message(0, *partner, payload)
        self._context.links[link].send(message)


def _read(message: Message) -> _Request:
    payload = bytes(message.payload)
    sequence, session, opcode, size, _, _, offset = _HEADER.unpack_from(payload)
    data = payload[_HEADER.size :][:size]
    partner = (message.get_srcSystem(), message.get_srcComponent())
    return _Request(sequence, session, opcode, size, offset, data, partner)


def _path(request: _Request) -> str:
    return request.data.partition(b"\0")[0].decode("ascii", "replace")


def _piece(desk: _Desk, request: _Request, offset: int) -> bytes:
    """What stands at an offset of an open file.

    Raises:
        _RefusalError: no such session, nothing asked for, or the end of the file.
    """
    file = desk.sessions.get(request.session)
    if file is None:
        raise _RefusalError(_INVALID_SESSION)
    size = min(request.size, _DATA_BYTES)
    if size == 0:
        raise _RefusalError(_INVALID_SIZE)
    data = file.content[offset : offset + size]
    if not data:
        raise _RefusalError(_EOF)
    return data


def _reply(request: _Request, data: bytes, *, session: int | None = None) -> bytes:
    sequence = (request.sequence + 1) & 0xFFFF
    return _packet(request, _ACK, data, sequence, request.offset, 0, session=session)


def _refusal(request: _Request, reason: int) -> bytes:
    sequence = (request.sequence + 1) & 0xFFFF
    return _packet(request, _NAK, bytes([reason]), sequence, request.offset, 0)


def _packet(
    request: _Request,
    kind: int,
    data: bytes,
    sequence: int,
    offset: int,
    complete: int,
    *,
    session: int | None = None,
) -> bytes:
    session = request.session if session is None else session
    head = _HEADER.pack(sequence, session, kind, len(data), request.opcode, complete, offset)
    return (head + data).ljust(_PAYLOAD_BYTES, b"\0")
