"""`companion identify`: what it refuses, and what a log says once more."""

import json
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.config.resolve import find_config
from companion.config.yaml_source import read_yaml
from companion.flight.experiment import EXPERIMENT_CHANNELS
from companion.flight.records import CHANNELS
from companion.identification.estimates import Estimate, UnidentifiedError
from companion.recording.flight_log import FlightLog
from companion.report.identification_log import read_identification
from companion.report.identification_table import Concluded, GainsVerdict


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(app, ["identify", *arguments])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--vehicle", "nope"), "unknown vehicle 'nope'"),
        (("--lockstep", "--box", "0.5"), "a box of ±0.5 m"),
        (("--lockstep", "--height", "0.6"), "a hover of 0.6 m is too low"),
        (("--lockstep", "--height", "inf"), "a hover at inf m"),
        (("--lockstep", "--set", "geofence.high_m=[2, 2, 4]"), "--box 2 fits"),
        (("--connect", "udpin://127.0.0.1:1", "--lockstep"), "--lockstep belongs to"),
        (("--connect", "udpin://127.0.0.1:1", "--wind", "calm"), "--wind belongs to"),
        (("--connect", "nonsense"), "nonsense"),
        (("--log", "there", "--lockstep"), "--log reads a flight that was flown"),
        (("--log", "there", "--connect", "udpin://127.0.0.1:1"), "--log reads a flight"),
        (("--log", "there", "--vehicle", "nope"), "unknown vehicle 'nope'"),
        (("--set", "nonsense=1"), "nonsense"),
        (("--lockstep", "--name", ""), "a vehicle needs a name"),
        (("--lockstep", "--name", "two\nlines"), "one line of printable characters"),
        (("--log", "there", "--name", "two\nlines"), "one line of printable characters"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_starts(here, arguments, said):
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith("error: ")
    assert said in result.stderr
    assert list(here.iterdir()) == []


def test_a_folder_without_a_log_is_bad_input(here):
    for folder in (here, here / "nowhere"):
        result = run("--log", str(folder), "--json")
        assert result.exit_code == 2
        assert "flight.mcap" in result.stderr
        assert "companion identify" in result.stderr
        assert result.stdout == ""
    assert list(here.iterdir()) == []


@pytest.mark.parametrize(
    "option",
    [
        ("--box", "2.5"),
        ("--height", "2.5"),
        ("--seed", "0"),
        ("--wind", "calm"),
        ("--sensors", "exact"),
        ("--autopilot", "px4"),
        ("--mission", "there.yaml"),
        ("--mocap", "vicon"),
        ("--system-id", "3"),
        ("--signing-key-file", "key"),
        ("--set", "hover_s=2"),
        ("--set", "controller.inner_pid.kp=[1, 1, 1]"),
    ],
)
def test_what_only_a_flight_could_heed_is_refused_with_a_log(here, found, option):
    result = run("--log", str(a_log(here / "log")), *option)
    assert result.exit_code == 2, result.output
    named = f"--set {option[1].partition('=')[0]}" if option[0] == "--set" else option[0]
    assert f"Leave {named} out, or --log" in result.stderr
    assert "vehicle" not in found


def test_a_folder_with_a_log_in_it_is_not_flown_into(here):
    (here / "flight.mcap").write_bytes(b"there")
    result = run("--lockstep", "--out", str(here))
    assert result.exit_code == 2
    assert "holds a flight's log already" in result.stderr
    assert (here / "flight.mcap").read_bytes() == b"there"


def a_log(folder, vehicle=None, left=""):
    """Two samples of an identification flight of the x500."""
    log = FlightLog(folder, (*CHANNELS, *EXPERIMENT_CHANNELS))
    facts = {
        "autopilot": "px4",
        "thrust_kind": "collective",
        "thrust_climb_m_s": 0.0,
        "thrust_descent_m_s": 0.0,
        "vehicle": vehicle or dict(read_yaml(find_config("vehicle", "x500")).data),
    }
    log.record("experiment", 1.0, facts)
    for time_s in (2.0, 2.01):
        log.record(
            "control",
            time_s,
            {
                "autopilot_time_s": time_s,
                "received_s": time_s,
                "loop_delay_s": 0.03,
                "phase": "track",
                "rung": "track",
                "position_enu_m": [0.0, 0.0, 2.5],
                "velocity_enu_m_s": [0.0, 0.0, 0.0],
                "attitude_flu_to_enu": [1.0, 0.0, 0.0, 0.0],
                "rate_flu_rad_s": [0.0, 0.0, 0.0],
                "attitude_setpoint_flu_to_enu": [1.0, 0.0, 0.0, 0.0],
                "thrust": 0.5,
                "applied_u": [0.0, 0.0, 0.0],
                "roll_rad": 0.0,
                "pitch_rad": 0.0,
                "segment": "hover",
                "left": left,
            },
        )
    log.close()
    return folder


@pytest.fixture
def found(monkeypatch):
    """What stands in for the fit and for the gains: they have tests of their own."""
    seen = {}

    def identify(recording, *, thrust_curve):
        seen["samples"] = len(recording)
        return SimpleNamespace()

    def conclude(identified, recording, vehicle, folder, source, progress):
        progress(1, 2)
        seen.update(vehicle=vehicle, folder=folder, source=source)
        certified = seen.get("certified", True)
        record = {"verdict": "identified" if certified else "uncertified", "files": ["there"]}
        plus = GainsVerdict("mpc-l1-plus", certified, "" if certified else "x: too quick")
        return Concluded((GainsVerdict("mpc-l1", holds=True), plus), seen.get("wide", ()), record)

    monkeypatch.setattr("companion.commands.identify.identify", identify)
    monkeypatch.setattr("companion.commands.identify.conclude", conclude)
    one = Estimate(1.5, 0.25, "rad/s")
    monkeypatch.setattr(
        "companion.report.identification_table.estimates_of", lambda _: iter([("roll", one)])
    )
    return seen


def test_a_log_is_identified_as_the_vehicle_that_was_flown(here, found):
    result = run("--log", str(a_log(here / "log")))
    assert result.exit_code == 0, result.output
    assert "2 samples in 0 s under px4: hover 2" in result.stderr
    assert "1.5" in result.stdout
    assert "0.25" in result.stdout
    assert "gains of mpc-l1 are certified: every condition holds" in result.stdout
    assert "gains of mpc-l1-plus are certified: every condition holds" in result.stdout
    assert "looking for gains: 1 of 2 rounds" in result.stderr
    assert found["samples"] == 2
    assert (found["vehicle"].name, found["vehicle"].tilt_limit_deg) == ("x500", 35.0)
    assert found["folder"] == here / "log"
    assert f"from the log {here / 'log'}" in found["source"]


def test_limits_and_name_may_be_others_and_the_files_go_elsewhere(here, found):
    log = a_log(here / "log")
    options = ("--vehicle", "sih_quadx", "--name", "mine", "--out", str(here / "files"))
    assert run("--log", str(log), *options).exit_code == 0
    assert (found["vehicle"].name, found["vehicle"].tilt_limit_deg) == ("mine", 40.0)
    assert found["folder"] == here / "files"
    assert found["folder"].is_dir()


def test_what_was_left_on_a_flight_that_is_read_again_is_told(here, found):
    left = "the part 'roll' is not played beyond 0.3 of its 7.8 s: wind"
    result = run("--log", str(a_log(here / "log", left=left)))
    assert result.stderr.count(f"warning: {left}") == 1
    assert "warning" not in run("--log", str(a_log(here / "other"))).stderr


def test_limits_of_a_log_may_be_set_one_by_one(here, found):
    log = str(a_log(here / "log"))
    setting = ("--set", "vehicle.tilt_limit_deg=21")
    assert run("--log", log, *setting).exit_code == 0
    assert (found["vehicle"].name, found["vehicle"].tilt_limit_deg) == ("x500", 21.0)
    assert run("--log", log, "--vehicle", "sih_quadx", *setting).exit_code == 0
    assert (found["vehicle"].name, found["vehicle"].tilt_limit_deg) == ("sih_quadx", 21.0)
    refused = run("--log", log, "--set", "vehicle.tilt_limit_deg=-1")
    assert refused.exit_code == 2
    assert "--set vehicle.tilt_limit_deg" in refused.stderr


def test_the_limits_that_were_flown_are_those_that_are_written(here, found, monkeypatch):
    def fly(plan, log, *others, **options):
        asked = plan.config.vehicle
        assert (asked.name, asked.tilt_limit_deg) == ("x500", 21.0)
        a_log(here / "flown", vehicle=asked.model_dump(mode="json"))
        return SimpleNamespace(outcome="landed", completed=True, note="")

    monkeypatch.setattr("companion.commands.identify._fly", fly)
    monkeypatch.setattr("companion.commands.identify._keep_result", lambda *_: None)
    monkeypatch.setattr(
        "companion.commands.identify.read_identification",
        lambda _: read_identification(here / "flown"),
    )
    options = ("--vehicle", "x500", "--name", "mine", "--set", "vehicle.tilt_limit_deg=21")
    result = run("--lockstep", "--seed", "7", *options)
    assert result.exit_code == 0, result.output
    assert (found["vehicle"].name, found["vehicle"].tilt_limit_deg) == ("mine", 21.0)
    assert "flown in the embedded shim, seed 7" in found["source"]


def test_gains_without_a_certificate_have_an_exit_status_of_their_own(here, found):
    found["certified"] = False
    log = a_log(here / "log")
    told = run("--log", str(log))
    assert told.exit_code == 1
    assert "mpc-l1 are certified" in told.stdout
    assert "mpc-l1-plus are not certified: x: too quick" in told.stdout
    result = run("--log", str(log), "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout)["verdict"] == "uncertified"


def test_what_is_known_roughly_is_said_and_is_no_failure(here, found):
    found["wide"] = ("roll ωn 10 ± 3 rad/s (wider than 10%)",)
    result = run("--log", str(a_log(here / "log")))
    assert result.exit_code == 0
    assert "identified, but" in result.stdout
    assert "roll ωn 10 ± 3 rad/s" in result.stdout


def test_what_cannot_be_told_from_a_flight_is_said(here, found, monkeypatch):
    def identify(recording, *, thrust_curve):
        raise UnidentifiedError("the part 'roll' is missing: fly it again")

    monkeypatch.setattr("companion.commands.identify.identify", identify)
    result = run("--log", str(a_log(here / "log")), "--json")
    assert result.exit_code == 4
    told = json.loads(result.stdout)
    assert told["verdict"] == "unidentified"
    assert "the part 'roll' is missing" in told["note"]
    assert "vehicle" not in found
