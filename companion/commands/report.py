"""What ``companion report`` does: read a campaign's folder, work it out, write, tell."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from companion.experiments.campaign_report.page import write_page
from companion.experiments.campaign_report.read import read_campaign
from companion.experiments.campaign_report.report import make_report
from companion.experiments.campaign_report.terminal import tell
from companion.experiments.campaign_report.written import report_object, write_tables
from companion.experiments.flight_store import need_pyarrow

_FOLDER = "report"
_WIDTH = 80


@dataclass(frozen=True, slots=True)
class ReportRequest:
    """The options of the command line."""

    campaign: Path
    out: Path | None = None
    """By default the folder `report` in the campaign's."""
    json_output: bool = False


def run_report(request: ReportRequest) -> None:
    """Make a campaign's report.

    Args:
        request: what is asked for.

    Raises:
        ConfigError: the folder is no campaign's, or nothing was flown yet.
        MissingExtraError: a library of the extra `study` is not installed.
        OSError: the folder can't be read, or the report not be written.
    """
    need_pyarrow()
    report = make_report(read_campaign(request.campaign))
    folder = request.campaign / _FOLDER if request.out is None else request.out
    tables = write_tables(report, folder)
    page = write_page(report, report.draw(), tables, folder)
    if request.json_output:
        said = report_object(report, [page, *tables])
        sys.stdout.write(json.dumps(said, ensure_ascii=False, allow_nan=False) + "\n")
        return
    width = None if sys.stdout.isatty() else _WIDTH
    tell(Console(file=sys.stdout, width=width), report, page)
