"""What is wrong with the command line is told in a sentence, and nothing is started."""

import json
import os
import socket

import pytest
from typer.testing import CliRunner

from companion.cli import app

STANDARD = ("--lockstep", "--out", "out")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """An empty folder; none of these may fly."""
    monkeypatch.chdir(tmp_path)

    def fly(*_, **__):
        raise AssertionError("it flew")

    monkeypatch.setattr("companion.lockstep.conduct", fly)
    monkeypatch.setattr("companion.flight.real_time.conduct", fly)
    monkeypatch.setattr("companion.flight.real_time.start_shim", fly)
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(app, ["fly", *arguments])


def told(*arguments, status=2):
    """Standard error of a command that must end with a status and say nothing on stdout."""
    result = run(*arguments)
    assert result.exit_code == status, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    return " ".join(result.stderr.split())


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--set", "hover=2"), "--set hover: unknown key 'hover'. Did you mean 'hover_s'?"),
        (("--set", "hover_s"), "--set hover_s: write KEY=VALUE"),
        (("--set", "seed=1", "--set", "seed=2"), "--set seed is given twice"),
        (("--set", "controller.l1.gamma=[-1,1,1]"), "--set controller.l1.gamma: 'l1.gamma.0': in"),
        (("--set", "controller.mpc.horizon=1000"), "--set controller.mpc.horizon: 'mpc.horizon'"),
        (
            (
                "--controller",
                "l1",
                "--set",
                "controller.l1.omega=null",
                "--set",
                "controller.l1.low_pass=" + 3 * "- {numerator: [2], denominator: [1, 1]}\n",
            ),
            "section l1: C(s) = [2.0] / [1.0, 1.0] is not stable with C(0) = 1",
        ),
        (
            ("--controller", "pid9"),
            "unknown controller 'pid9'. Give a YAML file or one of: l1, lqr-l1, mpc-l1, ",
        ),
        (
            ("--vehicle", "dc3"),
            "unknown vehicle 'dc3'. Give a YAML file or one of: arducopter, beb",
        ),
        (("--wind", "foehn"), "unknown scenario 'foehn'. Give a YAML file or one of: calm, fan, "),
        (("--wind", "foehn.yaml"), "foehn.yaml: no such file"),
        (
            ("--autopilot", "inav"),
            "--autopilot: 'autopilot': input should be 'auto', 'px4' or 'ardupilot' (given: 'i",
        ),
        (("--setpoint", "thrust"), "--setpoint: 'setpoint': input should be 'attitude' or 'rates'"),
        (("--traj", "6"), "--traj: 'trajectory': test trajectories are numbered 1 to 5"),
        (("--traj", "-1"), "--traj: 'trajectory': test trajectories are numbered 1 to 5"),
        (("--traj", "none.csv"), "none.csv: the trajectory file can't be read: No such file"),
        (("--traj", "eight"), "eight: unknown kind of trajectory file ''. Use .csv, .yaml or .yml"),
        (("--seed", "-1"), "--seed: 'seed': input should be greater than or equal to 0"),
        (("--seed", "one"), "Invalid value for '--seed'"),
        (("--mission", "none.yaml"), "none.yaml: can't be read: No such file"),
        (("--mission", "."), "can't be read: Is a directory"),
        (("--windd", "calm"), "No such option: --windd"),
        (("calm",), "unexpected extra argument"),
    ],
)
def test_bad_input(arguments, says, here):
    assert says in told(*STANDARD, *arguments)
    assert os.listdir(here) == []


def test_bad_input_leaves_stdout_empty_for_json_too(here):
    told("--json", "--set", "hover=2", *STANDARD)
    assert os.listdir(here) == []


def test_a_wrong_key_of_the_mission_is_told_with_its_line(here):
    (here / "m.yaml").write_text("# mine\nhover: 2\n")
    said = told("--mission", "m.yaml", *STANDARD)
    assert said == "error: m.yaml, line 2: unknown key 'hover'. Did you mean 'hover_s'?"


def test_an_out_of_range_gain_of_a_controllers_file_is_told_with_its_line(here):
    from companion.config.resolve import configs_folder

    text = (configs_folder() / "controllers/mpc-l1/bebop2.yaml").read_text(encoding="utf-8")
    (here / "c.yaml").write_text(text.replace("gamma: [300,", "gamma: [-300,"), encoding="utf-8")
    line = next(n for n, row in enumerate(text.splitlines(), 1) if "gamma: [300," in row)
    said = told("--controller", "c.yaml", *STANDARD)
    assert said.startswith(f"error: c.yaml, line {line}: 'l1.gamma.0': input should be greater")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("winds: [", "s.yaml, line 1: not YAML"),
        ("name: x\nwinds: [{kind: storm}]\n", "s.yaml: line 2: 'winds.0'"),
    ],
)
def test_a_wrong_scenario_is_told_before_the_flight(text, says, here):
    (here / "s.yaml").write_text(text)
    assert says in told("--wind", "s.yaml", *STANDARD)
    assert os.listdir(here) == ["s.yaml"]


@pytest.mark.parametrize(
    ("faults", "says"),
    [
        ("f.yaml", "f.yaml: line 2: the key 'link.0.los' is unknown; did you mean 'loss'?"),
        ("{vehicle: [{fault: storm}]}", "'vehicle.0'"),
        ("worse-link", "unknown fault 'worse-link'. Give a YAML file or one of: bad-link, slow-"),
    ],
)
def test_wrong_faults_are_told_before_the_flight(faults, says, here):
    (here / "f.yaml").write_text("name: x\nlink: [{los: 0.1}]\n")
    assert says in told("--faults", faults, *STANDARD)
    assert os.listdir(here) == ["f.yaml"]


