"""The command line: parse, call, show.  What a command does is in the rooms below."""

import io
import sys
from typing import Annotated

import typer

from companion.cli.campaign import campaign
from companion.cli.certify import certify
from companion.cli.check import check
from companion.cli.compare import compare
from companion.cli.faults import faults
from companion.cli.fly import fly
from companion.cli.identify import identify
from companion.cli.logs import recover, replay
from companion.cli.mocap import mocap
from companion.cli.paper import paper
from companion.cli.report import report
from companion.cli.running import abort, land, resume
from companion.cli.tune import tune

app = typer.Typer(
    name="companion",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


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


for command in (
    fly,
    check,
    mocap,
    identify,
    tune,
    certify,
    paper,
    compare,
    campaign,
    report,
    faults,
    replay,
    recover,
    land,
    abort,
    resume,
):
    app.command()(command)


def main() -> None:
    """Entry point of the console script."""
    for stream in (sys.stdout, sys.stderr):
        # A terminal that can't show a "°" shows a "?" instead; that must not end a flight.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    app(prog_name="companion")
