"""MAVLink over a serial port, opened again whenever the device is gone.

pyserial opens the port and sets it up; reading and writing is the event loop's, since pyserial's
own writing spins while the system's buffer is full, and with it everything else would stand.
"""

import asyncio
import contextlib
import errno
import fcntl
import os
import termios

import serial  # type: ignore[import-untyped]

from companion.link.link import LinkCounters, LinkError, OnBytes, OnChange
from companion.link.reconnection import BLOCKED_AFTER_S, Backoff
from companion.link.stream_writer import Congestion, waiting_in_system
from companion.link.tcp_stream import why
from companion.link.url import LinkUrl

_READ_BYTES = 4096
_READS_AT_ONCE = 16
"""An adapter's driver holds up to 64 kB: none of it may wait behind the loop's other work."""
_BITS_PER_BYTE = 10
_MOST_WAITING_S = 0.1
"""Of the line's time: what waits longer is stale."""
_SMALLEST_LIMIT = 560
"""Bytes: two of the largest packets."""
_WATCH_S = 0.25


class SerialLink:
    """A serial port that is ours alone."""

    def __init__(self, url: LinkUrl) -> None:
        """Prepare a link; nothing is opened yet."""
        self.url = url
        self.counters = LinkCounters()
        self.on_bytes: OnBytes | None = None
        self.on_change: OnChange | None = None
        self.down_because = "not opened yet"
        self.datagrams = False
        self.speaks_first = True  # a USB port of PX4 waits for heartbeats before it talks MAVLink
        bytes_per_s = url.port / _BITS_PER_BYTE
        self._congestion = Congestion(max(_SMALLEST_LIMIT, round(bytes_per_s * _MOST_WAITING_S)))
        self._port: serial.Serial | None = None
        self._descriptor = -1
        self._rest = b""
        """What is left of packets that were begun."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._task: asyncio.Task[None] | None = None
        self._lost = asyncio.Event()

    @property
    def description(self) -> str:
        """Where it leads, for a person."""
        return str(self.url)

    async def open(self) -> None:
        """Open the port.

        Raises:
            LinkError: there is no such device, it is forbidden, busy, or can't be set up so.
        """
        self._loop = asyncio.get_running_loop()
        try:
            self._open_port(self._loop)
        except (OSError, ValueError, termios.error) as error:
            raise LinkError(self._why_not(error)) from error
        self._task = self._loop.create_task(self._keep_open(self._loop))

    def send(self, data: bytes) -> None:
        """Send packets; dropped and counted while the line is behind, or gone."""
        loop = self._loop
        if loop is None or self._port is None:
            self.counters.unsent_packets += 1
            return
        if not self._congestion.admits(len(data), self._waiting(), loop.time()):
            self.counters.unsent_packets += 1
            return
        self.counters.packets_out += 1
        self.counters.bytes_out += len(data)
        if self._rest:
            self._rest += data
            return
        self._rest = data
        self._write()
        if self._rest and self._port is not None:
            loop.add_writer(self._descriptor, self._write)

    def close(self) -> None:
        """Close the port, and leave it closed."""
        if self._task is not None:
            self._task.cancel()
            self._task = None
        self._close_port()
        self.down_because = "closed"

    def _open_port(self, loop: asyncio.AbstractEventLoop) -> None:
        port = serial.Serial(
            self.url.host, self.url.port, timeout=0, write_timeout=0, exclusive=True
        )
        self._port = port
        self._descriptor = int(port.fileno())
        with contextlib.suppress(OSError):
            # The lock that pyserial takes is only heeded by programs that ask for one.
            fcntl.ioctl(self._descriptor, termios.TIOCEXCL)
        with contextlib.suppress(OSError, ValueError):
            # An FTDI adapter keeps bytes for 16 ms otherwise.
            port.set_low_latency_mode(True)
        self._rest = b""
        self._lost.clear()
        loop.add_reader(self._descriptor, self._read, loop)
        self.counters.connections += 1
        self._changed("")

    def _close_port(self) -> None:
        port, self._port = self._port, None
        if port is None or self._loop is None:
            return
        self._loop.remove_reader(self._descriptor)
        self._loop.remove_writer(self._descriptor)
        with contextlib.suppress(OSError):
            fcntl.ioctl(self._descriptor, termios.TIOCNXCL)
        with contextlib.suppress(OSError, termios.error):
            # Else closing waits for what a dead line will never take.
            termios.tcflush(self._descriptor, termios.TCOFLUSH)
        with contextlib.suppress(OSError):
            port.close()
        self._rest = b""

    def _lose(self, reason: str) -> None:
        self.counters.errors += 1
        self._close_port()
        self._lost.set()
        self._changed(reason)

    def _changed(self, down_because: str) -> None:
        self.down_because = down_because
        if self.on_change is not None:
            self.on_change(down_because)

    def _read(self, loop: asyncio.AbstractEventLoop) -> None:
        parts: list[bytes] = []
        lost = ""
        for _ in range(_READS_AT_ONCE):
            try:
                part = os.read(self._descriptor, _READ_BYTES)
            except (BlockingIOError, InterruptedError):
                break
            except OSError as error:
                lost = why(error)
                break
            if not part:
                # With a time-out of 0, the end of the data reads like the end of the device.
                lost = "" if parts else "the device is gone"
                break
            parts.append(part)
            if len(part) < _READ_BYTES:
                break
        if parts:
            self._pass_on(b"".join(parts), loop)
        if lost and self._port is not None:
            self._lose(lost)

    def _pass_on(self, data: bytes, loop: asyncio.AbstractEventLoop) -> None:
        self.counters.packets_in += 1
        self.counters.bytes_in += len(data)
        if self.on_bytes is not None:
            self.on_bytes(data, loop.time())

    def _write(self) -> None:
        try:
            written = os.write(self._descriptor, self._rest)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            self._lose(why(error))
            return
        self._rest = self._rest[written:]
        if not self._rest and self._loop is not None:
            self._loop.remove_writer(self._descriptor)

    async def _keep_open(self, loop: asyncio.AbstractEventLoop) -> None:
        backoff = Backoff()
        while True:
            while not self._lost.is_set():
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(_WATCH_S):
                        await self._lost.wait()
                self._drop_what_is_stale(loop.time())
            await asyncio.sleep(backoff.next_s())
            try:
                self._open_port(loop)
            except (OSError, ValueError, termios.error) as error:
                self.counters.errors += 1
                reason = why(error)
                if reason != self.down_because:
                    self._changed(reason)
            else:
                backoff.reset()

    def _waiting(self) -> int:
        return len(self._rest) + waiting_in_system(self._descriptor)

    def _drop_what_is_stale(self, now_s: float) -> None:
        """Throw away what a line that stands still (flow control) has not taken.

        A packet may be cut in two by that: its CRC says so to who gets it.
        """
        if self._port is None:
            return
        if self._congestion.full_for_s(self._waiting(), now_s) <= BLOCKED_AFTER_S:
            return
        with contextlib.suppress(OSError, termios.error):
            termios.tcflush(self._descriptor, termios.TCOFLUSH)
        if self._loop is not None:
            self._loop.remove_writer(self._descriptor)
        self._rest = b""

    def _why_not(self, error: Exception) -> str:
        device, baud = self.url.host, self.url.port
        begin = f"The link {self.url} cannot be opened: "
        number = getattr(error, "errno", None)
        if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
            return begin + (
                f"there is no device {device}. Plug it in, or look for its name: `ls "
                "/dev/serial/by-id` lists USB adapters by names that stay."
            )
        if number in (errno.EACCES, errno.EPERM):
            return begin + (
                f"{device} is not for this user. Join the group that owns it (`sudo usermod -aG "
                "dialout $USER`), then log in again."
            )
        if number in (errno.EBUSY, errno.EAGAIN):
            return begin + (
                f"another program has {device}. End it (a ground station, another companion, "
                f"ModemManager; `fuser -v {device}` names it)."
            )
        if isinstance(error, ValueError):
            return begin + (
                f"{device} does not take {baud} bits per second ({error}). Choose a rate that "
                "both sides have: 57600, 115200, 921600."
            )
        if number == errno.ENOTTY or "configure port" in str(error):
            return begin + f"{device} is no serial port. Check the path."
        return begin + f"{why(error)}. Check the device and its cable."
