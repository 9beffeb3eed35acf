"""Starts the shim's command line as a process of its own, for tests over real sockets."""

import asyncio
import contextlib
import socket
import sys
from collections.abc import AsyncIterator


def free_port() -> int:
    """A UDP port of loopback that was free a moment ago."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def start_shim(
    *arguments: str, stdin: int = asyncio.subprocess.PIPE
) -> asyncio.subprocess.Process:
    """The process, not yet ready."""
    return await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "sitl_shim",
        "run",
        *arguments,
        stdin=stdin,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )


@contextlib.asynccontextmanager
async def running_shim(*arguments: str) -> AsyncIterator[tuple[asyncio.subprocess.Process, str]]:
    """A shim that has said that it is ready, and what it said; ended afterwards."""
    process = await start_shim(*arguments)
    assert process.stdout is not None
    try:
        line = await asyncio.wait_for(process.stdout.readline(), 20.0)
        yield process, line.decode()
    finally:
        if process.returncode is None:
            process.kill()
        await process.wait()
