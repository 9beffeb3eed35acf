"""``companion fly`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import options
from companion.cli.common import ExitStatus, bad_input, number_or_text


def fly(
    traj: options.Trajectory = None,
    controller: options.Controller = None,
    vehicle: options.Vehicle = None,
    plant: Annotated[
        str | None,
        typer.Option(
            help="Plant file of the embedded shim, in place of the one of the vehicle's name: a "
            "vehicle of one's own.",
            metavar="FILE",
        ),
    ] = None,
    wind: options.Wind = None,
    faults: options.Faults = None,
    sensors: options.Sensors = None,
    mocap: options.MocapSystem = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of all noise of the embedded shim.")
    ] = None,
    autopilot: options.Autopilot = None,
    setpoint: options.SetpointKind = None,
    switch: options.Switch = None,
    mission: options.Mission = None,
    setting: options.Settings = None,
    connect: Annotated[
        str | None,
        typer.Option(
            help="Fly a real autopilot over this link; nothing is started. For instance "
            "udpin://127.0.0.1:14540.",
            metavar="URL",
        ),
    ] = None,
    system_id: options.SystemId = None,
    signing_key_file: options.SigningKeyFile = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Simulated time, as fast as the computer can.")
    ] = False,
    fix: Annotated[
        bool,
        typer.Option(
            "--fix",
            help="Set the autopilot's parameters that the check before the flight names, and set "
            "them back after landing.",
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the flight's files; by default a new one in flights/.", metavar="DIR"
        ),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Show the flight on a page in the browser meanwhile.")
    ] = False,
    live_port: Annotated[
        int, typer.Option(help="Port of that page; 0 takes any.", min=0, max=65535)
    ] = 0,
    live_host: Annotated[
        str,
        typer.Option(
            help="Address to serve it at; another one than this computer's own lets others in the "
            "network look on.",
            metavar="ADDRESS",
        ),
    ] = "127.0.0.1",
    json_output: options.JsonOutput = False,
    verbose: Annotated[bool, typer.Option("-v", "--verbose", help="Show every message.")] = False,
) -> None:
    """Fly a trajectory: start the shim (or connect), arm, take off, track, land, and report.

    Before arming it checks what `companion check` does; warnings are told, a refusal is final.

    Exit status: 0 landed, 2 bad input, 3 refused by a check, 4 aborted safely.
    Ctrl-C lands; a second Ctrl-C hands over to the autopilot at once. After somebody else has
    taken over, it leaves the vehicle to them: only `companion land` lands then.
    """
    from companion.commands.fly import BadInputError, FlyRequest, run_fly
    from companion.live.beside import PageOptions

    chosen = {
        "trajectory": number_or_text(traj),
        "controller": controller,
        "vehicle": vehicle,
        "plant": plant,
        "wind": wind,
        "faults": faults,
        "sensors": sensors,
        "seed": seed,
        "autopilot": autopilot,
        "setpoint": setpoint,
        "switch": switch or None,
        "connect": connect,
    }
    request = FlyRequest(
        mission_file=mission,
        overrides={key: value for key, value in chosen.items() if value is not None},
        settings=(
            *(setting or ()),
            *(("preflight.fix=true",) if fix else ()),
            *((f"link.system_id={system_id}",) if system_id is not None else ()),
            *((f"mocap.system={mocap}",) if mocap is not None else ()),
        ),
        lockstep=lockstep,
        out=out,
        json_output=json_output,
        verbose=verbose,
        signing_key_file=signing_key_file,
        live=PageOptions(live_host, live_port) if live else None,
    )
    try:
        outcome = run_fly(request)
    except BadInputError as error:
        raise bad_input(error) from error
    raise typer.Exit(
        {
            "landed": ExitStatus.LANDED,
            "refused": ExitStatus.REFUSED,
            "aborted": ExitStatus.ABORTED,
        }[outcome]
    )
