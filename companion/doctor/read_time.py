"""How punctual timers are, and how steady the clock is."""

import asyncio
import ctypes
import ctypes.util
import math
import time
from collections.abc import Sequence

from companion.doctor.readings import Clock, Timers

MEASURED_S = 1.5
_INTERVAL_S = 0.01
_TIMEX_BYTES = 512
"""More than `struct timex` has anywhere."""
_UNSYNCHRONISED = 5
"""What adjtimex returns then (TIME_ERROR)."""


async def read_time(
    measured_s: float = MEASURED_S, interval_s: float = _INTERVAL_S
) -> tuple[Timers, Clock]:
    """Sleep to deadlines as a flight's loop does, and watch the time of day beside it.

    Args:
        measured_s: for how long.
        interval_s: between deadlines.
    """
    loop = asyncio.get_running_loop()
    late_s: list[float] = []
    apart_s = [_apart_s()]
    for _ in range(max(1, round(measured_s / interval_s))):
        due_s = loop.time() + interval_s
        await asyncio.sleep(interval_s)
        late_s.append(loop.time() - due_s)
        apart_s.append(_apart_s())
    step_ms = 1e3 * (max(apart_s) - min(apart_s))
    return timers_of(late_s), Clock(_synchronised(), step_ms)


def timers_of(late_s: Sequence[float]) -> Timers:
    """Percentiles of latenesses, of which there is one at least."""
    ranked = sorted(late_s)

    def at(share: float) -> float:
        return 1e3 * ranked[min(len(ranked) - 1, math.ceil(share * len(ranked)) - 1)]

    return Timers(len(ranked), at(0.5), at(0.99), 1e3 * ranked[-1])


def _apart_s() -> float:
    return time.time() - time.monotonic()


def _synchronised() -> bool | None:
    """What the kernel knows of it, from whichever program sets the clock."""
    try:
        library = ctypes.CDLL(ctypes.util.find_library("c") or "libc.so.6", use_errno=True)
        state = library.adjtimex(ctypes.create_string_buffer(_TIMEX_BYTES))
    except (OSError, AttributeError):
        return None
    return None if state < 0 else state != _UNSYNCHRONISED
