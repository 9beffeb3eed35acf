"""The time of the loop that runs: of this computer, or simulated."""

import asyncio


def loop_time() -> float:
    """Seconds by the running loop's clock.

    Who asks at every frame keeps `asyncio.get_running_loop().time` once a loop runs: to find the
    loop takes a system call, several times as long as to ask it.

    Raises:
        RuntimeError: no loop runs.
    """
    return asyncio.get_running_loop().time()
