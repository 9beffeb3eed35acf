"""What ``companion report`` does: read a campaign's folder, or a flight's, and write its page."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from companion.commands.report_flight import FlightReportRequest, flight_folder, run_flight_report
from companion.config.yaml_source import ConfigError
from companion.experiments.campaign_report.page import write_page
from companion.experiments.campaign_report.read import read_campaign
from companion.experiments.campaign_report.report import make_report
from companion.experiments.campaign_report.terminal import tell
from companion.experiments.campaign_report.written import report_object, write_tables

_FOLDER = "report"
_WIDTH = 80


@dataclass(frozen=True, slots=True)
class ReportRequest:
    """The options of the command line."""

    folder: Path
    """Of a campaign, or of a flight."""
    out: Path | None = None
    """Of a campaign's report; by default the folder `report` in the campaign's."""
    json_output: bool = False


def run_report(request: ReportRequest) -> None:
    """Make a campaign's report, or a flight's.

    Args:
        request: what is asked for.

    Raises:
        ConfigError: the folder is neither's, nothing was flown yet, or a log can't be read.
        MissingExtraError: a library of the extra `study` is not installed.
        OSError: the folder can't be read, or the report not be written.
    """
    flight = flight_folder(request.folder)
    if flight is not None:
        if request.out is not None:
            raise ConfigError(
                f"{flight} is a flight's folder: its page lies beside its logs, to which "
                "it links. Leave --out out."
            )
        run_flight_report(FlightReportRequest(flight, request.json_output))
        return
    report = make_report(read_campaign(request.folder))
    folder = request.folder / _FOLDER if request.out is None else request.out
    tables = write_tables(report, folder)
    page = write_page(report, report.draw(), tables, folder)
    if request.json_output:
        said = report_object(report, [page, *tables])
        sys.stdout.write(json.dumps(said, ensure_ascii=False, allow_nan=False) + "\n")
        return
    width = None if sys.stdout.isatty() else _WIDTH
    tell(Console(file=sys.stdout, width=width), report, page)
