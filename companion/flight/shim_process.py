"""The embedded shim in real time: a process of its own, with only MAVLink between it and us."""

import asyncio
import contextlib
import sys
from dataclasses import dataclass
from pathlib import Path

from companion.flight.errors import LinkLostError, ShimRefusedError

_STARTS_WITHIN_S = 30.0


@dataclass(frozen=True, slots=True)
class ShimOptions:
    """What the embedded shim is told."""

    autopilot: str
    vehicle: str
    scenario: Path
    seed: int
    speed: float = 1.0


class ShimProcess:
    """A running shim.  It ends when we do, however we end: its standard input closes then."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process
        self._ending = False
        self.lost: asyncio.Future[LinkLostError] = asyncio.get_running_loop().create_future()
        """Done when the process has died by itself."""
        self._errors: list[str] = []
        loop = asyncio.get_running_loop()
        self._tasks = [loop.create_task(self._drain()), loop.create_task(self._watch())]

    async def end(self) -> None:
        """End the process and wait for it."""
        self._ending = True
        if self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.terminate()
        await self._process.wait()
        for task in self._tasks:
            task.cancel()
        for task in self._tasks:
            with contextlib.suppress(asyncio.CancelledError):
                await task

    async def _drain(self) -> None:
        """Keep the shim's error output from filling its pipe; the last lines are kept."""
        stream = self._process.stderr
        assert stream is not None
        while line := await stream.readline():
            self._errors = [*self._errors[-9:], line.decode(errors="replace").rstrip()]

    async def _watch(self) -> None:
        status = await self._process.wait()
        if self._ending or self.lost.done():
            return
        said = f" It said: {' / '.join(self._errors[-3:])}" if self._errors else ""
        self.lost.set_result(
            LinkLostError(
                f"The embedded shim ended by itself (exit status {status}): the vehicle is gone."
                + said
            )
        )


async def start_shim(options: ShimOptions, companion_port: int) -> ShimProcess:
    """Start the shim so that its onboard link sends to a UDP port of ours on loopback.

    Returns when it is ready: it then has taken all of its options.

    Raises:
        ShimRefusedError: it can't simulate that; the text is its own.
    """
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "sitl_shim",
        "run",
        f"--autopilot={options.autopilot}",
        f"--vehicle={options.vehicle}",
        f"--scenario={options.scenario}",
        f"--seed={options.seed}",
        f"--speed={options.speed}",
        "--onboard-port=0",
        f"--onboard-remote={companion_port}",
        "--gcs-port=0",
        "--exit-with-parent",
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        # A terminal's Ctrl-C goes to the whole group: the vehicle must outlive it, to land.
        start_new_session=True,
    )
    try:
        await _until_ready(process)
    except BaseException:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()
        raise
    return ShimProcess(process)


async def _until_ready(process: asyncio.subprocess.Process) -> None:
    """Wait for the one line that a shim says when it runs, or for its end."""
    assert process.stdout is not None
    assert process.stderr is not None
    try:
        ready = await asyncio.wait_for(process.stdout.readline(), _STARTS_WITHIN_S)
    except TimeoutError as error:
        raise ShimRefusedError(
            f"The embedded shim was not ready within {_STARTS_WITHIN_S:g} s. Is this computer "
            "very busy? `sitl-shim run` starts it alone."
        ) from error
    if not ready:
        said = (await process.stderr.read()).decode(errors="replace").strip()
        raise ShimRefusedError(said.removeprefix("sitl-shim: ") or "The shim does not start.")
