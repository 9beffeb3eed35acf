"""``companion live`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion
from companion.cli.common import bad_input


def live(
    log: Annotated[
        Path,
        typer.Argument(
            help="A flight's folder, whole or cut off.",
            metavar="LOG",
            autocompletion=completion.logs,
        ),
    ],
    port: Annotated[int, typer.Option(help="Port of the page; 0 takes any.", min=0, max=65535)] = 0,
    host: Annotated[
        str,
        typer.Option(
            help="Address to serve it at; another one than this computer's own lets others in the "
            "network look on.",
            metavar="ADDRESS",
        ),
    ] = "127.0.0.1",
) -> None:
    """Show a recorded flight on a page in the browser, with a slider for the time.

    It is served until Ctrl-C.  While a flight flies, `companion fly --live` shows it.
    """
    from companion.commands.live import BadInputError, LiveRequest, run_live
    from companion.live.beside import PageOptions

    try:
        run_live(LiveRequest(log, PageOptions(host, port)))
    except BadInputError as error:
        raise bad_input(error) from error
