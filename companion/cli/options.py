"""Options of the command line that several commands have in common."""

from pathlib import Path
from typing import Annotated

import typer

Trajectory = Annotated[
    str | None,
    typer.Option(help="Trajectory: 1 … 5, or a CSV (t,x,y,z) or YAML file.", metavar="N|FILE"),
]
Vehicle = Annotated[
    str | None, typer.Option(help="Vehicle by name, or its YAML file.", metavar="NAME|FILE")
]
Autopilot = Annotated[
    str | None, typer.Option(help="Autopilot's kind: auto, px4, ardupilot.", metavar="NAME")
]
SetpointKind = Annotated[
    str | None,
    typer.Option(
        help="What is streamed: attitude (default), or rates (of the body).", metavar="NAME"
    ),
]
Mission = Annotated[
    Path | None, typer.Option(help="Mission as YAML; options win over it.", metavar="FILE")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Set a key of the mission, or of the controller or vehicle by controller.KEY or "
        "vehicle.KEY. May be repeated.",
        metavar="KEY=VALUE",
    ),
]
MocapSystem = Annotated[
    str | None,
    typer.Option(
        help="Give the autopilot poses of a motion-capture system: udp (JSON), vicon, "
        "optitrack, qualisys, vrpn; --set mocap.KEY=VALUE for the rest.",
        metavar="SYSTEM",
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
