"""Which of the usual UDP ports are free, and who has those that are not."""

import contextlib
import os
import socket
from pathlib import Path

from companion.doctor.readings import Port

PORTS = {
    14540: "where PX4's onboard link and the simulator send (udpin://127.0.0.1:14540)",
    14550: "where ground stations listen (QGroundControl)",
    14445: "where QGroundControl forwards to, if it is told to",
}
_ALL = "0.0.0.0"  # to find whoever listens, on whichever address


def read_ports(numbers: dict[int, str] | None = None, root: Path = Path("/")) -> tuple[Port, ...]:
    """Try each port, and give it back at once.

    Args:
        numbers: ports and what they are for; by default the usual ones.
        root: of the file system, for the names of processes.
    """
    return tuple(
        Port(number, used_for, True)
        if _is_free(number)
        else Port(number, used_for, False, holder(number, root))
        for number, used_for in (PORTS if numbers is None else numbers).items()
    )


def holder(number: int, root: Path = Path("/")) -> str:
    """The process that has a UDP port: its name and id; empty where this user may not know."""
    sockets = _sockets(number, root)
    for folder in root.glob("proc/[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended, or is somebody else's
            if sockets.intersection(_link(path) for path in list((folder / "fd").iterdir())):
                name = (folder / "comm").read_text(encoding="utf-8", errors="replace").strip()
                return f"{name} (process {folder.name})"
    return ""


def _link(path: Path) -> str:
    try:
        return os.readlink(path)
    except OSError:  # closed since it was listed
        return ""


def _is_free(number: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((_ALL, number))
        except OSError:
            return False
    return True


def _sockets(number: int, root: Path) -> set[str]:
    """What the file descriptors of a port's sockets read, by the kernel's tables."""
    found = set()
    for table in ("proc/net/udp", "proc/net/udp6"):
        try:
            lines = (root / table).read_text(encoding="utf-8").splitlines()[1:]
        except OSError:
            continue
        for line in lines:
            words = line.split()
            if int(words[1].rpartition(":")[2], 16) == number:
                found.add(f"socket:[{words[9]}]")
    return found
