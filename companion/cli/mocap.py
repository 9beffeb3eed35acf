"""``companion mocap`` on the command line."""

from typing import Annotated

import typer

from companion.cli import options
from companion.cli.common import ExitStatus, bad_input


def mocap(
    connect: Annotated[
        str | None,
        typer.Option(
            help="Link to the autopilot, for instance udpin://127.0.0.1:14540.", metavar="URL"
        ),
    ] = None,
    mocap: options.MocapSystem = None,
    mission: options.Mission = None,
    setting: options.Settings = None,
    signing_key_file: options.SigningKeyFile = None,
) -> None:
    """Give an autopilot the poses of a motion-capture system, and fly nothing.

    Exit status: 0 interrupted, 2 bad input, 4 the link was lost.
    """
    from companion.commands.mocap import BadInputError, MocapRequest, run_mocap

    request = MocapRequest(
        mission_file=mission,
        overrides={} if connect is None else {"connect": connect},
        settings=(*(setting or ()), *(() if mocap is None else (f"mocap.system={mocap}",))),
        signing_key_file=signing_key_file,
    )
    try:
        run_mocap(request)
    except BadInputError as error:
        raise bad_input(error) from error
    except KeyboardInterrupt:
        return
    raise typer.Exit(ExitStatus.ABORTED)
