"""``companion replay`` and ``companion recover`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion, options
from companion.cli.common import bad_input


def replay(
    log: Annotated[
        Path,
        typer.Argument(
            help="A flight's folder, or one of its two files.",
            metavar="LOG",
            autocompletion=completion.logs,
        ),
    ],
    controller: Annotated[
        str | None,
        typer.Option(
            help="Ask what this controller would have sent: by name, or its YAML file.",
            metavar="NAME|FILE",
            autocompletion=completion.controllers,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for replay.json and replay.png; by default the flight's.", metavar="DIR"
        ),
    ] = None,
    json_output: options.JsonOutput = False,
) -> None:
    """Feed a recorded flight's inputs through the controller again, and compare each setpoint.

    Exit status: 0 every setpoint is the same, bit for bit, or another controller was asked for;
    1 one differs; 2 bad input.
    """
    from companion.commands.replay import BadInputError, ReplayRequest, run_replay

    try:
        status = run_replay(ReplayRequest(log, controller, json_output, out))
    except BadInputError as error:
        raise bad_input(error) from error
    raise typer.Exit(status)


def recover(
    log: Annotated[
        Path,
        typer.Argument(
            help="A log (.tlog or .mcap), or a flight's folder.",
            metavar="LOG",
            autocompletion=completion.logs,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="The file to write; by default beside the log, with .recovered in its name.",
            metavar="FILE",
        ),
    ] = None,
) -> None:
    """Save what is whole of a log that was cut off or damaged; the original stays as it is.

    Exit status: 0 recovered, or whole already; 1 nothing in it is whole; 2 bad input.
    """
    from companion.commands.recover import RecoverRequest, run_recover

    raise typer.Exit(run_recover(RecoverRequest(log, out)))
