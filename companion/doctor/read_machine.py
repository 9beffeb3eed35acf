"""Processor, memory, disk and serial devices, from what Linux tells every user."""

import grp
import os
import resource
import shutil
from pathlib import Path

from companion.doctor.readings import Processor, Room, SerialDevice

_CAP_SYS_NICE = 1 << 23
_MOST_PRIORITY = 99
_SERIAL = ("ttyACM*", "ttyUSB*", "ttyAMA*", "ttyTHS*", "serial[0-9]*")
_KIB_PER_MB = 1000.0 / 1.024


def read_processor(root: Path = Path("/")) -> Processor:
    """Cores, load, governors, and whether real-time scheduling may be used.

    Args:
        root: of the file system.
    """
    paths = root.glob("sys/devices/system/cpu/cpu[0-9]*/cpufreq/scaling_governor")
    governors = {_text(path).strip() for path in paths} - {""}
    return Processor(
        cores=len(os.sched_getaffinity(0)),
        load=os.getloadavg()[0],
        governors=tuple(sorted(governors)),
        real_time_priority=_priority(root),
        real_time_kernel=_text(root / "sys/kernel/realtime").strip() == "1",
    )


def read_room(folder: Path, root: Path = Path("/")) -> Room:
    """Memory, and disk space for flights.

    Args:
        folder: where they are written; it need not be there yet.
        root: of the file system.
    """
    there = next(path for path in (folder, *folder.absolute().parents) if path.is_dir())
    facts = dict(line.split(":", 1) for line in _text(root / "proc/meminfo").splitlines())
    return Room(
        memory_total_mb=_megabytes(facts.get("MemTotal")),
        memory_available_mb=_megabytes(facts.get("MemAvailable")),
        folder=short(folder.absolute()),
        disk_free_mb=shutil.disk_usage(there).free / 1e6,
        writable=os.access(there, os.W_OK | os.X_OK),
    )


def read_serial(devices: Path = Path("/dev")) -> tuple[SerialDevice, ...]:
    """Serial devices that a vehicle could be on.

    Args:
        devices: the folder that they are in.
    """
    found = sorted({path for pattern in _SERIAL for path in devices.glob(pattern)})
    return tuple(
        SerialDevice(str(path), _group(path), os.access(path, os.R_OK | os.W_OK)) for path in found
    )


def short(path: Path) -> str:
    """A path without the name of the user in it."""
    home = Path.home()
    return f"~/{path.relative_to(home)}" if path.is_relative_to(home) else str(path)


def _priority(root: Path) -> int:
    """Largest real-time priority that this process may have."""
    for line in _text(root / "proc/self/status").splitlines():
        name, _, value = line.partition(":")
        if name == "CapEff" and int(value, 16) & _CAP_SYS_NICE:
            return _MOST_PRIORITY
    limit = resource.getrlimit(resource.RLIMIT_RTPRIO)[0]
    return _MOST_PRIORITY if limit == resource.RLIM_INFINITY else min(limit, _MOST_PRIORITY)


def _group(path: Path) -> str:
    try:
        number = path.stat().st_gid
        return grp.getgrgid(number).gr_name
    except OSError:
        return "unknown"
    except KeyError:
        return str(number)


def _megabytes(text: str | None) -> float | None:
    """Of ``  2041 kB``, as the kernel tells memory."""
    return None if text is None else float(text.split()[0]) / _KIB_PER_MB


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
