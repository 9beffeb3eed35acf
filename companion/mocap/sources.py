"""Where poses come from: a UDP port, or a motion-capture system behind a process of its own."""

import asyncio
import contextlib
import errno
import importlib.util
import json
import sys
from collections.abc import Callable

from companion.config.mocap_models import MocapConfig
from companion.extras import install_extra

Receive = Callable[[bytes, float], None]
"""Takes a datagram and the loop's time at which it came."""

_LOOPBACK = "127.0.0.1"
_KEPT_LINES = 3


class MocapError(Exception):
    """The source can't be opened; the text says why and what to do."""


class MocapSource:
    """An open source; `close` ends it."""

    def __init__(
        self,
        description: str,
        transport: asyncio.DatagramTransport,
        process: asyncio.subprocess.Process | None,
    ) -> None:
        self.description = description
        """Where poses come from, for a person."""
        self._transport = transport
        self._process = process
        self._said: list[str] = []
        self._drain = (
            None if process is None else asyncio.get_running_loop().create_task(self._listen())
        )

    @property
    def port(self) -> int:
        """The UDP port that is listened on."""
        return int(self._transport.get_extra_info("sockname")[1])

    @property
    def trouble(self) -> str:
        """Why nothing can come any more; empty as long as something can."""
        if self._process is None or self._process.returncode is None:
            return ""
        said = " / ".join(self._said) or f"exit status {self._process.returncode}"
        return f"{self.description} has ended: {said}"

    async def close(self) -> None:
        """Stop listening, and end the process if there is one."""
        self._transport.close()
        if self._process is None:
            return
        if self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
        await self._process.wait()
        if self._drain is not None:
            await self._drain

    async def _listen(self) -> None:
        """Keep the last lines that the process says."""
        assert self._process is not None
        stream = self._process.stderr
        assert stream is not None
        while line := await stream.readline():
            text = line.decode(errors="replace").strip()
            self._said = [*self._said, text][-_KEPT_LINES:]
        await self._process.wait()


async def open_source(config: MocapConfig, receive: Receive) -> MocapSource:
    """Listen for poses, and start the process that sends them if the system needs one.

    Raises:
        MocapError: the port is taken, the package is missing, or the process can't be started.
    """
    if config.system == "udp":
        transport = await _listen(config.host, config.port, receive)
        host, port = transport.get_extra_info("sockname")[:2]
        return MocapSource(f"UDP/JSON on {host}:{port}", transport, None)
    if importlib.util.find_spec("motioncapture") is None:
        raise MocapError(
            f"mocap.system {config.system} needs the package motioncapture: "
            f"{install_extra('mocap')}, or send poses as JSON (mocap.system: udp)."
        )
    transport = await _listen(_LOOPBACK, 0, receive)
    try:
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "companion.mocap.worker",
            config.system,
            json.dumps({"hostname": config.host, **config.options}),
            config.body,
            str(transport.get_extra_info("sockname")[1]),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
            # A terminal's Ctrl-C goes to the whole group: poses must come until it has landed.
            start_new_session=True,
        )
    except OSError as error:
        transport.close()
        raise MocapError(f"the process for {config.system} can't be started: {error}") from error
    return MocapSource(f"{config.system} at {config.host}", transport, process)


class _Listener(asyncio.DatagramProtocol):
    def __init__(self, receive: Receive, time_s: Callable[[], float]) -> None:
        self._receive = receive
        self._time_s = time_s

    def datagram_received(self, data: bytes, _: tuple[str | int, ...]) -> None:
        self._receive(data, self._time_s())


async def _listen(host: str, port: int, receive: Receive) -> asyncio.DatagramTransport:
    loop = asyncio.get_running_loop()
    try:
        transport, _ = await loop.create_datagram_endpoint(
            lambda: _Listener(receive, loop.time), local_addr=(host, port)
        )
    except OSError as error:
        taken = error.errno == errno.EADDRINUSE
        remedy = (
            "another program has it: end that, or set mocap.port"
            if taken
            else "mocap.host must be an address of this computer: 127.0.0.1, or 0.0.0.0 for all"
        )
        reason = error.strerror or error
        raise MocapError(
            f"Poses can't come in on UDP {host}:{port}: {reason}; {remedy}."
        ) from error
    return transport
