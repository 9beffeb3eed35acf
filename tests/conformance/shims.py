"""The shim that a client meets: fast enough for a test, slow enough for a client's own timers."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from tests.sitl_shim.server.shim_process import free_port, running_shim

_SPEED = 4.0
_ARDUPILOT_BOOT = 0.2


@asynccontextmanager
async def shim_for_clients(flavour: str, seed: int = 1) -> AsyncIterator[tuple[int, int]]:
    """A running shim; the ports to which its onboard and its ground station's link speak."""
    onboard, ground = free_port(), free_port()
    arguments = [
        f"--autopilot={flavour}",
        "--vehicle=bebop2",
        f"--seed={seed}",
        f"--speed={_SPEED}",
        "--onboard-port=0",
        "--gcs-port=0",
        f"--onboard-remote={onboard}",
        f"--gcs-remote={ground}",
    ]
    if flavour == "ardupilot":
        arguments.append(f"--boot-scale={_ARDUPILOT_BOOT}")
    async with running_shim(*arguments):
        yield onboard, ground
