"""The command line: parse, call, show.  What a command does is in the rooms below."""

import io
import sys
from enum import IntEnum
from pathlib import Path
from typing import Annotated

import typer

from companion import cli_options as options
from companion.cli_faults import faults
from companion.cli_logs import recover, replay

app = typer.Typer(
    name="companion",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


class ExitStatus(IntEnum):
    """What the exit status says."""

    LANDED = 0
    NOT_CERTIFIED = 1
    """Of `check`: warnings, and nothing worse."""
    BAD_INPUT = 2
    REFUSED = 3
    ABORTED = 4


def _bad_input(error: Exception) -> typer.Exit:
    """Tell what is wrong with what was asked for; the exit to raise."""
    typer.echo(f"error: {error}", err=True)
    return typer.Exit(ExitStatus.BAD_INPUT)


def _show_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"companion {version('companion')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Fly a drone along a trajectory with MPC and L1 adaptive control, over MAVLink."""


@app.command()
def fly(
    traj: options.Trajectory = None,
    controller: Annotated[
        str | None, typer.Option(help="Controller by name, or its YAML file.", metavar="NAME|FILE")
    ] = None,
    vehicle: options.Vehicle = None,
    wind: Annotated[
        str | None,
        typer.Option(
            help="Wind of the embedded shim: calm, fan, gusts, wind3, payload-drop, gust-front, "
            "weak-motor, or a scenario's YAML file.",
            metavar="NAME|FILE",
        ),
    ] = None,
    faults: Annotated[
        str | None,
        typer.Option(
            help="What goes wrong on purpose in the embedded shim: bad-link, slow-link, or a "
            "faults' YAML file.",
            metavar="NAME|FILE",
        ),
    ] = None,
    sensors: Annotated[
        str | None,
        typer.Option(
            help="Sensors of the embedded shim in place of the vehicle's own: mocap, gnss, ekf3, "
            "exact, or a profile's YAML file.",
            metavar="NAME|FILE",
        ),
    ] = None,
    mocap: options.MocapSystem = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of all noise of the embedded shim.")
    ] = None,
    autopilot: options.Autopilot = None,
    setpoint: options.SetpointKind = None,
    switch: Annotated[
        list[str] | None,
        typer.Option(
            help="Hand over in flight, t seconds after the trajectory's start: to a controller by "
            "name or YAML file, or l1-off, l1-on. May be repeated.",
            metavar="t=S:CONTROLLER",
        ),
    ] = None,
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
        typer.Option(help="Folder of the flight's files; by default a new one in flights/."),
    ] = None,
    json_output: options.JsonOutput = False,
    verbose: Annotated[bool, typer.Option("-v", "--verbose", help="Show every message.")] = False,
) -> None:
    """Fly a trajectory: start the shim (or connect), arm, take off, track, land, and report.

    Before arming it checks what `companion check` does; warnings are told, a refusal is final.

    Exit status: 0 landed, 2 bad input, 3 refused by a check, 4 aborted safely.
    Ctrl-C lands; a second Ctrl-C hands over to the autopilot at once. After somebody else has
    taken over, it leaves the vehicle to them: only `companion land` lands then.
    """
    from companion.fly_command import BadInputError, FlyRequest, run_fly

    chosen = {
        "trajectory": _number_or_text(traj),
        "controller": controller,
        "vehicle": vehicle,
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
    )
    try:
        outcome = run_fly(request)
    except BadInputError as error:
        raise _bad_input(error) from error
    raise typer.Exit(
        {
            "landed": ExitStatus.LANDED,
            "refused": ExitStatus.REFUSED,
            "aborted": ExitStatus.ABORTED,
        }[outcome]
    )


def _number_or_text(text: str | None) -> int | str | None:
    try:
        return None if text is None else int(text)
    except ValueError:
        return text


def _number_or_file(text: str) -> int | str:
    number = _number_or_text(text.strip())
    assert number is not None
    return number


