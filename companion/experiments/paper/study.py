"""The whole study: fly what is missing, evaluate, judge."""

import math
import os
import platform
import time
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from pathlib import Path

from companion.config.resolve import FlightConfig, load_flight
from companion.control.reference_model import PositionModel
from companion.experiments.campaign import run_campaign
from companion.experiments.computing_time import ComputingTime, measure_computing_time
from companion.experiments.flight_store import MissingExtraError, Summary
from companion.experiments.flight_task import FlightTask
from companion.experiments.paper import (
    adaptation_rate,
    bounds,
    changing_dynamics,
    model_transfer,
    origin,
    reference_system,
    tracking,
)
from companion.experiments.paper.flights import Flights
from companion.experiments.paper.guarantees import theory_of
from companion.experiments.paper.identification import identify_models
from companion.experiments.paper.results import PaperResults, Provenance
from companion.experiments.paper.scale import VEHICLE, Scale
from companion.experiments.progress import Progress
from companion.experiments.provenance import commit, version
from companion.flight.assemble import position_model

_SEED = 1


def study_tasks(scale: Scale) -> list[FlightTask]:
    """Every flight of the study, each once."""
    modules = (
        tracking,
        bounds,
        adaptation_rate,
        reference_system,
        model_transfer,
        changing_dynamics,
        origin,
    )
    flown = [task for module in modules for task in module.tasks(scale)]
    return list(dict.fromkeys(flown))


def run_study(
    scale: Scale,
    folder: Path,
    jobs: int,
    command: str,
    progress: Progress | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> PaperResults:
    """Fly what has not been flown yet into a folder, and evaluate all of it.

    Args:
        scale: how much.
        folder: of the study; flights that are in it already are not flown again.
        jobs: how many processes fly.
        command: that makes the study again, for its report.
        progress: told after each flight.
        say: told what is going on beside the flights.

    Raises:
        ConfigError: a shipped file that the study needs can't be used; nothing was flown.
        MissingExtraError: a library of the extra `study` is not installed.
        CampaignInterruptedError: Ctrl-C; the same command goes on from there.
        OSError: the folder can't be written.
    """
    started = time.perf_counter()
    config = load_flight(None, {"controller": "mpc-l1", "vehicle": VEHICLE}, {})
    theory = theory_of(config)
    summaries = run_campaign(study_tasks(scale), folder, jobs, progress)
    say("identifying MPC-PID's model once more")
    identification = identify_models(jobs)
    computing = _computing_time(scale, say)
    say("evaluating")
    flights = Flights(folder, summaries)
    model = _model(config)
    return PaperResults(
        scale=scale,
        tracking=tracking.evaluate(flights, scale),
        bounds=bounds.evaluate(flights, scale, model, theory.gains),
        guarantees=theory.guarantees,
        adaptation_rate=adaptation_rate.evaluate(flights, scale, theory),
        reference=reference_system.evaluate(flights, scale, theory),
        model_transfer=model_transfer.evaluate(flights, scale),
        changing_dynamics=changing_dynamics.evaluate(flights, scale, model),
        origin=origin.evaluate(flights, scale),
        identification=identification,
        computing_time=computing,
        provenance=_provenance(summaries.values(), command, time.perf_counter() - started),
    )


def _model(config: FlightConfig) -> PositionModel:
    model = position_model(config.controller)
    assert model is not None
    return model


def _computing_time(scale: Scale, say: Callable[[str], None]) -> ComputingTime | None:
    say("timing the linear MPC against nonlinear ones")
    try:
        return measure_computing_time(scale.mpc_ticks, _SEED)
    except MissingExtraError as error:
        say(str(error))
        return None


def _provenance(summaries: Iterable[Summary], command: str, wall_s: float) -> Provenance:
    flown = list(summaries)
    return Provenance(
        version=version(),
        commit=commit(),
        machine=f"{platform.machine()}, {os.cpu_count()} processors, {platform.system()}",
        python=platform.python_version(),
        date=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        command=command,
        flights=len(flown),
        lost=sum(not math.isfinite(summary.mean_error_m) for summary in flown),
        wall_s=wall_s,
    )
