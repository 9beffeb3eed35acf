"""``companion certify`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion, options
from companion.cli.common import ExitStatus, bad_input


def certify(
    controller: Annotated[
        str,
        typer.Argument(
            help="L1 controller or mpc-l1-plus, or a YAML file.",
            metavar="NAME|FILE",
            autocompletion=completion.certifiable,
        ),
    ],
    vehicle: options.VehicleByDefault = "bebop2",
    rate: Annotated[
        float | None,
        typer.Option(help="Rate of the state's samples; 100 by default.", metavar="HZ"),
    ] = None,
    wind: Annotated[
        float,
        typer.Option(help="Largest wind that the drag's constant reckons with.", metavar="M/S"),
    ] = 4.5,
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="Set a key of the controller or the vehicle by controller.KEY or vehicle.KEY. "
            "May be repeated.",
            metavar="KEY=VALUE",
            autocompletion=completion.settings,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for certificate.json and certificate.png; by default nothing is written.",
            metavar="DIR",
        ),
    ] = None,
    json_output: options.JsonOutput = False,
) -> None:
    """Check an L1 controller on a vehicle's stated dynamics: stability, L1 norms, bounds, margins.

    Of MPC-L1+ also over a family of vehicles that are not the stated one.

    Exit status: 0 every condition holds, 1 one fails (its reason is told), 2 bad input.
    """
    from companion.commands.certify import BadInputError, CertifyRequest, run_certify

    request = CertifyRequest(
        controller, vehicle, rate, wind, tuple(setting or ()), out, json_output
    )
    try:
        holds = run_certify(request)
    except BadInputError as error:
        raise bad_input(error) from error
    raise typer.Exit(ExitStatus.LANDED if holds else ExitStatus.NOT_CERTIFIED)
