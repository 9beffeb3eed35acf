"""Flies for long and tells what grows.

    python -m tools.soak lockstep --hours 3 --out DIR
    python -m tools.soak real-time --minutes 10 --out DIR
    python -m tools.soak growth --minutes 5

Exit code 1: something grows, or it is not shown that it does not.  See docs/endurance.md.
"""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from companion.config.yaml_source import ConfigError
from tools.soak import figure, growth, report, runs
from tools.soak.figure_eight import LONGEST_S
from tools.soak.plans import AUTOPILOTS, FlightPlan
from tools.soak.verdicts import fitted

_LONG_SHARE = 1.0 / 3.0
"""Of the hours in lockstep that one long flight takes."""

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False)

Out = Annotated[Path, typer.Option(help="Folder for soak.json and soak.png; must not exist yet.")]
Autopilot = Annotated[str | None, typer.Option(help="px4 or ardupilot.", metavar="NAME")]
Controller = Annotated[
    str | None, typer.Option(help="Controller by name, or its YAML file.", metavar="NAME|FILE")
]
Json = Annotated[bool, typer.Option("--json", help="soak.json on standard output.")]


@app.command()
def lockstep(
    out: Out,
    hours: Annotated[float, typer.Option(help="Of simulated time, in all.", min=1.5)] = 3.0,
    autopilot: Autopilot = None,
    controller: Controller = None,
    json_output: Json = False,
) -> None:
    """Whole flights one after another, then one long flight, in simulated time.

    Both flavours in turn, all five trajectories, several winds, and one flight in ten with faults;
    the long flight is PX4's unless --autopilot says otherwise.
    """
    _check(autopilot)
    _new(out)
    long_minutes = min(60.0 * hours * _LONG_SHARE, LONGEST_S / 60.0)
    plan = FlightPlan(autopilot or "px4", str(out / "figure-eight.csv"), controller=controller)
    many_hours = hours - long_minutes / 60.0
    many = runs.many_flights(out / "flights", many_hours, autopilot, controller, _tell)
    long = runs.long_flight(out / "long", long_minutes, plan, _tell)
    _conclude(out, [many, long], json_output=json_output)


@app.command()
def real_time(
    out: Out,
    minutes: Annotated[
        float, typer.Option(help="Of the trajectory.", min=2.0, max=LONGEST_S / 60.0)
    ] = 10.0,
    autopilot: Autopilot = None,
    controller: Controller = None,
    json_output: Json = False,
) -> None:
    """One long flight over UDP on the wall clock, the shim being a process of its own."""
    _check(autopilot)
    _new(out)
    plan = FlightPlan(autopilot or "px4", str(out / "figure-eight.csv"), controller=controller)
    _conclude(out, [runs.real_time(out, minutes, plan, _tell)], json_output=json_output)


@app.command(name="growth")
def what_grows(
    minutes: Annotated[float, typer.Option(help="Of the trajectory, simulated.", min=3.0)] = 5.0,
    autopilot: Autopilot = None,
    controller: Controller = None,
    faults: Annotated[str | None, typer.Option(help="Faults by name, or a YAML file.")] = None,
) -> None:
    """Fly in lockstep and list by place of allocation what is more at the end than at first."""
    _check(autopilot)
    for line in growth.listed(autopilot or "px4", controller, faults, minutes):
        print(line)


def _check(autopilot: str | None) -> None:
    if autopilot is not None and autopilot not in AUTOPILOTS:
        raise typer.BadParameter(f"--autopilot {autopilot}: give {' or '.join(AUTOPILOTS)}.")


def _new(out: Path) -> None:
    try:
        out.mkdir(parents=True)
    except OSError as error:
        raise typer.BadParameter(f"--out {out}: {error.strerror}. Give a new folder.") from error


def _conclude(out: Path, flown: list[runs.Run], *, json_output: bool) -> None:
    """Fit, write, draw, tell; ends the program."""
    found = [(run, fitted(run)) for run in flown]
    report.write(out / "soak.json", found)
    figure.draw(out / "soak.png", found)
    if json_output:
        print(json.dumps(report.report(found), allow_nan=False))
    else:
        print("\n".join([*report.lines(found), str(out / "soak.png")]))
    raise typer.Exit(0 if report.passed(found) else 1)


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def main() -> None:
    """Run; what cannot be done is said in one line."""
    try:
        app()
    except (ConfigError, runs.ChildError, ValueError) as error:
        _tell(f"soak: {error}")
        sys.exit(2)


if __name__ == "__main__":
    main()
