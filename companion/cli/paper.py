"""``companion paper`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli.common import ExitStatus, bad_input, tell_error


def paper(
    quick: Annotated[
        bool, typer.Option("--quick", help="One seed and a shorter sweep: no spread is claimed.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the study; by default paper, or paper-quick. What was flown there and "
            "has not changed since is not flown again.",
            metavar="DIR",
        ),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(help="Processes; by default one for each processor.")
    ] = None,
) -> None:
    """Fly the paper's experiments in lockstep, and judge its claims by what was found.

    Writes report.html, each figure as PNG and SVG, results.json, and every flight as Parquet.

    Exit status: 0 done, whatever the verdicts; 2 bad input, 4 interrupted.
    """
    from companion.commands.paper import PaperRequest, run_paper
    from companion.config.yaml_source import ConfigError
    from companion.experiments.campaign import CampaignInterruptedError
    from companion.experiments.flight_store import MissingExtraError

    try:
        run_paper(PaperRequest(quick, out, jobs))
    except (ConfigError, MissingExtraError, OSError) as error:
        raise bad_input(error) from error
    except CampaignInterruptedError as error:
        tell_error(error)
        raise typer.Exit(ExitStatus.ABORTED) from error
