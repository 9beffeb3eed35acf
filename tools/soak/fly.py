"""Flies one flight of a soak in this process, sampling from within its event loop."""

import asyncio
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from companion.config.resolve import load_flight
from companion.experiments.perturbed_plant import scaled, write_plant
from companion.flight.assemble import make_trajectory
from companion.flight.beginning import log_begins_us, shim_options
from companion.flight.conduct import Outcome
from companion.flight.records import CHANNELS
from companion.recording.flight_log import FlightLog
from companion.report.terminal import TerminalObserver
from tools.soak.plans import FlightPlan

if TYPE_CHECKING:
    from companion.flight.observer import Observer, TickView

_BATTERY = scaled("battery", "capacity_a_h", by=10.0)
"""Of an hour's flight it is to be the companion that is worn out."""


@dataclass(frozen=True, slots=True)
class Glance:
    """What can be seen from within the loop."""

    time_s: float
    """The loop's: simulated in lockstep."""
    phase: str
    tasks: int
    """Not done yet, in this loop."""


class SamplingObserver:
    """Hands all on, and looks at the loop once in an interval, from a timer of the loop's own."""

    def __init__(
        self, inner: "Observer", take: Callable[[Glance], None], interval_s: float
    ) -> None:
        self._inner = inner
        self._take = take
        self._interval_s = interval_s
        self._phase = ""

    def phase(self, name: str, detail: str) -> None:
        """A phase begins; the first begins the sampling."""
        first, self._phase = not self._phase, name
        if first:
            self._look()
        self._inner.phase(name, detail)

    def tick(self, view: "TickView") -> None:
        """Hand it on."""
        self._inner.tick(view)

    def message(self, severity: str, text: str) -> None:
        """Hand it on."""
        self._inner.message(severity, text)

    def _look(self) -> None:
        loop = asyncio.get_running_loop()
        loop.call_later(self._interval_s, self._look)
        self._take(Glance(loop.time(), self._phase, len(asyncio.all_tasks(loop))))


def fly(
    plan: FlightPlan,
    folder: Path,
    take: Callable[[Glance], None],
    *,
    lockstep: bool,
    interval_s: float,
) -> Outcome:
    """Fly as `companion fly` does, without what it does after the landing.

    Args:
        plan: what to fly.
        folder: gets the log.
        take: called once in each interval from within the loop; must return quickly.
        lockstep: simulated time; else over UDP, the shim being a process of its own.
        interval_s: of the loop's time.

    Raises:
        OSError: the folder cannot be written.
        ConfigError: the flight cannot be flown as planned.
    """
    config = load_flight(None, plan.options, {})
    trajectory = make_trajectory(config.mission)
    shim = shim_options(config, lockstep=lockstep)
    assert shim is not None
    folder.mkdir(parents=True, exist_ok=True)
    plant = write_plant(shim.vehicle, [_BATTERY], folder / "plant.yaml")
    shim = replace(shim, vehicle=str(plant))
    log = FlightLog(folder, CHANNELS, base_us=log_begins_us(lockstep=lockstep))
    try:
        with (
            Path(os.devnull).open("w") as display,
            TerminalObserver(Console(file=display), verbose=False) as inner,
        ):
            observer = SamplingObserver(inner, take, interval_s)
            if lockstep:
                from companion.lockstep import fly_in_lockstep

                return fly_in_lockstep(config, trajectory, log, observer, shim)
            from companion.flight.real_time import fly_in_real_time

            return fly_in_real_time(config, trajectory, log, observer, shim)
    finally:
        log.close()
