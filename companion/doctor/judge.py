"""From readings to lines: what is well, what is worth knowing, what is wrong, and the remedy."""

from collections.abc import Iterator

from companion.doctor.item import Health, Item
from companion.doctor.readings import (
    Clock,
    Port,
    Processor,
    Readings,
    Room,
    SerialDevice,
    Software,
    Solver,
    Terminal,
    Timers,
)

DEADLINE_MS = 5.0
"""From a state's arrival to the setpoint that answers it."""
_PUNCTUAL_MS = 1.5
_LITTLE_MEMORY_MB, _TOO_LITTLE_MEMORY_MB = 512.0, 200.0
_LITTLE_DISK_MB, _TOO_LITTLE_DISK_MB = 1000.0, 50.0
_STEP_MS = 5.0
_NARROW = 80


def judge(readings: Readings) -> tuple[Item, ...]:
    """Every line, in the order in which they are told; pure."""
    return (
        *_software(readings.software),
        *_files(readings),
        *(_solver(solver, readings.software.pip_install) for solver in readings.solvers),
        *_serial(readings.serial),
        *(_port(port) for port in readings.ports),
        *_processor(readings.processor),
        _timers(readings.timers),
        *_clock(readings.clock),
        *_room(readings.room),
        _signing(present=readings.key_in_environment),
        _terminal(readings.terminal),
    )


def _software(software: Software) -> Iterator[Item]:
    commit = f", commit {software.commit}" if software.commit else ""
    yield Item("companion", f"{software.companion}{commit}")
    yield Item("Python", f"{software.python}, {software.system}")
    there = {name: version for name, version in software.packages.items() if version}
    if there:
        yield Item("packages", ", ".join(f"{name} {v}" for name, v in sorted(there.items())))
    for name in sorted(set(software.packages).difference(there)):
        yield Item(
            name,
            "not installed, and nothing flies without it",
            Health.PROBLEM,
            f"{software.pip_install} {name}",
        )
    for extra in software.extras:
        if extra.missing:
            remedy = f"{software.pip_install} 'companion[{extra.name}]'"
            yield Item(f"extra {extra.name}", f"not installed ({remedy}): {extra.purpose}")
        else:
            yield Item(f"extra {extra.name}", f"installed: {extra.purpose}")


def _files(readings: Readings) -> Iterator[Item]:
    if readings.missing_configs:
        missing = ", ".join(readings.missing_configs)
        yield Item(
            "shipped files",
            f"{readings.configs} lacks {missing}",
            Health.PROBLEM,
            "Install the program anew: its package is not whole.",
        )
    elif readings.configs:
        yield Item("shipped files", readings.configs)


def _solver(solver: Solver, pip_install: str) -> Item:
    subject = f"solver {solver.name}"
    if not solver.installed:
        return Item(subject, "not installed; `mpc.solver` can't name it", Health.NOTE)
    if solver.trouble:
        return Item(
            subject,
            solver.trouble,
            Health.PROBLEM,
            f"Install it anew: {pip_install} --force-reinstall {solver.name}",
        )
    time = "" if solver.time_us is None else f", {solver.time_us:.0f} µs a solve"
    return Item(subject, f"right answer to a small problem{time}")


def _serial(devices: tuple[SerialDevice, ...]) -> Iterator[Item]:
    if not devices:
        yield Item("serial devices", "none; a vehicle on a cable or a radio would show as one")
    for device in devices:
        if device.allowed:
            yield Item(f"serial {device.path}", "may be used")
        else:
            yield Item(
                f"serial {device.path}",
                f"may not be used by this user; it belongs to the group {device.group}",
                Health.PROBLEM,
                f'sudo usermod -aG {device.group} "$USER", then log in again',
            )


def _port(port: Port) -> Item:
    subject = f"UDP port {port.number}"
    if port.free:
        return Item(subject, f"free: {port.used_for}")
    holder = port.holder or "a process that only its owner or root may see"
    return Item(
        subject,
        f"taken by {holder}: {port.used_for}",
        Health.NOTE,
        "End that program if it is not wanted, or give another port (--connect).",
    )


