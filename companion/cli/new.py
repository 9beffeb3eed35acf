"""``companion new`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion, options
from companion.cli.common import bad_input, number_or_text

_KINDS = ("mission", "controller", "vehicle", "trajectory", "scenario", "faults", "campaign")


def new(
    kind: Annotated[
        str,
        typer.Argument(
            help=f"What to begin: {', '.join(_KINDS)}.",
            metavar="KIND",
            autocompletion=completion.one_of(_KINDS),
        ),
    ],
    file: Annotated[
        Path | None,
        typer.Argument(
            help="The file to write; by default KIND.yaml. A trajectory may be a .csv, too.",
            metavar="[FILE]",
        ),
    ] = None,
    traj: options.Trajectory = None,
    controller: options.Controller = None,
    vehicle: options.Vehicle = None,
    wind: options.Wind = None,
    base: Annotated[
        str | None,
        typer.Option(
            "--from",
            help="Shipped file whose values are taken: of a controller, vehicle, scenario, faults "
            "or campaign.",
            metavar="NAME",
        ),
    ] = None,
) -> None:
    """Write a commented YAML file to begin with: every key, its meaning, unit and default.

    It can be used at once. A file that is there already is never overwritten.

    Exit status: 0 written, 2 bad input.
    """
    from companion.commands.new import NewRequest, run_new
    from companion.config.yaml_source import ConfigError

    request = NewRequest(kind, file, number_or_text(traj), controller, vehicle, wind, base)
    try:
        run_new(request)
    except (ConfigError, OSError) as error:
        raise bad_input(error) from error
