"""``companion tune`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion, options
from companion.cli.common import ExitStatus, bad_input, number_or_file, tell_error


def tune(
    controller: Annotated[
        str,
        typer.Argument(
            help="Baseline whose gains are searched: pid-l1, lqr-l1, pid, mpc-pid, or its YAML "
            "file, which then gives everything but the gains.",
            metavar="CONTROLLER",
            autocompletion=completion.one_of(completion.TUNED),
        ),
    ],
    traj: Annotated[
        str,
        typer.Option(
            help="Trajectory: 1 … 5, or a CSV or YAML file.",
            metavar="N|FILE",
            autocompletion=completion.trajectories,
        ),
    ] = "4",
    vehicle: options.VehicleByDefault = "bebop2",
    budget: Annotated[
        int, typer.Option(help="Sets of gains in all, shared by the starts; two flights each.")
    ] = 300,
    starts: Annotated[int, typer.Option(help="Starts of the search.")] = 2,
    part: Annotated[
        str,
        typer.Option(
            help="What is tuned: gains; of mpc-pid, flown with its MPC, its model or the whole.",
            metavar="PART",
            autocompletion=completion.one_of(completion.PARTS),
        ),
    ] = "gains",
    seed: Annotated[int, typer.Option(help="Seed of the search and of the flights.")] = 1,
    jobs: Annotated[
        int | None, typer.Option(help="Processes; by default one for each processor.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The controller's file to write, with a log of every flight beside it (.jsonl); "
            "by default in tuned/.",
            metavar="FILE",
        ),
    ] = None,
) -> None:
    """Search for a baseline's gains by flying in lockstep: the least mean tracking error, calm.

    Each set flies on the vehicle and on one whose attitude lags a quarter more; the larger error
    counts, or the search ends at the brink of instability.

    Exit status: 0 found and written, 2 bad input, 4 interrupted or not to be identified.
    """
    from companion.commands.tune import TuneRequest, TuningInterruptedError, run_tune
    from companion.config.yaml_source import ConfigError
    from companion.experiments.flight_store import MissingExtraError
    from companion.experiments.identify_steps import UnidentifiedError
    from companion.trajectories.from_file import TrajectoryFileError

    request = TuneRequest(
        controller, number_or_file(traj), vehicle, budget, starts, seed, jobs, out, part
    )
    try:
        run_tune(request)
    except (ConfigError, TrajectoryFileError, MissingExtraError, OSError) as error:
        raise bad_input(error) from error
    except (TuningInterruptedError, UnidentifiedError) as error:
        tell_error(error)
        raise typer.Exit(ExitStatus.ABORTED) from error