def test_the_fan_has_no_place_at_a_trajectory_of_ones_own(here):
    (here / "own.csv").write_text("t,x,y,z\n0,0,0,1\n5,1,0,1\n")
    assert "--wind fan has its place at one of" in told("--traj", "own.csv", "--wind", "fan")


def test_a_vehicle_that_the_shim_does_not_have(here):
    from companion.config.resolve import configs_folder

    folder = configs_folder()
    text = (folder / "vehicles/bebop2.yaml").read_text(encoding="utf-8")
    (here / "v.yaml").write_text(text.replace("name: bebop2", "name: mine"), encoding="utf-8")
    controller = str(folder / "controllers/mpc-l1/bebop2.yaml")
    said = told("--vehicle", "v.yaml", "--controller", controller, *STANDARD)
    assert "v.yaml: the embedded shim can't fly the vehicle 'mine'. Set `name` in" in said


# A real autopilot


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--wind", "calm"), "--wind belongs to the embedded shim; with --connect"),
        (("--faults", "bad-link"), "--faults belongs to the embedded shim; a real vehicle is"),
        (("--set", "wind=calm"), "--wind belongs to the embedded shim; with --connect"),
        (("--lockstep",), "--lockstep belongs to the embedded shim; with --connect"),
    ],
)
def test_what_belongs_to_the_shim_does_not_go_with_a_real_autopilot(arguments, says, here):
    assert says in told("--connect", "udpin://127.0.0.1:0", "--out", "out", *arguments)
    assert os.listdir(here) == []


@pytest.mark.parametrize("url", ["tcp://x:1", "udpin://127.0.0.1", "udpin://h:99999", "14540", ""])
def test_a_wrong_link(url, here):
    assert "The link address" in told("--connect", url, "--out", "out")
    assert os.listdir(here) == []


def test_an_occupied_port_is_told_and_leaves_no_log(here):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        said = told("--connect", f"udpin://127.0.0.1:{port}", "--out", "out")
    assert f"The link udpin://127.0.0.1:{port} cannot be opened: " in said
    assert os.listdir(here) == []


def test_a_folder_that_was_there_stays_when_the_port_is_occupied(here):
    (here / "out").mkdir()
    (here / "out" / "notes.txt").write_text("mine")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        told("--connect", f"udpin://127.0.0.1:{other.getsockname()[1]}", "--out", "out")
    assert os.listdir(here / "out") == ["notes.txt"]


def test_a_vehicles_file_goes_with_a_real_autopilot_and_no_shim_is_started(here, monkeypatch):
    from companion.config.resolve import configs_folder
    from companion.flight.conduct import Outcome

    text = (configs_folder() / "vehicles/x500.yaml").read_text(encoding="utf-8")
    (here / "v.yaml").write_text(text.replace("hover_thrust: 0.57", "hover_thrust: 0.44"))
    flown = []

    async def conduct(config, *_, lost, **__):
        flown.append((config.vehicle.hover_thrust, lost))
        return Outcome("refused", False, "nobody there", None, 0, 0, 0, None, None, 0.0, 0.0)

    monkeypatch.setattr("companion.flight.real_time.conduct", conduct)
    result = run("--connect", "udpin://127.0.0.1:0", "--vehicle", "v.yaml", "--out", "o", "--json")
    assert result.exit_code == 3, result.output
    assert flown == [(0.44, None)]
    assert json.loads(result.stdout)["wind"] is None


# Refusals


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--set", "geofence.high_m=[0.5, 3, 3]"), "leaves the geofence at t = "),
        (("--set", "origin.offset_enu_m=[0, 0, 9]"), "leaves the geofence at t = "),
        (("--set", "vehicle.speed_limit_m_s=0.5"), "the vehicle's limit is 0.5 m/s"),
        (("--set", "vehicle.acceleration_limit_m_s2=1"), "the vehicle's limit is 1 m/s²"),
    ],
)
def test_a_trajectory_that_does_not_fit_is_refused(arguments, says, here):
    assert says in told(*STANDARD, *arguments, status=3)
    result = run("--json", *STANDARD, *arguments)
    assert result.exit_code == 3
    answer = json.loads(result.stdout)
    assert result.stdout.count("\n") == 1
    assert answer["outcome"] == "refused"
    assert says in answer["note"]
    assert answer["mean_tracking_error_m"] is None
    assert answer["log_dir"] is None
    assert os.listdir(here) == []


# The flight's folder


def test_a_folder_with_a_log_is_not_written_over(here):
    (here / "out").mkdir()
    (here / "out" / "flight.tlog").write_bytes(b"precious")
    assert "it holds a flight's log already. Choose another" in told(*STANDARD)
    assert (here / "out" / "flight.tlog").read_bytes() == b"precious"


def test_a_file_is_no_folder(here):
    (here / "out").write_text("a file")
    assert "a file has that name. Choose another folder with --out" in told(*STANDARD)
    assert "a file has that name" in told("--lockstep", "--out", "out/below")


def test_a_folder_that_can_not_be_made():
    assert "The flight cannot be recorded in /proc/flight: " in told(
        "--lockstep", "--out", "/proc/flight"
    )
