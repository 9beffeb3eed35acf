"""The embedded shim in real time: a process of its own, with only MAVLink between it and us."""

import asyncio
import contextlib
import os
import signal
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from companion.flight.errors import LinkLostError, ShimRefusedError

_STARTS_WITHIN_S = 30.0
_DEFAULT_STATE_HZ = 125.0
_KEY_VARIABLE = "SITL_SHIM_SIGNING_KEY"


@dataclass(frozen=True, slots=True)
class ShimOptions:
    """What the embedded shim is told."""

    autopilot: str
    vehicle: str
    scenario: Path
    seed: int
    speed: float = 1.0
    sensors: str | None = None
    """A sensor profile, by name or path, in place of the vehicle's own."""
    parameters: Mapping[str, float] = field(default_factory=dict)
    """Autopilot parameters that differ from the vehicle's, by name."""
    boot_scale: float = 1.0
    """What the time from boot to readiness is multiplied by."""
    mocap_port: int | None = None
    """UDP port to which the room's cameras send poses; None: there are none."""
    faults: str | None = None
    """What goes wrong on purpose: a YAML file's path, or YAML that begins with ``{``."""
    signing_key: bytes | None = field(default=None, repr=False)
    """32 bytes, with which packets are signed and must be signed; None: they need not be."""


def with_state_rate(options: ShimOptions, state_rate_hz: float) -> ShimOptions:
    """The options for a state that comes this often.

    PX4's estimator publishes at 125 Hz unless its prediction period (EKF2_PREDICT_US) is set to
    the 4 ms of its gyro's samples.  ArduPilot's needs nothing.
    """
    if state_rate_hz <= _DEFAULT_STATE_HZ or options.autopilot != "px4":
        return options
    return replace(options, parameters={"EKF2_PREDICT_US": 4000.0, **options.parameters})


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
        _signal(self._process, signal.SIGTERM)
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
        *([] if options.boot_scale == 1.0 else [f"--boot-scale={options.boot_scale}"]),
        *([] if options.sensors is None else [f"--sensors={options.sensors}"]),
        *(f"--parameter={name}={value}" for name, value in options.parameters.items()),
        *([] if options.faults is None else [f"--faults={options.faults}"]),
        *([] if options.mocap_port is None else [f"--mocap-port={options.mocap_port}"]),
        "--onboard-port=0",
        f"--onboard-remote={companion_port}",
        "--gcs-port=0",
        "--exit-with-parent",
        env=_environment(options),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        # A terminal's Ctrl-C goes to the whole group: the vehicle must outlive it, to land.
        start_new_session=True,
    )
    try:
        await _until_ready(process)
    except BaseException:
        _signal(process, signal.SIGKILL)
        await process.wait()
        raise
    return ShimProcess(process)


def _signal(process: asyncio.subprocess.Process, number: signal.Signals) -> None:
    """Send a signal to a process that may have ended by itself.

    Popen would look at it first, and take the status of one that has just ended away from asyncio's
    watcher, which then tells of an unknown child and of the status 255.
    """
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process.pid, number)


def _environment(options: ShimOptions) -> dict[str, str]:
    """Ours, with the key, which must not stand on a command line, or without one."""
    environment = {key: value for key, value in os.environ.items() if key != _KEY_VARIABLE}
    if options.signing_key is not None:
        environment[_KEY_VARIABLE] = options.signing_key.hex()
    return environment


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
