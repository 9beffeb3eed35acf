"""`report.html` of a flight: one page that needs nothing but itself."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from companion.config.resolve import FlightConfig
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME
from companion.recording.whole_file import write_whole
from companion.report.flight_page import NAME
from companion.report.flight_page.answer import WELL_MM, answer, find_peak, tracked_s
from companion.report.flight_page.findings import Limits, find
from companion.report.flight_page.story import Story
from companion.report.pages.provenance import Provenance
from companion.report.pages.templating import render_page
from companion.report.result import RESULT_NAME

_PACKAGE = "companion.report.flight_page"
_TEMPLATE = "flight.html.j2"
_FILES = (
    (RESULT_NAME, "the figures of this page's top, for machines"),
    (MCAP_NAME, "what the controller recorded at every tick: Foxglove, PlotJuggler"),
    (TLOG_NAME, "every MAVLink packet, raw: MAVExplorer, QGroundControl"),
    ("track.png", "the picture of the flight"),
    ("recovery.png", "the picture of what followed the scenario's event"),
)


@dataclass(frozen=True, slots=True)
class FlightPage:
    """What a page is made of."""

    config: FlightConfig
    result: Mapping[str, Any]
    """As `result_object` makes it."""
    scored_s: tuple[float, float] | None
    """Autopilot's times between which tracking is scored; None if it never began."""
    story: Story | None
    """None where the logs can't be read."""
    trouble: str
    """Why they can't, or what else is missing; empty for nothing."""
    made: Provenance
    again: bool = False
    """`made` says what makes the page again, and not what flies the flight again."""


def write_page(page: FlightPage, folder: Path) -> Path:
    """Write the page beside a flight's logs; takes about a second, most of it for the figures.

    Raises:
        OSError: it can't be written.
    """
    path = folder / NAME
    write_whole(path, render_page(_PACKAGE, _TEMPLATE, _context(page, folder)))
    return path


def _context(page: FlightPage, folder: Path) -> dict[str, Any]:
    result, mission, story = page.result, page.config.mission, page.story
    if story is not None:
        page = replace(page, scored_s=tracked_s(story.data, page.scored_s))
    limits = _limits(page.config)
    findings = () if story is None else find(story, result, limits)
    origin_s = _origin_s(page)
    shift_s = 0.0 if story is None else story.autopilot_ahead_s - origin_s
    files = [(name, says) for name, says in _FILES if (folder / name).is_file()]
    return {
        "glance": answer(result, story, page.scored_s, findings),
        "well_mm": WELL_MM,
        "heading": f"Trajectory {Path(str(mission.trajectory)).stem}, {mission.controller}",
        "lead": _lead(result),
        "findings": findings,
        "figures": _figures(page, limits, origin_s),
        "phases": () if story is None else story.phases,
        "messages": () if story is None else story.messages,
        "shift_s": shift_s,
        "began_s": story.phases[0].begin_s if story is not None and story.phases else 0.0,
        "since": "the trajectory's start" if page.scored_s else "the log's beginning",
        "is_scored": page.scored_s is not None,
        "files": files,
        "names": {name for name, _ in files},
        "folder": shlex.quote(_from_here(folder)),
        "result": result,
        "trouble": page.trouble,
        "made": page.made,
        "again": page.again,
        "made_by_log": {} if story is None else story.made_by,
    }


def _figures(page: FlightPage, limits: Limits, origin_s: float) -> tuple[object, ...]:
    story = page.story
    if story is None or len(story.data.ticks.time_s) < 2:
        return ()
    from companion.report.flight_page.drawing import Scene
    from companion.report.flight_page.figures import draw_figures

    since = "the trajectory's start" if page.scored_s else "the log's beginning"
    scene = Scene(
        story,
        page.scored_s,
        None if page.scored_s is None else find_peak(story.data, page.scored_s),
        limits,
        origin_s,
        f"time since {since}, s",
        page.result["latency_ms"] is not None,
    )
    return draw_figures(scene)


def _origin_s(page: FlightPage) -> float:
    """The autopilot's time from which the page counts."""
    if page.scored_s is not None:
        return page.scored_s[0]
    story = page.story
    if story is None or not story.phases:
        return 0.0
    return story.phases[0].begin_s + story.autopilot_ahead_s


def _limits(config: FlightConfig) -> Limits:
    vehicle = config.vehicle
    return Limits(
        vehicle.tilt_limit_deg,
        vehicle.minimum_thrust,
        vehicle.maximum_thrust,
        config.mission.supervisor.state_age_limit_s,
    )


def _lead(result: Mapping[str, Any]) -> str:
    under = f" under {result['autopilot']}" if result["autopilot"] else ""
    weather = "a real vehicle" if result["wind"] is None else f"wind {_stem(result['wind'])}"
    seed = "" if result["seed"] is None else f", seed {result['seed']}"
    time = "real time" if result["latency_ms"] is not None else "simulated time"
    lasted = f"; {result['flight_s']:.1f} s in {time}" if result["flight_s"] else ""
    return f"{_stem(result['vehicle'])}{under}, {weather}{seed}{lasted}."


def _stem(name: str) -> str:
    return Path(name).stem if name.endswith((".yaml", ".yml")) else name


def _from_here(folder: Path) -> str:
    """The folder as one would type it where the flight was begun."""
    whole, here = folder.resolve(), Path.cwd()
    return str(whole.relative_to(here)) if whole.is_relative_to(here) else str(whole)
