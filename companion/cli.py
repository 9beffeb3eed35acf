"""The command line: parse, call, show.  What a command does is in the rooms below."""

import io
import sys
from enum import IntEnum
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    name="companion",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


class ExitStatus(IntEnum):
    """What the exit status says."""

    LANDED = 0
    BAD_INPUT = 2
    REFUSED = 3
    ABORTED = 4


def _show_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"companion {version('companion')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Fly a drone along a trajectory with MPC and L1 adaptive control, over MAVLink."""


@app.command()
def fly(
    traj: Annotated[
        str | None,
        typer.Option(help="Trajectory: 1 … 5, or a CSV (t,x,y,z) or YAML file.", metavar="N|FILE"),
    ] = None,
    controller: Annotated[
        str | None, typer.Option(help="Controller by name, or its YAML file.", metavar="NAME|FILE")
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option(help="Vehicle by name, or its YAML file.", metavar="NAME|FILE")
    ] = None,
    wind: Annotated[
        str | None,
        typer.Option(
            help="Wind of the embedded shim: calm, fan, gusts, wind3, or a scenario's YAML file.",
            metavar="NAME|FILE",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of all noise of the embedded shim.")
    ] = None,
    autopilot: Annotated[
        str | None, typer.Option(help="Autopilot's kind: px4.", metavar="NAME")
    ] = None,
    mission: Annotated[
        Path | None, typer.Option(help="Mission as YAML; options win over it.", metavar="FILE")
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="Set a key of the mission, or of the controller or vehicle by controller.KEY or "
            "vehicle.KEY. May be repeated.",
            metavar="KEY=VALUE",
        ),
    ] = None,
    connect: Annotated[
        str | None,
        typer.Option(
            help="Fly a real autopilot over this link; nothing is started. For instance "
            "udpin://127.0.0.1:14540.",
            metavar="URL",
        ),
    ] = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Simulated time, as fast as the computer can.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the flight's files; by default a new one in flights/."),
    ] = None,
    json_output: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else.")
    ] = False,
    verbose: Annotated[bool, typer.Option("-v", "--verbose", help="Show every message.")] = False,
) -> None:
    """Fly a trajectory: start the shim (or connect), arm, take off, track, land, and report.

    Exit status: 0 landed, 2 bad input, 3 refused by a check, 4 aborted safely.
    Ctrl-C lands; a second Ctrl-C hands over to the autopilot at once.
    """
    from companion.fly_command import BadInputError, FlyRequest, run_fly

    options = {
        "trajectory": _number_or_text(traj),
        "controller": controller,
        "vehicle": vehicle,
        "wind": wind,
        "seed": seed,
        "autopilot": autopilot,
        "connect": connect,
    }
    request = FlyRequest(
        mission_file=mission,
        overrides={key: value for key, value in options.items() if value is not None},
        settings=tuple(setting or ()),
        lockstep=lockstep,
        out=out,
        json_output=json_output,
        verbose=verbose,
    )
    try:
        outcome = run_fly(request)
    except BadInputError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(ExitStatus.BAD_INPUT) from error
    raise typer.Exit(
        {
            "landed": ExitStatus.LANDED,
            "refused": ExitStatus.REFUSED,
            "aborted": ExitStatus.ABORTED,
        }[outcome]
    )


def _number_or_text(text: str | None) -> int | str | None:
    try:
        return None if text is None else int(text)
    except ValueError:
        return text


_Pid = Annotated[int | None, typer.Option(help="Process id of the flight, if several are running.")]


@app.command()
def land(pid: _Pid = None) -> None:
    """Let a running flight land where it is."""
    _command("land", pid)


@app.command()
def abort(pid: _Pid = None) -> None:
    """Let a running flight stop commanding at once: the autopilot's failsafe takes over."""
    _command("abort", pid)


@app.command()
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
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(ExitStatus.BAD_INPUT) from error


def main() -> None:
    """Entry point of the console script."""
    for stream in (sys.stdout, sys.stderr):
        # A terminal that can't show a "°" shows a "?" instead; that must not end a flight.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    app(prog_name="companion")
