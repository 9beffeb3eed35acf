"""Carries out what `fly` is asked for, and makes arrays of it."""

import asyncio
import math
import signal
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, cast

from companion.api.errors import ControllerError
from companion.api.flight import Flight, figures_of, ticks_of, truth_of
from companion.api.order import Order
from companion.experiments.memory_log import MemoryLog
from companion.experiments.provenance import commit, version
from companion.flight.beginning import begin_log, discard_log
from companion.flight.conduct import Outcome
from companion.flight.inbox import Inbox
from companion.flight.observer import TickView
from companion.flight.records import CHANNELS
from companion.lockstep import fly_in_lockstep
from companion.report.aftermath import score_and_draw
from companion.report.flight_data import FlightData, read_flight
from companion.report.pages.provenance import Provenance

if TYPE_CHECKING:
    from companion.recording.flight_log import FlightLog

_Result = TypeVar("_Result")


def carry_out(order: Order, folder: Path | None, call: str) -> Flight:
    """Fly, and make arrays of it; files in a folder say by which call."""
    inbox, observer = Inbox(), _Listener()
    is_new = folder is not None and not folder.exists()
    log = MemoryLog() if folder is None else _log_in(folder)
    started = time.perf_counter()

    def fly_now() -> Outcome:
        return fly_in_lockstep(
            order.config,
            order.trajectory,
            cast("FlightLog", log),  # all that a flight asks of one is what a MemoryLog has
            observer,
            order.shim,
            inbox=inbox,
            airborne=not order.whole,
            signing_key=order.signing_key,
            own=order.own,
            own_wind=order.wind,
            replayable=order.replayable,
        )

    try:
        outcome = _outside_any_loop(fly_now)
    except BaseException:
        if folder is not None:
            cast("FlightLog", log).close()
            discard_log(folder, folder_too=is_new)
        raise
    data: FlightData
    if isinstance(log, MemoryLog):
        data = log.data()
    else:
        log.close()
        assert folder is not None
        wall_s = time.perf_counter() - started
        made = Provenance(call, version(), commit())
        _, trouble = score_and_draw(order.config, outcome, folder, wall_s, made)
        data = read_flight(folder)
        for text in (trouble, log.trouble):
            if text is not None:
                observer.message("warning", text)
    if inbox.interrupts:
        raise KeyboardInterrupt
    if inbox.ended_by is not None:
        signal.raise_signal(inbox.ended_by)  # the flight has landed; now it does what it would have
    raised = None if order.watched is None else order.watched.raised
    if raised is not None and order.own is not None and order.own.fallback is None:
        raise ControllerError(
            f"{order.own.name} failed in flight ({type(raised).__name__}: {raised})"
        ) from raised
    return _result(order, outcome, data, tuple(observer.warnings), folder)


def _result(
    order: Order,
    outcome: Outcome,
    data: FlightData,
    warnings: tuple[str, ...],
    folder: Path | None,
) -> Flight:
    mission, scored_s = order.config.mission, outcome.scored_s
    figures = figures_of(data, scored_s)
    if not outcome.completed:
        lost = math.inf
        figures = replace(
            figures,
            mean_error_m=lost,
            rms_error_m=lost,
            max_error_m=lost,
            reported_mean_error_m=lost,
        )
    began_s = math.nan if scored_s is None else scored_s[0]
    return Flight(
        outcome=outcome.outcome,
        completed=outcome.completed,
        note=outcome.note,
        warnings=warnings,
        trajectory=order.trajectory.name,
        controller=mission.controller,
        vehicle=mission.vehicle,
        wind=mission.wind,
        seed=mission.seed,
        scored_s=scored_s,
        figures=figures,
        ticks=ticks_of(data, began_s),
        truth=truth_of(data, began_s),
        folder=folder,
        data=data,
    )


class _Listener:
    """Keeps what a person would be warned of."""

    looks_at_ticks = False

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def phase(self, name: str, detail: str) -> None:
        """Nobody looks."""

    def tick(self, view: TickView) -> None:
        """Nobody looks."""

    def message(self, severity: str, text: str) -> None:
        """Keep what is more than information."""
        if severity != "info":
            self.warnings.append(text)


def _log_in(folder: Path) -> "FlightLog":
    return begin_log(folder, CHANNELS, lockstep=True)


def _outside_any_loop(work: Callable[[], _Result]) -> _Result:
    """Call something that runs an event loop: in a notebook, where one runs, in a thread."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return work()
    with ThreadPoolExecutor(1, thread_name_prefix="flight") as thread:
        return thread.submit(work).result()
