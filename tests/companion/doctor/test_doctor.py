"""What the doctor says of readings that are made up, and that it reads the real ones."""

import asyncio
import json
import os
import socket
import stat
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.commands import doctor as command
from companion.control.qp.port import QpSolution
from companion.doctor.item import Health, Item, worst
from companion.doctor.judge import judge
from companion.doctor.read_machine import read_processor, read_room, read_serial, short
from companion.doctor.read_ports import holder, read_ports
from companion.doctor.read_software import (
    PURPOSES,
    missing_configs,
    read_software,
    read_solvers,
)
from companion.doctor.read_time import read_time, timers_of
from companion.doctor.readings import (
    Clock,
    Extra,
    Port,
    Processor,
    Readings,
    Room,
    SerialDevice,
    Software,
    Solver,
    Terminal,
    Timers,
)
from companion.doctor.show import summary

WELL = Readings(
    software=Software("1.2.3", "abc123", "CPython 3.12.1", "Linux 6.1, aarch64", {"numpy": "2.0"}),
    solvers=(Solver("osqp", True, time_us=20.0),),
    serial=(SerialDevice("/dev/ttyACM0", "dialout", True),),
    ports=(Port(14540, "the vehicle", True),),
    processor=Processor(4, 0.5, ("performance",), 99),
    timers=Timers(150, 0.1, 0.8, 1.2),
    clock=Clock(True, 0.1),
    room=Room(4000.0, 3000.0, "~/flights", 20_000.0, True),
    terminal=Terminal("utf-8", 80, True),
    configs="/opt/configs",
)


def items(**changed):
    return {item.subject: item for item in judge(replace(WELL, **changed))}


def test_a_computer_that_is_well_has_no_remedies():
    found = judge(WELL)
    assert worst(found) is Health.OK
    assert [item.remedy for item in found if item.remedy] == []
    assert summary(found) == "no problems, 0 notes"
    assert "1.2.3, commit abc123" in {item.found for item in found}


@pytest.mark.parametrize(
    ("changed", "subject", "health", "says"),
    [
        ({"solvers": (Solver("osqp", True, "a wrong answer"),)}, "solver osqp", "problem",
         "pip install"),
        ({"solvers": (Solver("daqp", False),)}, "solver daqp", "note", ""),
        ({"serial": (SerialDevice("/dev/ttyUSB0", "dialout", False),)}, "serial /dev/ttyUSB0",
         "problem", 'usermod -aG dialout "$USER"'),
        ({"serial": ()}, "serial devices", "ok", ""),
        ({"ports": (Port(14540, "the vehicle", False, "px4 (process 7)"),)}, "UDP port 14540",
         "note", "--connect"),
        ({"processor": Processor(2, 3.5, (), 99)}, "processor", "note", "End what"),
        ({"processor": Processor(1, 0.1, (), 99)}, "processor", "note", "--lockstep"),
        ({"processor": Processor(4, 0.1, ("ondemand",), 99)}, "frequency governor", "note",
         "performance"),
        ({"processor": Processor(4, 0.1, (), 0)}, "real-time priority", "note", "rtprio"),
        ({"timers": Timers(150, 0.1, 2.0, 3.0)}, "timers", "note", "chrt -f 10"),
        ({"timers": Timers(150, 0.1, 7.0, 30.0)}, "timers", "problem", "lockstep do not mind"),
        ({"clock": Clock(False, 0.0)}, "clock", "note", "set-ntp true"),
        ({"clock": Clock(True, 80.0)}, "clock's steps", "note", "signatures"),
        ({"room": Room(1000.0, 150.0, "f", 9e3, True)}, "memory", "problem", "End what"),
        ({"room": Room(1000.0, 400.0, "f", 9e3, True)}, "memory", "note", "--jobs 1"),
        ({"room": Room(None, None, "f", 9e3, False)}, "disk", "problem", "--out"),
        ({"room": Room(None, None, "f", 10.0, True)}, "disk", "problem", "Make room"),
        ({"room": Room(None, None, "f", 500.0, True)}, "disk", "note", "megabytes"),
        ({"terminal": Terminal("ascii", 80, False)}, "terminal", "note", "LANG"),
        ({"terminal": Terminal("utf-8", 60, False)}, "terminal", "note", "80 columns"),
        ({"missing_configs": ("schemas",)}, "shipped files", "problem", "anew"),
    ],
)  # fmt: skip
def test_what_is_not_well_is_told_with_its_remedy(changed, subject, health, says):
    item = items(**changed)[subject]
    assert item.health == health
    assert says in item.remedy


def test_what_is_missing_of_the_installation():
    software = replace(
        WELL.software,
        packages={"numpy": "2.0", "osqp": None},
        extras=(Extra("study", "studies", ("cma",)), Extra("daqp", "a solver")),
    )
    found = items(software=software)
    assert found["osqp"].health is Health.PROBLEM
    assert "pip install 'companion[study]'" in found["extra study"].found
    assert found["extra daqp"].health is Health.OK


def test_the_deadline_is_told_with_what_the_timers_leave_of_it():
    assert "4.2 ms of the deadline of 5 ms are left" in items()["timers"].found


def test_the_summary_counts():
    found = [Item("a", "b", Health.PROBLEM), Item("c", "d", Health.NOTE), Item("e", "f")]
    assert summary(found) == "1 problem, 1 note: see above"
    assert worst([]) is Health.OK


def test_every_extra_that_a_user_wants_is_told():
    with (Path(__file__).parents[3] / "pyproject.toml").open("rb") as file:
        extras = set(tomllib.load(file)["project"]["optional-dependencies"])
    assert extras - {"dev", "bench", "fuzz", "docs", "notebook"} <= PURPOSES.keys() <= extras


