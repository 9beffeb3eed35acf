"""``companion faults`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion, options
from companion.cli.common import ExitStatus, bad_input, tell_error


def faults(
    table: Annotated[
        Path | None,
        typer.Argument(help="The table; by default the shipped one.", metavar="TABLE.yaml"),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="Rows by name, or by a part of it. May be repeated.",
            metavar="ROW",
            autocompletion=completion.fault_rows,
        ),
    ] = None,
    autopilot: Annotated[
        str,
        typer.Option(
            help="px4, ardupilot, or both.",
            metavar="NAME",
            autocompletion=completion.one_of(("px4", "ardupilot", "both")),
        ),
    ] = "both",
    jobs: Annotated[
        int | None, typer.Option(help="Processes; by default one for each processor.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of each flight.")] = 1,
    out: Annotated[
        Path,
        typer.Option(
            help="Folder of faults.html, faults.json, and of the logs of flights that failed.",
            metavar="DIR",
        ),
    ] = Path("faults"),
    json_output: options.JsonOutput = False,
) -> None:
    """Fly the table of faults in lockstep: does each hurt flight end as promised?

    Exit status: 0 every row passed, 1 one failed, 2 bad input, 4 interrupted.
    """
    from companion.commands.faults import FaultsRequest, run_faults
    from companion.config.yaml_source import ConfigError
    from companion.experiments.faults.study import StudyInterruptedError
    from companion.experiments.flight_store import MissingExtraError

    request = FaultsRequest(table, tuple(only or ()), autopilot, jobs, seed, out, json_output)
    try:
        kept = run_faults(request)
    except (ConfigError, MissingExtraError, OSError) as error:
        raise bad_input(error) from error
    except StudyInterruptedError as error:
        tell_error(error)
        raise typer.Exit(ExitStatus.ABORTED) from error
    raise typer.Exit(0 if kept else 1)
