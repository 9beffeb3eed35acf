"""``companion report`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion, options
from companion.cli.common import bad_input


def report(
    campaign: Annotated[
        Path,
        typer.Argument(
            help="Folder that `companion campaign` wrote, finished or not.",
            metavar="CAMPAIGN_DIR",
            autocompletion=completion.campaign_folders,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of report.html and the Parquet tables; by default CAMPAIGN_DIR/report.",
            metavar="DIR",
        ),
    ] = None,
    json_output: options.JsonOutput = False,
) -> None:
    """Report on a campaign: did it track, where does it break, what hurts most?

    Exit status: 0 done, whatever the flights did; 2 no campaign's folder, or nothing flown yet.
    """
    from companion.commands.report import ReportRequest, run_report
    from companion.config.yaml_source import ConfigError
    from companion.experiments.flight_store import MissingExtraError

    try:
        run_report(ReportRequest(campaign, out, json_output))
    except (ConfigError, MissingExtraError, OSError) as error:
        raise bad_input(error) from error
