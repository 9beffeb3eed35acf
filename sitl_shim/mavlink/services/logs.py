"""The log protocol: list, download in pieces of 90 bytes, erase.

https://mavlink.io/en/messages/common.html#LOG_REQUEST_LIST
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.services.flight_logs import FlightLog, FlightLogs
from sitl_shim.mavlink.wire import Message, dialect

_PIECE_BYTES = 90
_PER_TICK = 8
_INFO = 6


@dataclass(slots=True)
class _Download:
    """Pieces that are still to be sent on one link."""

    log: FlightLog
    offset: int
    end: int


class Logs:
    """The log protocol on all links; lets the logs be written, too.

    Args:
        context: of the vehicle.
        logs: what there is.
    """

    def __init__(self, context: Context, logs: FlightLogs) -> None:
        self._context = context
        self._logs = logs
        self._lists: dict[int, Iterator[Message]] = {}
        self._downloads: dict[int, _Download] = {}

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        return {
            "LOG_REQUEST_LIST": self._list,
            "LOG_REQUEST_DATA": self._download,
            "LOG_REQUEST_END": self._end,
            "LOG_ERASE": self._erase,
        }

    def step(self, now_us: int) -> int:
        """Write, and send the next parts; returns when there is more to do."""
        text = self._logs.step(now_us)
        if text is not None:
            for link in range(len(self._context.links)):
                self._context.say(link, _INFO, text)
        for link, entries in list(self._lists.items()):
            batch = list(islice(entries, _PER_TICK))
            self._send(link, batch)
            if len(batch) < _PER_TICK:
                del self._lists[link]
        for link, download in list(self._downloads.items()):
            self._send_pieces(link, download)
        return 0 if self._lists or self._downloads else self._logs.next_us

    def _list(self, link: int, message: Message) -> None:
        if not self._context.concerns(message):
            return
        logs = list(self._logs.logs)
        if not logs:
            self._send(link, [dialect.MAVLink_log_entry_message(0, 0, 0, 0, 0)])
            return
        last = logs[-1].id
        wanted = [log for log in logs if message.start <= log.id <= message.end]
        self._lists[link] = iter(
            [
                dialect.MAVLink_log_entry_message(
                    log.id, len(logs), last, log.time_utc_s, len(log.content)
                )
                for log in wanted
            ]
        )

    def _download(self, link: int, message: Message) -> None:
        if not self._context.concerns(message):
            return
        log = next((each for each in self._logs.logs if each.id == message.id), None)
        if log is None:
            return
        end = min(len(log.content), message.ofs + message.count)
        if message.ofs >= end:  # nothing is there: say so
            nothing = dialect.MAVLink_log_data_message(log.id, message.ofs, 0, bytes(_PIECE_BYTES))
            self._downloads.pop(link, None)
            self._send(link, [nothing])
            return
        self._downloads[link] = _Download(log, message.ofs, end)

    def _send_pieces(self, link: int, download: _Download) -> None:
        for _ in range(_PER_TICK):
            if download.offset >= download.end:
                del self._downloads[link]
                return
            stop = min(download.end, download.offset + _PIECE_BYTES)
            data = download.log.content.read(download.offset, stop)
            piece = dialect.MAVLink_log_data_message(
                download.log.id, download.offset, len(data), data.ljust(_PIECE_BYTES, b"\0")
            )
            self._send(link, [piece])
            download.offset = stop

    def _end(self, link: int, message: Message) -> None:
        if self._context.concerns(message):
            self._lists.pop(link, None)
            self._downloads.pop(link, None)

    def _erase(self, link: int, message: Message) -> None:
        if self._context.concerns(message):
            self._lists.clear()
            self._downloads.clear()
            self._logs.erase()

    def _send(self, link: int, messages: list[Message]) -> None:
        for message in messages:
            self._context.links[link].send(message)
