"""What becomes of a flight's logs right after it: figures, picture, `result.json`."""

from pathlib import Path
from typing import Any

from mcap.exceptions import McapError

from companion.config.resolve import FlightConfig
from companion.flight.conduct import Outcome
from companion.report.flight_data import FlightData, read_flight
from companion.report.metrics import tracking_figures
from companion.report.recovery import GOOD, event_object
from companion.report.result import result_object, write_result

_TROUBLES = (OSError, ValueError, McapError, MemoryError, ImportError, RuntimeError)
"""Without memory a library can't be loaded, or a thread not be started."""


def score_and_draw(
    config: FlightConfig, outcome: Outcome, folder: Path, wall_s: float
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

    Returns:
        The result, and what could not be read or written, if anything.
    """
    figures = None
    happened: dict[str, Any] | None = None
    trouble: Exception | None = None
    if outcome.scored_s is not None:
        try:
            data = read_flight(folder)
            figures = tracking_figures(data, outcome.scored_s)
            lost = outcome.outcome not in GOOD
            happened = event_object(data, outcome.scored_s, lost=lost)
            _draw(config, data, outcome.scored_s, folder, lost=lost)
        except _TROUBLES as error:
            trouble = error
    result = result_object(
        config.mission, outcome, figures, wall_s=wall_s, log_dir=folder.resolve(), event=happened
    )
    try:
        write_result(folder, result)
    except OSError as error:
        trouble = error
    return result, None if trouble is None else str(trouble) or type(trouble).__name__


def _draw(
    config: FlightConfig,
    data: FlightData,
    scored_s: tuple[float, float],
    folder: Path,
    *,
    lost: bool,
) -> None:
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
