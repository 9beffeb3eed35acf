"""``companion doctor`` on the command line."""

import typer

from companion.cli import options


def doctor(json_output: options.JsonOutput = False) -> None:
    """Look this computer over: versions, solvers, devices, ports, timers, clock, room.

    It needs no rights, changes nothing, and tells no secrets: paste what it prints into a bug
    report. It takes some seconds, as timers are watched for a while; run it while nothing flies.

    Exit status: 0 no problem (notes are none), 1 a problem, each with its remedy.
    """
    from companion.commands.doctor import DoctorRequest, run_doctor

    raise typer.Exit(0 if run_doctor(DoctorRequest(json_output)) else 1)