def test_the_installed_versions_are_read():
    software = read_software("1", "")
    assert software.packages["numpy"] == np.__version__
    assert missing_configs() == ()


class Stuck:
    def __init__(self, p, a):
        pass

    def solve(self, q, lower, upper):
        return QpSolution(None, "iteration limit", 0)


class Wrong(Stuck):
    def solve(self, q, lower, upper):
        return QpSolution(np.array([1.0, 3.0]), "solved", 1)


class Broken(Stuck):
    def solve(self, q, lower, upper):
        raise OSError("libosqp.so: cannot open")


@pytest.mark.parametrize(
    ("solver", "says"),
    [(Stuck, "solved nothing"), (Wrong, "(1, 3) in place of (1, 1)"), (Broken, "libosqp.so")],
)
def test_a_solver_that_does_not_solve_is_found(solver, says):
    assert all(says in one.trouble for one in read_solvers(lambda _: solver))


def test_a_solver_that_is_there_solves_and_one_that_is_not_is_told():
    assert [one.trouble for one in read_solvers()] == ["", ""]

    def none(_):
        raise ModuleNotFoundError

    assert not any(one.installed for one in read_solvers(none))


def test_a_taken_port_is_told_with_who_has_it():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        number = taken.getsockname()[1]
        (port,) = read_ports({number: "a test"})
        assert not port.free
        assert f"(process {os.getpid()})" in port.holder
    assert read_ports({number: "a test"})[0].free


def test_who_has_a_port_by_what_the_kernel_tells(tmp_path):
    net = tmp_path / "proc" / "net"
    net.mkdir(parents=True)
    (net / "udp").write_text(
        "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  "
        "timeout inode\n  1: 0100007F:38CC 00000000:0000 07 0:0 00:0 0 1000 0 4242 2 0 0\n"
    )
    process = tmp_path / "proc" / "77"
    (process / "fd").mkdir(parents=True)
    (process / "fd" / "5").symlink_to("socket:[4242]")
    (process / "comm").write_text("px4\n")
    assert holder(14540, tmp_path) == "px4 (process 77)"
    assert holder(14550, tmp_path) == ""


def test_the_machine_by_what_the_kernel_tells(tmp_path):
    cpu = tmp_path / "sys" / "devices" / "system" / "cpu" / "cpu0" / "cpufreq"
    cpu.mkdir(parents=True)
    (cpu / "scaling_governor").write_text("ondemand\n")
    (tmp_path / "sys" / "kernel").mkdir()
    (tmp_path / "sys" / "kernel" / "realtime").write_text("1\n")
    (tmp_path / "proc" / "self").mkdir(parents=True)
    (tmp_path / "proc" / "self" / "status").write_text("CapEff:\t0000000000800000\n")
    (tmp_path / "proc" / "meminfo").write_text("MemTotal: 2000000 kB\nMemAvailable: 1000000 kB\n")
    found = read_processor(tmp_path)
    assert (found.governors, found.real_time_kernel) == (("ondemand",), True)
    assert found.real_time_priority == 99
    room = read_room(tmp_path / "flights" / "none", tmp_path)
    assert room.memory_available_mb == pytest.approx(1024.0)
    assert room.writable


def test_serial_devices_by_their_names(tmp_path):
    for name in ("ttyACM0", "ttyUSB1", "tty0", "serial0"):
        (tmp_path / name).touch()
    (tmp_path / "ttyUSB1").chmod(stat.S_IRUSR)
    found = {Path(one.path).name: one for one in read_serial(tmp_path)}
    assert set(found) == {"ttyACM0", "ttyUSB1", "serial0"}
    assert found["ttyACM0"].allowed


def test_timers_are_ranked():
    timers = timers_of([1e-3 * k for k in range(1, 101)])
    assert timers == Timers(100, pytest.approx(50.0), pytest.approx(99.0), pytest.approx(100.0))


def test_timers_are_watched_on_the_loop():
    timers, clock = asyncio.run(read_time(0.03))
    assert timers.count == 3
    assert 0.0 <= timers.median_ms <= timers.p99_ms <= timers.greatest_ms
    assert clock.step_ms >= 0.0


def test_a_path_is_told_without_the_users_name():
    assert short(Path.home() / "flights") == "~/flights"
    assert short(Path("/opt/flights")) == "/opt/flights"


@pytest.fixture
def readings(monkeypatch):
    """What the command reads, in place of this computer."""
    kept = [WELL]
    monkeypatch.setattr(command, "read_all", lambda _: kept[0])
    return kept


def test_the_command_tells_each_line_in_80_columns(readings):
    done = CliRunner().invoke(app, ["doctor"])
    assert done.exit_code == 0
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert done.stdout.splitlines()[-1] == "no problems, 0 notes"


def test_a_problem_is_exit_status_1_and_json_has_the_readings(readings):
    readings[0] = replace(WELL, timers=Timers(150, 0.1, 7.0, 30.0))
    done = CliRunner().invoke(app, ["doctor", "--json"])
    assert done.exit_code == 1
    said = json.loads(done.stdout)
    assert said["verdict"] == "problem"
    assert said["readings"]["timers"]["p99_ms"] == 7.0


def test_no_key_is_ever_shown(monkeypatch):
    monkeypatch.setenv("COMPANION_SIGNING_KEY", "5e" * 32)
    found = command.read_all(0.02)
    assert found.key_in_environment
    text = json.dumps(command.doctor_object(judge(found), found))
    assert "5e5e" not in text
    assert "COMPANION_SIGNING_KEY is set" in text
