"""A recorded flight, back from its folder."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError

from companion.api.errors import InputError
from companion.api.flight import Flight, figures_of, ticks_of, truth_of
from companion.flight.records import CONFIGURATION, EVENT, INPUT
from companion.flight.setpoints.inputs import ENGAGE
from companion.recording.flight_log import MCAP_NAME, recovered_first
from companion.recording.mcap_log import read_records
from companion.report import flight_data
from companion.report.cut_off import UNFINISHED
from companion.report.result import RESULT_NAME
from companion.report.scored_interval import scored_interval_s
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
        data = flight_data.read_flight(folder)
        told = _told(folder)
        result = _result_object(folder)
    except (OSError, ValueError, McapError) as error:
        raise InputError(
            f"{folder}: no flight can be read ({error}). Give the folder of a flight's logs."
        ) from error
    mission = told.configuration.get("mission", {})
    scored_s = scored_interval_s(told.engagement, mission.get("trajectory"))
    completed = bool(result.get("completed", False))
    figures = figures_of(data, scored_s)
    if not completed:
        lost = math.inf
        figures = type(figures)(lost, lost, lost, lost, figures.wind_peak_m_s2)
    began_s = math.nan if scored_s is None else scored_s[0]
    return Flight(
        outcome=str(result.get("outcome", UNFINISHED)),
        completed=completed,
        note=str(result.get("note", "The log has no result: the flight was cut off, or goes on.")),
        warnings=told.warnings,
        trajectory=_trajectory_name(mission.get("trajectory")),
        controller=str(mission.get("controller", "")),
        vehicle=str(mission.get("vehicle", "")),
        wind="" if mission.get("connect") is not None else str(mission.get("wind", "")),
        seed=int(mission.get("seed", 0)),
        scored_s=scored_s,
        figures=figures,
        ticks=ticks_of(data, began_s),
        truth=truth_of(data, began_s),
        folder=folder,
        data=data,
    )


class _Told:
    """What the records say beside the ticks."""

    def __init__(self) -> None:
        self.configuration: Mapping[str, Any] = {}
        self.engagement: Mapping[str, Any] | None = None
        """The last: what is scored is what was flown after it."""
        self.texts: list[str] = []

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a person was warned of."""
        return tuple(self.texts)


def _told(folder: Path) -> _Told:
    told = _Told()
    for record in read_records(recovered_first(folder / MCAP_NAME)):
        values = record.values
        if record.topic == CONFIGURATION.topic:
            told.configuration = values
        elif record.topic == INPUT.topic and values.get("kind") == ENGAGE:
            told.engagement = values["values"]
        elif record.topic == EVENT.topic and values.get("severity") != "info":
            told.texts.append(str(values.get("text", "")))
    return told


def _result_object(folder: Path) -> Mapping[str, Any]:
    """What `result.json` says; nothing if there is none."""
    path = folder / RESULT_NAME
    if not path.is_file():
        return {}
    found = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(found, dict):
        raise ValueError(f"{path} is not a result")
    return found


def _trajectory_name(trajectory: object) -> str:
    if isinstance(trajectory, int) and trajectory in TEST_TRAJECTORIES:
        return TEST_TRAJECTORIES[trajectory].name
    return "" if trajectory is None else str(trajectory)
