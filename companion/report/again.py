"""A flight's pictures and its page once more, from its folder alone: finished, or cut off."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError

from companion.config.resolve import FlightConfig
from companion.config.yaml_source import ConfigError
from companion.flight.configuration_record import recorded_configuration
from companion.flight.records import CONFIGURATION, INPUT
from companion.recording.flight_log import MCAP_NAME
from companion.recording.mcap_log import LogRecord
from companion.report.aftermath import draw
from companion.report.cut_off import cut_off_result
from companion.report.flight_data import flight_from_log, read_log
from companion.report.flight_page.page import FlightPage, write_page
from companion.report.flight_page.story import Story, story_of
from companion.report.pages.provenance import Provenance
from companion.report.recovery import GOOD
from companion.report.result import RESULT_NAME
from companion.report.scored_interval import engagement_of, scored_interval_s

_WITHOUT = "Take it away, and the page says what the log does."


@dataclass(frozen=True, slots=True)
class ReportedFlight:
    """What was made."""

    result: Mapping[str, Any]
    """As `result_object` makes it; of a flight without `result.json` what its log says."""
    page: Path


def report_flight(folder: Path, made: Provenance) -> ReportedFlight:
    """Draw a flight again, and write its `report.html` beside its logs.

    Args:
        folder: of the flight.
        made: by which command, and which program.

    Raises:
        ConfigError: its log can't be read, or is not one of this version.
        OSError: a picture or the page can't be written.
    """
    path = folder / MCAP_NAME
    try:
        log = read_log(folder)
        story = story_of(flight_from_log(log, folder), log)
        config = _configuration(path, log)
        scored_s = scored_interval_s(
            engagement_of(log.get(INPUT.topic, ())), config.mission.trajectory
        )
        result = _result(config, story, log, scored_s, folder)
    except ConfigError:
        raise
    except FileNotFoundError as error:
        raise ConfigError(f"{error.filename}: not there. Give a flight's whole folder.") from error
    except (McapError, ValueError, KeyError, TypeError, IndexError) as error:
        raise ConfigError(
            f"{path}: not the log of a flight of this version ({type(error).__name__}: {error}). "
            "`companion recover` saves what is whole of a damaged log."
        ) from error
    try:
        if scored_s is not None:
            lost = result["outcome"] not in GOOD
            draw(config, story.data, scored_s, folder, lost=lost)
        page = FlightPage(config, result, scored_s, story, "", made, again=True)
        return ReportedFlight(result, write_page(page, folder))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ConfigError(
            f"{folder / RESULT_NAME}: not what this version writes ({type(error).__name__}: "
            f"{error}). {_WITHOUT}"
        ) from error


def _configuration(path: Path, log: Mapping[str, Sequence[LogRecord]]) -> FlightConfig:
    told = log.get(CONFIGURATION.topic, ())
    if not told:
        raise ConfigError(f"{path}: it ends before a flight began. There is nothing to report.")
    return recorded_configuration(dict(told[0].values))


def _result(
    config: FlightConfig,
    story: Story,
    log: Mapping[str, Sequence[LogRecord]],
    scored_s: tuple[float, float] | None,
    folder: Path,
) -> dict[str, Any]:
    said_by_log = cut_off_result(config, story, log, scored_s, folder)
    path = folder / RESULT_NAME
    if not path.is_file():
        return said_by_log
    try:
        found = json.loads(path.read_text(encoding="utf-8"), parse_constant=_refuse)
    except ValueError as error:
        raise ConfigError(f"{path}: {error}. {_WITHOUT}") from error
    missing = set(said_by_log).difference(found if isinstance(found, dict) else ())
    if missing:
        raise ConfigError(
            f"{path}: not the result of a flight, it lacks {', '.join(sorted(missing))}. {_WITHOUT}"
        )
    return dict(found) | {"log_dir": said_by_log["log_dir"]}  # it may have been moved


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is no figure")
