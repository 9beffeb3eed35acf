"""What becomes of a flight's logs right after it: figures, picture, `result.json`, its page."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from mcap.exceptions import McapError

from companion.config.resolve import FlightConfig
from companion.flight.conduct import Outcome
from companion.report.flight_data import FlightData, read_flight
from companion.report.metrics import tracking_figures
from companion.report.recovery import GOOD, event_object
from companion.report.result import result_object, write_result

if TYPE_CHECKING:
    from companion.report.flight_page.story import Story
    from companion.report.pages.provenance import Provenance

_TROUBLES = (OSError, ValueError, McapError, MemoryError, ImportError, RuntimeError)
"""Without memory a library can't be loaded, or a thread not be started."""


def score_and_draw(
    config: FlightConfig,
    outcome: Outcome,
    folder: Path,
    wall_s: float,
    page: "Provenance | None" = None,
) -> tuple[dict[str, Any], str | None]:
    """Make the result and write it beside the logs, with `track.png`.

    A flight during which a scenario's event happened gets `recovery.png` as well.

    Whatever is wrong with the files (a full disk, say), or missing to draw them (memory), the
    flight was flown and has a result.

    Args:
        config: mission, vehicle, controller.
        outcome: of the flight.
        folder: of its logs.
        wall_s: how long the flight took.
        page: where the flight comes from, to write `report.html`; None for no page.

    Returns:
        The result, and what could not be read or written, if anything.
    """
    figures = None
    happened: dict[str, Any] | None = None
    story: Story | None = None
    trouble: Exception | None = None
    if outcome.scored_s is not None or page is not None:
        try:
            data, story = _read(folder, with_story=page is not None)
            if outcome.scored_s is not None:
                figures = tracking_figures(data, outcome.scored_s)
                lost = outcome.outcome not in GOOD
                happened = event_object(data, outcome.scored_s, lost=lost)
                draw(config, data, outcome.scored_s, folder, lost=lost)
        except _TROUBLES as error:
            trouble = error
    result = result_object(
        config.mission, outcome, figures, wall_s=wall_s, log_dir=folder.resolve(), event=happened
    )
    if page is not None:
        result["command"] = page.command
    try:
        write_result(folder, result)
    except OSError as error:
        trouble = error
    if page is not None:
        said = "" if trouble is None else _say(trouble)
        trouble = _write_page(config, outcome, result, story, said, page, folder) or trouble
    return result, None if trouble is None else _say(trouble)


def _read(folder: Path, *, with_story: bool) -> "tuple[FlightData, Story | None]":
    """The flight, and what its page tells beside, if there will be one."""
    if not with_story:
        return read_flight(folder), None
    from companion.report.flight_page.story import read_story

    story = read_story(folder)
    return story.data, story


def _write_page(
    config: FlightConfig,
    outcome: Outcome,
    result: dict[str, Any],
    story: "Story | None",
    trouble: str,
    made: "Provenance",
    folder: Path,
) -> Exception | None:
    """Write `report.html`; what was in its way."""
    try:
        from companion.report.flight_page.page import FlightPage, write_page

        write_page(FlightPage(config, result, outcome.scored_s, story, trouble, made), folder)
    except Exception as error:  # whatever it is: the flight has its result
        return error
    return None


def _say(trouble: Exception) -> str:
    return str(trouble) or type(trouble).__name__


def draw(
    config: FlightConfig,
    data: FlightData,
    scored_s: tuple[float, float],
    folder: Path,
    *,
    lost: bool,
) -> None:
    """Draw `track.png`, and `recovery.png` where a scenario's event happened.

    Args:
        config: mission, vehicle, controller.
        data: of the flight.
        scored_s: autopilot's times between which tracking is scored.
        folder: where the pictures go.
        lost: the flight failed.

    Raises:
        OSError: they can't be written.
    """
    from companion.report.figure import draw_flight
    from companion.report.recovery_figure import draw_recoveries, flight_curve

    mission = config.mission
    title = f"Trajectory {mission.trajectory}, {mission.controller}, {mission.vehicle}"
    if mission.connect is None:
        title += f", wind {mission.wind}, seed {mission.seed}"
    draw_flight(data, scored_s, title, folder / "track.png", config.vehicle.tilt_limit_deg)
    found = flight_curve(data, scored_s, mission.controller, lost=lost)
    if found is not None:
        event, curve = found
        draw_recoveries([curve], f"{event}: {title}", folder / "recovery.png")
