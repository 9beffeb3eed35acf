"""What ``companion report`` does with the folder of a flight: its page, once more or at last."""

import json
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.text import Text

from companion.config.yaml_source import ConfigError
from companion.experiments.provenance import commit, version
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME, recovered_first
from companion.report.again import report_flight
from companion.report.pages.provenance import Provenance
from companion.report.summary import print_summary

_WIDE = 1000


@dataclass(frozen=True, slots=True)
class FlightReportRequest:
    """The options of the command line."""

    folder: Path
    json_output: bool = False


def flight_folder(path: Path) -> Path | None:
    """The folder of a flight, by itself or by one of its logs; None if it is something else."""
    folder = path.parent if path.name in (MCAP_NAME, TLOG_NAME) else path
    return folder if recovered_first(folder / MCAP_NAME).is_file() else None


def run_flight_report(request: FlightReportRequest) -> None:
    """Write a flight's page, and tell what is on top of it.

    Raises:
        ConfigError: the folder's log can't be read, is not one of this version, or the page can't
            be written there.
    """
    command = shlex.join(["companion", "report", str(request.folder)])
    try:
        made = report_flight(request.folder, Provenance(command, version(), commit()))
    except OSError as error:
        raise ConfigError(
            f"{error.filename or request.folder}: {error.strerror or error}. The page lies beside "
            "the logs: copy the folder to where you may write."
        ) from error
    if request.json_output:
        sys.stdout.write(json.dumps(made.result, ensure_ascii=False, allow_nan=False) + "\n")
        return
    width = None if sys.stdout.isatty() else _WIDE
    console = Console(file=sys.stdout, highlight=False, width=width)
    print_summary(console, dict(made.result))
    where = Text(f"{'page':<16}", style="dim").append(str(made.page), "not dim")
    console.print(where, soft_wrap=True)
