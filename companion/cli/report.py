"""``companion report`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion, options
from companion.cli.common import bad_input


def report(
    folder: Annotated[
        Path,
        typer.Argument(
            help="A campaign's folder, or a flight's; finished or not.",
            metavar="DIR",
            autocompletion=completion.reported,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Of a campaign: folder of report.html and the tables; by default DIR/report.",
            metavar="DIR",
        ),
    ] = None,
    json_output: options.JsonOutput = False,
) -> None:
    """Report on a campaign, or on one flight: did it track, where does it break, what hurts most?

    Of a flight it draws the pictures and writes report.html beside the logs once more; of one that
    was cut off for the first time, as far as its log goes.

    Exit status: 0 done, whatever the flights did; 2 neither's folder, or nothing flown yet.
    """
    from companion.commands.report import ReportRequest, run_report
    from companion.config.yaml_source import ConfigError
    from companion.experiments.flight_store import MissingExtraError

    try:
        run_report(ReportRequest(folder, out, json_output))
    except (ConfigError, MissingExtraError, OSError) as error:
        raise bad_input(error) from error
