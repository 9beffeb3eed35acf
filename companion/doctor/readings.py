"""What is read of a computer, as plain data: tests judge readings that they make up."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Extra:
    """An optional part of the installation."""

    name: str
    purpose: str
    missing: tuple[str, ...] = ()
    """Packages of it that are not installed."""


@dataclass(frozen=True, slots=True)
class Software:
    """Versions."""

    companion: str
    commit: str
    """Empty outside of a checkout."""
    python: str
    system: str
    packages: Mapping[str, str | None]
    """What the program needs, with its version; None: not installed."""
    extras: tuple[Extra, ...] = ()
    pip_install: str = "pip install"
    """How packages get into this environment."""


@dataclass(frozen=True, slots=True)
class Solver:
    """A QP solver and how it did."""

    name: str
    installed: bool
    trouble: str = ""
    """Empty if it solved its problem rightly."""
    time_us: float | None = None
    """Of one solve, the median of a few."""


@dataclass(frozen=True, slots=True)
class SerialDevice:
    """A serial device and whether this user may use it."""

    path: str
    group: str
    allowed: bool


@dataclass(frozen=True, slots=True)
class Port:
    """A UDP port."""

    number: int
    used_for: str
    free: bool
    holder: str = ""
    """Process that has it, as far as this user may know."""


@dataclass(frozen=True, slots=True)
class Timers:
    """How late a loop that sleeps to a deadline is woken, ms."""

    count: int
    median_ms: float
    p99_ms: float
    greatest_ms: float


@dataclass(frozen=True, slots=True)
class Processor:
    """What decides how punctual a process can be."""

    cores: int
    """That this process may run on."""
    load: float
    """Processes that ran or waited, on average of the last minute."""
    governors: tuple[str, ...] = ()
    """Of the frequency; empty where the system has none."""
    real_time_priority: int = 0
    """Largest that this user may give a process (chrt -f); 0: none."""
    real_time_kernel: bool = False


@dataclass(frozen=True, slots=True)
class Clock:
    """The system's time of day."""

    synchronised: bool | None
    """None: not to be known."""
    step_ms: float
    """Largest that it moved against the steady clock while the timers were measured."""


@dataclass(frozen=True, slots=True)
class Room:
    """Memory, and disk space where flights are written."""

    memory_total_mb: float | None
    memory_available_mb: float | None
    folder: str
    disk_free_mb: float
    writable: bool


@dataclass(frozen=True, slots=True)
class Terminal:
    """What texts are shown on."""

    encoding: str
    columns: int
    colour: bool


@dataclass(frozen=True, slots=True)
class Readings:
    """Everything."""

    software: Software
    solvers: tuple[Solver, ...]
    serial: tuple[SerialDevice, ...]
    ports: tuple[Port, ...]
    processor: Processor
    timers: Timers
    clock: Clock
    room: Room
    terminal: Terminal
    key_in_environment: bool = False
    """Whether there is a signing key; never which."""
    configs: str = ""
    """Folder of the shipped configurations."""
    missing_configs: tuple[str, ...] = field(default=())
    """What should lie in it and does not."""
