"""``companion check`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import options
from companion.cli.common import ExitStatus, bad_input, number_or_text


def check(
    connect: Annotated[
        str | None,
        typer.Option(
            help="Check a real autopilot over this link; by default the embedded shim is checked.",
            metavar="URL",
        ),
    ] = None,
    autopilot: options.Autopilot = None,
    vehicle: options.Vehicle = None,
    traj: options.Trajectory = None,
    setpoint: options.SetpointKind = None,
    mission: options.Mission = None,
    setting: options.Settings = None,
    signing_key_file: options.SigningKeyFile = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Of the embedded shim: in simulated time.")
    ] = False,
    fix: Annotated[
        bool,
        typer.Option(
            "--fix", help="Set the parameters that it names, for good, and list what they were."
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="That list; by default restore-DATE.json, here.", metavar="FILE"),
    ] = None,
    restore: Annotated[
        Path | None,
        typer.Option(
            help="Set the parameters of such a list back, and do nothing else.", metavar="FILE"
        ),
    ] = None,
    json_output: options.JsonOutput = False,
) -> None:
    """Look a vehicle over before a flight: what was found, and what to do about it.

    It arms nothing, changes no mode, and sets nothing without --fix or --restore.

    Exit status: 0 fine, 1 warnings, 2 bad input, 3 something that a flight would be refused for,
    4 interrupted.
    """
    from companion.commands.check import BadInputError, CheckRequest, run_check

    chosen = {
        "trajectory": None if traj is None else number_or_text(traj),
        "vehicle": vehicle,
        "autopilot": autopilot,
        "setpoint": setpoint,
        "connect": connect,
    }
    request = CheckRequest(
        mission_file=mission,
        overrides={key: value for key, value in chosen.items() if value is not None},
        settings=tuple(setting or ()),
        lockstep=lockstep,
        fix=fix,
        restore=restore,
        out=out,
        json_output=json_output,
        signing_key_file=signing_key_file,
    )
    try:
        verdict = run_check(request)
    except BadInputError as error:
        raise bad_input(error) from error
    except KeyboardInterrupt as error:
        typer.echo("interrupted", err=True)
        raise typer.Exit(ExitStatus.ABORTED) from error
    raise typer.Exit(
        {
            "ok": ExitStatus.LANDED,
            "note": ExitStatus.LANDED,
            "warning": ExitStatus.NOT_CERTIFIED,
            "refusal": ExitStatus.REFUSED,
        }[verdict]
    )
