"""Vehicles for the commands that ask one: what the reader has at the other end of the link."""

import contextlib
import fcntl
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

_SHIMS = {
    "udpin://127.0.0.1:14540": ("--autopilot", "px4"),
    "tcpout://127.0.0.1:5762": (
        *("--autopilot", "ardupilot", "--boot-scale", "0.1", "--tcp-port", "5762"),
    ),
}
"""What answers at an address; the first is where PX4's simulator speaks to a companion."""
_SITL_SHIM = str(Path(sys.executable).with_name("sitl-shim"))
_LOCK = Path(tempfile.gettempdir()) / "companion-tests-vehicle.lock"


def has_vehicle(argv: tuple[str, ...]) -> bool:
    """Whether a command asks a vehicle that can be had here."""
    return _option(argv, "--connect") in _SHIMS and _option(argv, "--vehicle") is not None


@contextlib.contextmanager
def usual_ports() -> Iterator[None]:
    """Have the ports that PX4's simulator uses, as one test at a time may."""
    with _LOCK.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@contextlib.contextmanager
def vehicle_of(argv: tuple[str, ...], folder: Path) -> Iterator[None]:
    """Simulate the vehicle that a command connects to, at the address that it names.

    The address is a fixed one, so no other test may do this at the same time.
    """
    address = _option(argv, "--connect")
    assert address is not None
    name = _option(argv, "--vehicle") or "bebop2"
    with usual_ports():
        shim = subprocess.Popen(
            (_SITL_SHIM, "run", "--vehicle", name, *_SHIMS[address]),
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            yield
        finally:
            shim.terminate()
            shim.wait()


def _option(argv: tuple[str, ...], name: str) -> str | None:
    return argv[argv.index(name) + 1] if name in argv[:-1] else None
