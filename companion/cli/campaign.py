"""``companion campaign`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion, options
from companion.cli.common import ExitStatus, bad_input, tell_error


def campaign(
    file: Annotated[
        str,
        typer.Argument(
            help="The campaign: a YAML file, or a shipped one: robustness, grid, map, brief; with "
            "--point also the folder of one that was flown.",
            metavar="FILE",
            autocompletion=completion.campaigns,
        ),
    ],
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="Fly on a running Dask cluster in place of processes here. For instance "
            "tcp://192.168.1.5:8786.",
            metavar="ADDRESS",
        ),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(help="Processes; by default one for each processor.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the results, by default campaigns/NAME; with --point, of its log.",
            metavar="DIR",
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Go on with what was begun in the folder."),
    ] = False,
    anew: Annotated[
        bool,
        typer.Option(
            "--anew",
            help="With --resume: fly again what other code flew; its rows are kept in before-1/.",
        ),
    ] = False,
    point: Annotated[
        int | None,
        typer.Option(
            help="Fly this one point of the campaign again, with its full log.", metavar="N"
        ),
    ] = None,
    json_output: options.JsonOutput = False,
) -> None:
    """Fly many simulated flights over sampled parameters; results.parquet has a row for each.

    Killed or stopped at any moment, it goes on with --resume, and flies nothing twice. A flight
    that crashes is a result.

    Exit status: 0 done, 1 some flights could not be flown (--resume tries them again), 2 bad input,
    or not one flight could be flown, 4 interrupted.
    """
    from companion.commands.campaign import CampaignRequest, run_campaign_file
    from companion.config.yaml_source import ConfigError
    from companion.experiments.campaign import CampaignInterruptedError
    from companion.experiments.flight_store import MissingExtraError
    from companion.recording.flight_log import FlightLogError

    request = CampaignRequest(file, scheduler, jobs, out, resume, point, json_output, anew)
    try:
        all_flown = run_campaign_file(request)
    except (ConfigError, MissingExtraError, FlightLogError, OSError) as error:
        raise bad_input(error) from error
    except CampaignInterruptedError as error:
        tell_error(error)
        raise typer.Exit(ExitStatus.ABORTED) from error
    raise typer.Exit(0 if all_flown else 1)
