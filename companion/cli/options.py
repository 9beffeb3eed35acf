"""Options of the command line that several commands have in common."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion

Trajectory = Annotated[
    str | None,
    typer.Option(
        help="Trajectory: 1 … 5, or a CSV (t,x,y,z) or YAML file.",
        metavar="N|FILE",
        autocompletion=completion.trajectories,
    ),
]
Controller = Annotated[
    str | None,
    typer.Option(
        help="Controller by name, or its YAML file.",
        metavar="NAME|FILE",
        autocompletion=completion.controllers,
    ),
]
Vehicle = Annotated[
    str | None,
    typer.Option(
        help="Vehicle by name, or its YAML file.",
        metavar="NAME|FILE",
        autocompletion=completion.vehicles,
    ),
]
VehicleByDefault = Annotated[
    str,
    typer.Option(
        help="Vehicle by name, or its YAML file.",
        metavar="NAME|FILE",
        autocompletion=completion.vehicles,
    ),
]
Wind = Annotated[
    str | None,
    typer.Option(
        help="Wind of the embedded shim: calm, fan, gusts, wind3, payload-drop, gust-front, "
        "weak-motor, or a scenario's YAML file.",
        metavar="NAME|FILE",
        autocompletion=completion.winds,
    ),
]
Faults = Annotated[
    str | None,
    typer.Option(
        help="What goes wrong on purpose in the embedded shim: bad-link, slow-link, or a faults' "
        "YAML file.",
        metavar="NAME|FILE",
        autocompletion=completion.faults,
    ),
]
Sensors = Annotated[
    str | None,
    typer.Option(
        help="Sensors of the embedded shim in place of the vehicle's own: mocap, gnss, ekf3, "
        "exact, or a profile's YAML file.",
        metavar="NAME|FILE",
        autocompletion=completion.sensors,
    ),
]
Switch = Annotated[
    list[str] | None,
    typer.Option(
        help="Hand over in flight, t seconds after the trajectory's start: to a controller by "
        "name or YAML file, or l1-off, l1-on. May be repeated.",
        metavar="t=S:CONTROLLER",
        autocompletion=completion.switches,
    ),
]
Autopilot = Annotated[
    str | None,
    typer.Option(
        help="Autopilot's kind: auto, px4, ardupilot.",
        metavar="NAME",
        autocompletion=completion.one_of(completion.AUTOPILOTS),
    ),
]
SetpointKind = Annotated[
    str | None,
    typer.Option(
        help="What is streamed: attitude (default), or rates (of the body).",
        metavar="NAME",
        autocompletion=completion.one_of(completion.SETPOINTS),
    ),
]
Mission = Annotated[
    Path | None,
    typer.Option(
        help="Mission as YAML (`companion new mission` writes one); options win over it.",
        metavar="FILE",
        autocompletion=completion.missions,
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Set a key of the mission, or of the controller or vehicle by controller.KEY or "
        "vehicle.KEY. May be repeated.",
        metavar="KEY=VALUE",
        autocompletion=completion.settings,
    ),
]
MocapSystem = Annotated[
    str | None,
    typer.Option(
        help="Give the autopilot poses of a motion-capture system: udp (JSON), vicon, "
        "optitrack, qualisys, vrpn; --set mocap.KEY=VALUE for the rest.",
        metavar="SYSTEM",
        autocompletion=completion.one_of(completion.MOCAP_SYSTEMS),
    ),
]
SystemId = Annotated[
    int | None,
    typer.Option(help="MAVLink system to fly, where several are on the link.", metavar="1 … 255"),
]
SigningKeyFile = Annotated[
    Path | None,
    typer.Option(
        help="Sign packets, and read only signed ones, by the key in this file (mode 600); "
        "else by the one in COMPANION_SIGNING_KEY, if any.",
        metavar="FILE",
    ),
]
JsonOutput = Annotated[
    bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else.")
]
