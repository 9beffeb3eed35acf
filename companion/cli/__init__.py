"""The command line: parse, call, show.  What a command does is in the rooms below."""

import io
import os
import sys
from collections.abc import Callable
from typing import Annotated

import typer

from companion.cli import bash_words
from companion.cli.campaign import campaign
from companion.cli.certify import certify
from companion.cli.check import check
from companion.cli.compare import compare
from companion.cli.doctor import doctor
from companion.cli.examples import ABOUT, ROOT_EPILOG, epilog
from companion.cli.export import export
from companion.cli.faults import faults
from companion.cli.fly import fly
from companion.cli.help import GroupedHelp
from companion.cli.identify import identify
from companion.cli.live import live
from companion.cli.logs import recover, replay
from companion.cli.mocap import mocap
from companion.cli.new import new
from companion.cli.paper import paper
from companion.cli.report import report
from companion.cli.running import abort, land, resume
from companion.cli.schema import schema
from companion.cli.tune import tune

app = typer.Typer(
    name="companion",
    cls=GroupedHelp,
    epilog=ROOT_EPILOG,
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


COMMANDS: tuple[Callable[..., None], ...] = (
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
    live,
    export,
    new,
    schema,
    doctor,
    land,
    abort,
    resume,
)
"""`companion.cli.examples` has the order in which they are listed, and the ends of their helps."""


def _register() -> None:
    order = list(ABOUT)
    for command in sorted(
        COMMANDS,
        key=lambda one: order.index(one.__name__) if one.__name__ in ABOUT else len(order),
    ):
        about = ABOUT.get(command.__name__)
        app.command(
            short_help=None if about is None else about.short,
            rich_help_panel=None if about is None else about.panel,
            epilog=epilog(command.__name__),
        )(command)


_register()


def main() -> None:
    """Entry point of the console script."""
    for stream in (sys.stdout, sys.stderr):
        # A terminal that can't show a "°" shows a "?" instead; that must not end a flight.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    bash_words.run(lambda: app(prog_name="companion"), os.environ)