@app.command()
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
    from companion.check_command import BadInputError, CheckRequest, run_check

    chosen = {
        "trajectory": None if traj is None else _number_or_text(traj),
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
        raise _bad_input(error) from error
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


@app.command()
def mocap(
    connect: Annotated[
        str | None,
        typer.Option(
            help="Link to the autopilot, for instance udpin://127.0.0.1:14540.", metavar="URL"
        ),
    ] = None,
    mocap: options.MocapSystem = None,
    mission: options.Mission = None,
    setting: options.Settings = None,
    signing_key_file: options.SigningKeyFile = None,
) -> None:
    """Give an autopilot the poses of a motion-capture system, and fly nothing.

    Exit status: 0 interrupted, 2 bad input, 4 the link was lost.
    """
    from companion.mocap_command import BadInputError, MocapRequest, run_mocap

    request = MocapRequest(
        mission_file=mission,
        overrides={} if connect is None else {"connect": connect},
        settings=(*(setting or ()), *(() if mocap is None else (f"mocap.system={mocap}",))),
        signing_key_file=signing_key_file,
    )
    try:
        run_mocap(request)
    except BadInputError as error:
        raise _bad_input(error) from error
    except KeyboardInterrupt:
        return
    raise typer.Exit(ExitStatus.ABORTED)


@app.command()
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
            help="Fly nothing: identify from the log of such a flight once more.", metavar="DIR"
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
    wind: Annotated[
        str | None,
        typer.Option(help="Wind of the embedded shim, as of fly.", metavar="NAME|FILE"),
    ] = None,
    sensors: Annotated[
        str | None,
        typer.Option(help="Sensors of the embedded shim, as of fly.", metavar="NAME|FILE"),
    ] = None,
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
    from companion.identify_command import BadInputError, IdentifyRequest, run_identify

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
        raise _bad_input(error) from error
    raise typer.Exit(
        {
            "identified": ExitStatus.LANDED,
            "uncertified": ExitStatus.NOT_CERTIFIED,
            "refused": ExitStatus.REFUSED,
            "aborted": ExitStatus.ABORTED,
            "unidentified": ExitStatus.ABORTED,
        }[verdict]
    )


@app.command()
def tune(
    controller: Annotated[
        str,
        typer.Argument(
            help="Baseline whose gains are searched: pid-l1, lqr-l1, pid, mpc-pid, or its YAML "
            "file, which then gives everything but the gains.",
            metavar="CONTROLLER",
        ),
    ],
    traj: Annotated[
        str, typer.Option(help="Trajectory: 1 … 5, or a CSV or YAML file.", metavar="N|FILE")
    ] = "4",
    vehicle: Annotated[
        str, typer.Option(help="Vehicle by name, or its YAML file.", metavar="NAME|FILE")
    ] = "bebop2",
    budget: Annotated[
        int, typer.Option(help="Sets of gains in all, shared by the starts; two flights each.")
    ] = 300,
    starts: Annotated[int, typer.Option(help="Starts of the search.")] = 2,
    part: Annotated[
        str,
        typer.Option(
            help="What is tuned: gains; of mpc-pid, flown with its MPC, its model or the whole.",
            metavar="PART",
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
    from companion.config.yaml_source import ConfigError
    from companion.experiments.flight_store import MissingExtraError
    from companion.experiments.identify_steps import UnidentifiedError
    from companion.trajectories.from_file import TrajectoryFileError
    from companion.tune_command import TuneRequest, TuningInterruptedError, run_tune

    number_or_file = _number_or_text(traj)
    assert number_or_file is not None
    request = TuneRequest(
        controller, number_or_file, vehicle, budget, starts, seed, jobs, out, part
    )
    try:
        run_tune(request)
    except (ConfigError, TrajectoryFileError, MissingExtraError, OSError) as error:
        raise _bad_input(error) from error
    except (TuningInterruptedError, UnidentifiedError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(ExitStatus.ABORTED) from error


@app.command()
def certify(
    controller: Annotated[
        str,
        typer.Argument(help="L1 controller or mpc-l1-plus, or a YAML file.", metavar="NAME|FILE"),
    ],
    vehicle: Annotated[
        str, typer.Option(help="Vehicle by name, or its YAML file.", metavar="NAME|FILE")
    ] = "bebop2",
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
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for certificate.json and certificate.png; by default nothing is written.",
            metavar="DIR",
        ),
    ] = None,
    json_output: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else.")
    ] = False,
) -> None:
    """Check an L1 controller on a vehicle's stated dynamics: stability, L1 norms, bounds, margins.

    Of MPC-L1+ also over a family of vehicles that are not the stated one.

    Exit status: 0 every condition holds, 1 one fails (its reason is told), 2 bad input.
    """
    from companion.certify_command import BadInputError, CertifyRequest, run_certify

    request = CertifyRequest(
        controller, vehicle, rate, wind, tuple(setting or ()), out, json_output
    )
    try:
        holds = run_certify(request)
    except BadInputError as error:
        raise _bad_input(error) from error
    raise typer.Exit(ExitStatus.LANDED if holds else ExitStatus.NOT_CERTIFIED)


@app.command()
def paper(
    quick: Annotated[
        bool, typer.Option("--quick", help="One seed and a shorter sweep: no spread is claimed.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the study; by default paper, or paper-quick. What was flown there and "
            "has not changed since is not flown again.",
            metavar="DIR",
        ),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(help="Processes; by default one for each processor.")
    ] = None,
) -> None:
    """Fly the paper's experiments in lockstep, and judge its claims by what was found.

    Writes report.html, each figure as PNG and SVG, results.json, and every flight as Parquet.

    Exit status: 0 done, whatever the verdicts; 2 bad input, 4 interrupted.
    """
    from companion.config.yaml_source import ConfigError
    from companion.experiments.campaign import CampaignInterruptedError
    from companion.experiments.flight_store import MissingExtraError
    from companion.paper_command import PaperRequest, run_paper

    try:
        run_paper(PaperRequest(quick, out, jobs))
    except (ConfigError, MissingExtraError, OSError) as error:
        raise _bad_input(error) from error
    except CampaignInterruptedError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(ExitStatus.ABORTED) from error


@app.command()
def compare(
    controllers: Annotated[
        list[str],
        typer.Argument(
            help="Controllers, each by name or YAML file; A@VEHICLE.yaml flies A with what that "
            "file says of the vehicle; LABEL=A calls it so. Ratios are to the first.",
            metavar="[LABEL=]A[@VEHICLE] ...",
        ),
    ],
    vehicle: Annotated[
        str, typer.Option(help="Vehicle by name, or its YAML file.", metavar="NAME|FILE")
    ] = "bebop2",
    autopilot: options.Autopilot = None,
    setpoint: options.SetpointKind = None,
    traj: Annotated[
        str, typer.Option(help="Trajectories: 1 … 5 or files, with commas.", metavar="N,FILE,…")
    ] = "1,2,3,4,5",
    wind: Annotated[
        list[str] | None,
        typer.Option(
            help="Wind: calm (default), fan, gusts, wind3, a sudden event (payload-drop, "
            "gust-front, weak-motor), or a scenario's YAML file. May be "
            "repeated.",
            metavar="NAME|FILE",
        ),
    ] = None,
    sensors: Annotated[
        str | None,
        typer.Option(
            help="Sensors in place of the vehicle's own: mocap, gnss, ekf3, exact, or a file.",
            metavar="NAME|FILE",
        ),
    ] = None,
    perturb: Annotated[
        list[str] | None,
        typer.Option(
            help="Fly perturbed vehicles beside the nominal one: all, or lag+25, lag-25, slow+25, "
            "mass+20, mass-20, thrust+15, thrust-15, dragx2, delay+20ms, loss10, lag+50, slow+50, "
            "delay+40ms, combo. May be repeated.",
            metavar="NAME",
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
        str, typer.Option(help="Errors against the truth, or the reported position.")
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
    from companion.compare_command import CompareRequest, run_compare
    from companion.config.yaml_source import ConfigError
    from companion.experiments.campaign import CampaignInterruptedError
    from companion.experiments.flight_store import MissingExtraError
    from companion.trajectories.from_file import TrajectoryFileError

    request = CompareRequest(
        controllers=tuple(controllers),
        vehicle=vehicle,
        autopilot=autopilot,
        setpoint=setpoint,
        trajectories=tuple(_number_or_file(text) for text in traj.split(",")),
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
        raise _bad_input(error) from error
    except CampaignInterruptedError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(ExitStatus.ABORTED) from error


app.command()(faults)
app.command()(replay)
app.command()(recover)

_Pid = Annotated[int | None, typer.Option(help="Process id of the flight, if several are running.")]


@app.command()
def land(pid: _Pid = None) -> None:
    """Let a running flight land where it is."""
    _command("land", pid)


@app.command()
def abort(pid: _Pid = None) -> None:
    """Let a running flight stop commanding at once: the autopilot's failsafe takes over."""
    _command("abort", pid)


@app.command()
def resume(pid: _Pid = None) -> None:
    """Let a flight that was handed over take control again and fly its trajectory anew."""
    _command("resume", pid)


def _command(word: str, pid: int | None) -> None:
    import asyncio

    from companion.flight.command_socket import CommandSocketError, send_command
    from companion.flight.inbox import PilotCommand

    try:
        typer.echo(asyncio.run(send_command(PilotCommand(word), pid)))
    except CommandSocketError as error:
        raise _bad_input(error) from error


def main() -> None:
    """Entry point of the console script."""
    for stream in (sys.stdout, sys.stderr):
        # A terminal that can't show a "°" shows a "?" instead; that must not end a flight.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    app(prog_name="companion")
