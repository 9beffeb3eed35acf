"""``companion identify`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion, options
from companion.cli.common import ExitStatus, bad_input


def identify(
    connect: Annotated[
        str | None,
        typer.Option(
            help="Identify a real vehicle over this link; by default the embedded shim's.",
            metavar="URL",
        ),
    ] = None,
    vehicle: options.Vehicle = None,
    autopilot: options.Autopilot = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the vehicle's file, the controllers' files, the figure and the log; "
            "by default a new one in flights/.",
            metavar="DIR",
        ),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(
            help="Fly nothing: identify from the log of such a flight once more.",
            metavar="DIR",
            autocompletion=completion.logs,
        ),
    ] = None,
    box: Annotated[
        float | None,
        typer.Option(
            help="It stays within this of the hover point, or lands.  [default: 2.5]", metavar="M"
        ),
    ] = None,
    height: Annotated[
        float | None,
        typer.Option(help="Of the hover point above the ground.  [default: 2.5]", metavar="M"),
    ] = None,
    name: Annotated[
        str | None, typer.Option(help="What the files call the vehicle.", metavar="NAME")
    ] = None,
    wind: options.Wind = None,
    sensors: options.Sensors = None,
    mocap: options.MocapSystem = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of all noise of the embedded shim.")
    ] = None,
    mission: options.Mission = None,
    setting: options.Settings = None,
    system_id: options.SystemId = None,
    signing_key_file: options.SigningKeyFile = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Simulated time, as fast as the computer can.")
    ] = False,
    json_output: options.JsonOutput = False,
    verbose: Annotated[bool, typer.Option("-v", "--verbose", help="Show every message.")] = False,
) -> None:
    """Fly a short excitation about a hover; write the vehicle's file and gains that suit it.

    About a minute in the air, within a box: steps of roll, pitch, thrust and climb rate, and a
    swing, over a weak hold. Outside the box it lands by itself. Ctrl-C lands, too.

    Exit status: 0 identified, 1 identified but the gains are not certified, 2 bad input, 3 refused
    by a check, 4 aborted safely, or not to be identified.
    """
    from companion.commands.identify import BadInputError, IdentifyRequest, run_identify

    chosen = {
        "vehicle": vehicle,
        "autopilot": autopilot,
        "wind": wind,
        "sensors": sensors,
        "seed": seed,
        "connect": connect,
    }
    request = IdentifyRequest(
        mission_file=mission,
        overrides={key: value for key, value in chosen.items() if value is not None},
        settings=(
            *(setting or ()),
            *((f"link.system_id={system_id}",) if system_id is not None else ()),
            *((f"mocap.system={mocap}",) if mocap is not None else ()),
        ),
        log=log,
        name=name,
        box_m=box,
        height_m=height,
        lockstep=lockstep,
        out=out,
        json_output=json_output,
        verbose=verbose,
        signing_key_file=signing_key_file,
    )
    try:
        verdict = run_identify(request)
    except BadInputError as error:
        raise bad_input(error) from error
    raise typer.Exit(
        {
            "identified": ExitStatus.LANDED,
            "uncertified": ExitStatus.NOT_CERTIFIED,
            "refused": ExitStatus.REFUSED,
            "aborted": ExitStatus.ABORTED,
            "unidentified": ExitStatus.ABORTED,
        }[verdict]
    )
