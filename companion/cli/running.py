"""``companion land``, ``abort`` and ``resume``: commands to a flight that is running."""

from typing import Annotated

import typer

from companion.cli import completion
from companion.cli.common import bad_input

_Pid = Annotated[
    int | None,
    typer.Option(
        help="Process id of the flight, if several are running.",
        metavar="PID",
        autocompletion=completion.running_flights,
    ),
]


def land(pid: _Pid = None) -> None:
    """Let a running flight land where it is."""
    _command("land", pid)


def abort(pid: _Pid = None) -> None:
    """Let a running flight stop commanding at once: the autopilot's failsafe takes over."""
    _command("abort", pid)


def resume(pid: _Pid = None) -> None:
    """Let a flight that was handed over take control again and fly its trajectory anew."""
    _command("resume", pid)


def _command(word: str, pid: int | None) -> None:
    import asyncio

    from companion.flight.command_socket import CommandSocketError, send_command
    from companion.flight.inbox import PilotCommand

    try:
        typer.echo(asyncio.run(send_command(PilotCommand(word), pid)))
    except CommandSocketError as error:
        raise bad_input(error) from error
