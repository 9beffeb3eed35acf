"""A recorded flight, back from its folder."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError

from companion.api.errors import InputError
from companion.api.flight import Flight, figures_of, ticks_of, truth_of
from companion.flight.configuration_record import recorded_configuration
from companion.flight.records import CONFIGURATION, EVENT, INPUT
from companion.report import flight_data
from companion.report.cut_off import UNFINISHED, cut_off_result
from companion.report.flight_page.story import story_of
from companion.report.result import RESULT_NAME
from companion.report.scored_interval import engagement_of, scored_interval_s
from companion.trajectories.harmonic import TEST_TRAJECTORIES


def read_flight(folder: str | Path) -> Flight:
    """Read a flight's folder: of `fly`, or of the command, simulated or real, finished or not.

    Args:
        folder: with `flight.mcap` and `flight.tlog`, and `result.json` if the flight has ended.

    Raises:
        InputError: the logs are not there, or are no flight's.
    """
    folder = Path(folder)
    try:
        log = flight_data.read_log(folder)
        data = flight_data.flight_from_log(log, folder)
        told = log.get(CONFIGURATION.topic, ())
        if not told:
            raise ValueError("it ends before a flight began")
        mission = told[0].values["mission"]
        engagement = engagement_of(log.get(INPUT.topic, ()))
        scored_s = scored_interval_s(engagement, mission.get("trajectory"))
        result = _result_object(folder)
        if result is None:
            config = recorded_configuration(dict(told[0].values))
            result = cut_off_result(config, story_of(data, log), log, scored_s, folder)
        seed = int(mission.get("seed", 0))
    except (OSError, LookupError, TypeError, ValueError, AttributeError, McapError) as error:
        raise InputError(
            f"{folder}: no flight can be read ({error}). Give the folder of a flight's logs."
        ) from error
    warnings = tuple(
        str(record.values.get("text", ""))
        for record in log.get(EVENT.topic, ())
        if record.values.get("severity") != "info"
    )
    completed = bool(result.get("completed", False))
    figures = figures_of(data, scored_s)
    if not completed:
        lost = math.inf
        figures = type(figures)(lost, lost, lost, lost, figures.wind_peak_m_s2)
    began_s = math.nan if scored_s is None else scored_s[0]
    return Flight(
        outcome=str(result.get("outcome", UNFINISHED)),
        completed=completed,
        note=str(result.get("note") or ""),
        warnings=warnings,
        trajectory=_trajectory_name(mission.get("trajectory")),
        controller=str(mission.get("controller", "")),
        vehicle=str(mission.get("vehicle", "")),
        wind="" if mission.get("connect") is not None else str(mission.get("wind", "")),
        seed=seed,
        scored_s=scored_s,
        figures=figures,
        ticks=ticks_of(data, began_s),
        truth=truth_of(data, began_s),
        folder=folder,
        data=data,
    )


def _result_object(folder: Path) -> Mapping[str, Any] | None:
    """What `result.json` says; None if there is none."""
    path = folder / RESULT_NAME
    if not path.is_file():
        return None
    found = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(found, dict):
        raise ValueError(f"{path} is not a result")
    return found


def _trajectory_name(trajectory: object) -> str:
    if isinstance(trajectory, int) and trajectory in TEST_TRAJECTORIES:
        return TEST_TRAJECTORIES[trajectory].name
    return "" if trajectory is None else str(trajectory)
