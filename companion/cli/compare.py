"""``companion compare`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion, options
from companion.cli.common import ExitStatus, bad_input, number_or_file, tell_error


def compare(
    controllers: Annotated[
        list[str],
        typer.Argument(
            help="Controllers, each by name or YAML file; A@VEHICLE.yaml flies A with what that "
            "file says of the vehicle; LABEL=A calls it so. Ratios are to the first.",
            metavar="[LABEL=]A[@VEHICLE] ...",
            autocompletion=completion.contenders,
        ),
    ],
    vehicle: options.VehicleByDefault = "bebop2",
    autopilot: options.Autopilot = None,
    setpoint: options.SetpointKind = None,
    traj: Annotated[
        str,
        typer.Option(
            help="Trajectories: 1 … 5 or files, with commas.",
            metavar="N,FILE,…",
            autocompletion=completion.trajectory_lists,
        ),
    ] = "1,2,3,4,5",
    wind: Annotated[
        list[str] | None,
        typer.Option(
            help="Wind: calm (default), fan, gusts, wind3, a sudden event (payload-drop, "
            "gust-front, weak-motor), or a scenario's YAML file. May be "
            "repeated.",
            metavar="NAME|FILE",
            autocompletion=completion.winds,
        ),
    ] = None,
    sensors: Annotated[
        str | None,
        typer.Option(
            help="Sensors in place of the vehicle's own: mocap, gnss, ekf3, exact, or a file.",
            metavar="NAME|FILE",
            autocompletion=completion.sensors,
        ),
    ] = None,
    perturb: Annotated[
        list[str] | None,
        typer.Option(
            help="Fly perturbed vehicles beside the nominal one: all, or lag+25, lag-25, slow+25, "
            "mass+20, mass-20, thrust+15, thrust-15, dragx2, delay+20ms, loss10, lag+50, slow+50, "
            "delay+40ms, combo. May be repeated.",
            metavar="NAME",
            autocompletion=completion.one_of(completion.PERTURBATIONS),
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(help="Flights of each kind, with seeds 1 … N.")] = 5,
    whole: Annotated[
        bool,
        typer.Option(
            "--whole", help="Whole flights, from take-off to landing; else the trajectory alone."
        ),
    ] = False,
    against: Annotated[
        str,
        typer.Option(
            help="Errors against the truth, or the reported position.",
            metavar="truth|reported",
            autocompletion=completion.one_of(("truth", "reported")),
        ),
    ] = "truth",
    setting: options.Settings = None,
    jobs: Annotated[
        int | None, typer.Option(help="Processes; by default one for each processor.")
    ] = None,
    out: Annotated[
        Path,
        typer.Option(
            help="Folder of the comparison. What was flown there and has not changed since is not "
            "flown again.",
            metavar="DIR",
        ),
    ] = Path("compare"),
    json_output: options.JsonOutput = False,
) -> None:
    """Fly controllers side by side in lockstep: winds, perturbed vehicles, seeds.

    Prints a table and writes compare.png, compare.json, and every flight as Parquet.

    Exit status: 0 done, whoever is better; 2 bad input, or not one flight could be flown;
    4 interrupted.
    """
    from companion.commands.compare import CompareRequest, run_compare
    from companion.config.yaml_source import ConfigError
    from companion.experiments.campaign import CampaignInterruptedError
    from companion.experiments.flight_store import MissingExtraError
    from companion.trajectories.from_file import TrajectoryFileError

    request = CompareRequest(
        controllers=tuple(controllers),
        vehicle=vehicle,
        autopilot=autopilot,
        setpoint=setpoint,
        trajectories=tuple(number_or_file(text) for text in traj.split(",")),
        winds=tuple(wind or ("calm",)),
        sensors=sensors,
        perturb=tuple(perturb or ()),
        seeds=seeds,
        jobs=jobs,
        out=out,
        against=against,
        whole=whole,
        settings=tuple(setting or ()),
        json_output=json_output,
    )
    try:
        run_compare(request)
    except (ConfigError, TrajectoryFileError, MissingExtraError, OSError) as error:
        raise bad_input(error) from error
    except CampaignInterruptedError as error:
        tell_error(error)
        raise typer.Exit(ExitStatus.ABORTED) from error
