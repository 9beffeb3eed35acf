"""The process that flies, and nothing else: what it holds is what is measured.

    python -m tools.soak.child ORDER.json

The order has `mode`, `folder` and `plans`.  It says on standard output, one JSON object in a line,
what it sees; the parent reads it, looks at /proc, and reads the logs.
"""

import gc
import json
import os
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from companion.flight.conduct import Outcome
from companion.flight.setpoints import setpoint_stream
from tools.soak.fly import Glance, fly
from tools.soak.gauges import held_by, live_tasks
from tools.soak.plans import FlightPlan

REAL_TIME, LONG, MANY = "real time", "long flight", "flights"
"""Modes: one over UDP; one in lockstep; many in lockstep, one after another."""
_EVERY_S = {REAL_TIME: 1.0, LONG: 10.0, MANY: 5.0}


def main() -> None:
    """Fly what is ordered."""
    told = json.loads(Path(sys.argv[1]).read_text())
    if told["mode"] != REAL_TIME:
        _take_processor_time()
    plans = [FlightPlan(**plan) for plan in told["plans"]]
    _Flights(told["mode"], Path(told["folder"])).fly(plans)


class _Flights:
    """Flies, and says what it sees."""

    def __init__(self, mode: str, folder: Path) -> None:
        self._mode = mode
        self._folder = folder
        self._begun_s = 0.0

    def fly(self, plans: list[FlightPlan]) -> None:
        for number, plan in enumerate(plans):
            outcome = self._fly(plan, self._folder / f"flight-{number:04d}")
            self._begun_s += outcome.flight_s
            self._say("flown", number=number, **_figures(outcome), **self._after_flight())

    def _fly(self, plan: FlightPlan, folder: Path) -> Outcome:
        lockstep = self._mode != REAL_TIME
        interval_s = _EVERY_S[self._mode]
        return fly(plan, folder, self._glance, lockstep=lockstep, interval_s=interval_s)

    def _glance(self, glance: Glance) -> None:
        """Within the loop: in real time the parent looks at /proc, for that takes a while."""
        if self._mode == MANY:
            return
        held = {"pid": os.getpid()} if self._mode == REAL_TIME else _held()
        self._say("seen", **asdict(glance), blocks=sys.getallocatedblocks(), **held)

    def _after_flight(self) -> dict[str, Any]:
        """Between two flights: tasks that are left over, and what is held."""
        if self._mode != MANY:
            return {}
        held = _held()
        return {
            "time_s": self._begun_s,
            "tasks": live_tasks(),
            "blocks": sys.getallocatedblocks(),
            **held,
        }

    def _say(self, what: str, **values: object) -> None:
        sys.stdout.write(json.dumps({"what": what, **values}) + "\n")
        sys.stdout.flush()


def _take_processor_time() -> None:
    """Let `computed_us` of the records be processor time.

    In simulated time nobody waits, and the wall clock would only tell what else the computer does.
    """
    vars(setpoint_stream)["time"] = SimpleNamespace(perf_counter=time.thread_time)


def _held() -> dict[str, Any]:
    """In simulated time nobody waits: garbage is collected first, so that the figures repeat."""
    gc.collect()
    return asdict(held_by())


def _figures(outcome: Outcome) -> Mapping[str, Any]:
    return {
        "outcome": outcome.outcome,
        "completed": outcome.completed,
        "note": outcome.note,
        "flight_s": outcome.flight_s,
        "ticks": outcome.ticks,
        "missed_deadlines": outcome.missed_deadlines,
        "latency_ms": None if outcome.latency is None else asdict(outcome.latency),
        "timer_noise_ms": None if outcome.timer_noise is None else asdict(outcome.timer_noise),
    }


if __name__ == "__main__":
    main()