def _processor(processor: Processor) -> Iterator[Item]:
    cores = f"{processor.cores} core{'s' if processor.cores != 1 else ''}"
    said = f"{cores}, load {processor.load:.1f}"
    if processor.load > processor.cores:
        yield Item(
            "processor",
            f"{said}: more is running than there are cores",
            Health.NOTE,
            "End what is not wanted in flight.",
        )
    elif processor.cores == 1:
        yield Item(
            "processor",
            f"{said}: simulator and live page share it with the flight",
            Health.NOTE,
            "Fly simulated flights with --lockstep.",
        )
    else:
        yield Item("processor", said)
    slow = sorted({governor for governor in processor.governors if governor != "performance"})
    if slow:
        yield Item(
            "frequency governor",
            f"{', '.join(slow)}: cores slow down between ticks",
            Health.NOTE,
            "sudo cpupower frequency-set -g performance",
        )
    elif processor.governors:
        yield Item("frequency governor", "performance")
    kernel = "a real-time kernel; " if processor.real_time_kernel else ""
    if processor.real_time_priority > 0:
        yield Item(
            "real-time priority",
            f"{kernel}up to {processor.real_time_priority}: `chrt -f 10 companion fly …` works",
        )
    else:
        yield Item(
            "real-time priority",
            f"{kernel}not allowed to this user (RLIMIT_RTPRIO is 0)",
            Health.NOTE,
            "Put `@dialout - rtprio 50` into /etc/security/limits.d/companion.conf, log in again, "
            "and fly under `chrt -f 10`.",
        )


def _timers(timers: Timers) -> Item:
    said = (
        f"late by {timers.median_ms:.2f} ms in the median, {timers.p99_ms:.2f} ms at the 99th "
        f"percentile, {timers.greatest_ms:.2f} ms at most of {timers.count}"
    )
    if timers.p99_ms > DEADLINE_MS:
        return Item(
            "timers",
            f"{said}: more than the deadline of {DEADLINE_MS:.0f} ms, before anything is computed",
            Health.PROBLEM,
            "End what else runs, fly under `chrt -f 10`, set the governor to performance "
            "(docs/real-time.md). Flights in lockstep do not mind.",
        )
    left = f"{DEADLINE_MS - timers.p99_ms:.1f} ms of the deadline of {DEADLINE_MS:.0f} ms are left"
    if timers.p99_ms > _PUNCTUAL_MS:
        return Item(
            "timers",
            f"{said}: {left}",
            Health.NOTE,
            "Enough to fly; `chrt -f 10` and the governor `performance` make it more.",
        )
    return Item("timers", f"{said}: {left}")


def _clock(clock: Clock) -> Iterator[Item]:
    if clock.synchronised is None:
        yield Item("clock", "whether it is synchronised is not to be known here")
    elif clock.synchronised:
        yield Item("clock", "synchronised")
    else:
        yield Item(
            "clock",
            "not synchronised: dates of logs may be wrong; flights go by the autopilot's time",
            Health.NOTE,
            "sudo timedatectl set-ntp true",
        )
    if clock.step_ms > _STEP_MS:
        yield Item(
            "clock's steps",
            f"it moved by {clock.step_ms:.1f} ms against the steady clock within a second or two",
            Health.NOTE,
            "Something sets the time; a flight does not go by it, signatures of packets do.",
        )


def _room(room: Room) -> Iterator[Item]:
    available = room.memory_available_mb
    if available is not None:
        total = f" of {room.memory_total_mb:.0f} MB" if room.memory_total_mb is not None else ""
        said = f"{available:.0f} MB available{total}"
        if available < _TOO_LITTLE_MEMORY_MB:
            yield Item("memory", f"{said}: too little", Health.PROBLEM, "End what is not wanted.")
        elif available < _LITTLE_MEMORY_MB:
            yield Item("memory", f"{said}: enough to fly", Health.NOTE, "Studies: use --jobs 1.")
        else:
            yield Item("memory", said)
    said = f"{room.disk_free_mb / 1000.0:.1f} GB free for flights in {room.folder}"
    if not room.writable:
        yield Item(
            "disk",
            f"{room.folder} can't be written to",
            Health.PROBLEM,
            "Go to a folder of your own, or give one with --out.",
        )
    elif room.disk_free_mb < _TOO_LITTLE_DISK_MB:
        yield Item("disk", f"{said}: too little for a log", Health.PROBLEM, "Make room.")
    elif room.disk_free_mb < _LITTLE_DISK_MB:
        yield Item("disk", said, Health.NOTE, "A minute of flight takes some megabytes.")
    else:
        yield Item("disk", said)


def _signing(*, present: bool) -> Item:
    if present:
        return Item("signing key", "COMPANION_SIGNING_KEY is set: packets are signed")
    return Item("signing key", "COMPANION_SIGNING_KEY is not set: packets are not signed by it")


def _terminal(terminal: Terminal) -> Item:
    colour = "with" if terminal.colour else "without"
    said = f"{terminal.encoding}, {terminal.columns} columns, {colour} colour"
    if not terminal.encoding.lower().startswith("utf"):
        return Item(
            "terminal",
            f"{said}: signs such as ° show as ?",
            Health.NOTE,
            "export LANG=C.UTF-8",
        )
    if terminal.columns < _NARROW:
        return Item("terminal", f"{said}: tables wrap", Health.NOTE, "Widen it to 80 columns.")
    return Item("terminal", said)
