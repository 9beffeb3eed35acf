"""What a process holds, as Linux tells it (proc_pid_smaps(5), proc_pid_status(5))."""

import asyncio
import gc
import os
from dataclasses import dataclass
from pathlib import Path

_KIB_PER_MIB = 1024.0


@dataclass(frozen=True, slots=True)
class Held:
    """What a process holds at a moment."""

    memory_mib: float
    """Pages that are its alone and that it has written to, swapped out ones among them.

    Pages of files (libraries) are not among them: whether those are private, and how much of them
    is its share, changes with other processes that come and go.
    """
    pss_mib: float
    """With its share of what it shares."""
    rss_mib: float
    handles: int
    """Open files, sockets, pipes."""
    threads: int


def held_by(pid: int | str = "self") -> Held:
    """What a process holds now.

    Raises:
        OSError: it is gone, or this is not Linux.
    """
    folder = Path("/proc") / str(pid)
    sizes = _fields(folder / "smaps_rollup")
    own = ("Private_Dirty", "Private_Hugetlb", "Swap")
    handles = len(os.listdir(folder / "fd"))
    if pid in ("self", os.getpid()):
        handles -= 1  # the folder itself, while it is listed
    return Held(
        sum(int(sizes.get(name, "0").split()[0]) for name in own) / _KIB_PER_MIB,
        int(sizes["Pss"].split()[0]) / _KIB_PER_MIB,
        int(sizes["Rss"].split()[0]) / _KIB_PER_MIB,
        handles,
        int(_fields(folder / "status")["Threads"]),
    )


def live_tasks() -> int:
    """Task objects in this process that are alive, done or not, in whatever loop."""
    return sum(isinstance(thing, asyncio.Task) for thing in gc.get_objects())


def _fields(path: Path) -> dict[str, str]:
    """Of a file of lines ``Name: value``."""
    pairs = (line.partition(":") for line in path.read_text().splitlines())
    return {name: value.strip() for name, _, value in pairs}
