"""What ``companion doctor`` does: read the computer, judge, tell."""

import asyncio
import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from companion.config.folders import configs_folder
from companion.config.signing_key import KEY_VARIABLE
from companion.doctor.item import Health, worst
from companion.doctor.judge import judge
from companion.doctor.read_machine import read_processor, read_room, read_serial, short
from companion.doctor.read_ports import read_ports
from companion.doctor.read_software import missing_configs, read_software, read_solvers
from companion.doctor.read_time import MEASURED_S, read_time
from companion.doctor.readings import Readings, Terminal
from companion.doctor.show import doctor_object, print_items
from companion.experiments.provenance import commit, version
from companion.report.consoles import plain_console

_FLIGHTS = Path("flights")


@dataclass(frozen=True, slots=True)
class DoctorRequest:
    """The options of the command line."""

    json_output: bool = False
    measured_s: float = MEASURED_S
    """For how long the timers are watched."""


def run_doctor(request: DoctorRequest) -> bool:
    """Look the computer over and tell about it.

    Returns:
        Whether nothing is wrong.
    """
    readings = read_all(request.measured_s)
    items = judge(readings)
    if request.json_output:
        said = doctor_object(items, readings)
        sys.stdout.write(json.dumps(said, ensure_ascii=False, allow_nan=False) + "\n")
    else:
        print_items(plain_console(sys.stdout), items)
    return worst(items) is not Health.PROBLEM


def read_all(measured_s: float) -> Readings:
    """Everything that is judged; the timers are watched last, when all is imported."""
    software = read_software(version(), commit())
    solvers = read_solvers()
    serial, ports = read_serial(), read_ports()
    processor, room = read_processor(), read_room(_FLIGHTS)
    timers, clock = asyncio.run(read_time(measured_s))
    return Readings(
        software=software,
        solvers=solvers,
        serial=serial,
        ports=ports,
        processor=processor,
        timers=timers,
        clock=clock,
        room=room,
        terminal=_terminal(),
        key_in_environment=KEY_VARIABLE in os.environ,
        configs=short(configs_folder()),
        missing_configs=missing_configs(),
    )


def _terminal() -> Terminal:
    console = Console(file=sys.stdout)
    return Terminal(
        encoding=console.encoding,
        columns=console.width,
        colour=console.color_system is not None and not console.no_color,
    )
