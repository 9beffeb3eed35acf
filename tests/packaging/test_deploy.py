"""What is shipped for a vehicle's computer: nothing flies by itself, and stopping it lands."""

import configparser
import json
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.config.models import TimeoutsConfig

DEPLOY = Path(__file__).parents[2] / "deploy"
UNIT = DEPLOY / "companion.service"
TO_BE_SURE_AND_WRITE_S = 60.0


@pytest.fixture(scope="module")
def unit():
    parser = configparser.ConfigParser(strict=False, interpolation=None, delimiters=("=",))
    parser.optionxform = str
    parser.read_string(UNIT.read_text())
    return parser


def instructions(name):
    """What stands behind an instruction of the Dockerfile, one entry for each."""
    text = (DEPLOY / "Dockerfile").read_text().replace("\\\n", " ")
    lines = [line.split(maxsplit=1) for line in text.splitlines() if not line.startswith("#")]
    return [line[1] for line in lines if line and line[0] == name]


def test_nothing_brings_the_service_up_but_a_person(unit):
    assert unit.sections() == ["Unit", "Service"], "an [Install] section could be enabled at boot"
    assert unit["Service"]["Restart"] == "no"
    assert [path.suffix for path in DEPLOY.iterdir() if path.stem == "companion"] == [".service"]


def test_stopping_the_service_lands_and_gives_it_the_time(unit):
    service = unit["Service"]
    assert service["KillSignal"] == "SIGINT"
    assert service["KillMode"] == "mixed"  # what the flight has started is not interrupted with it
    needed_s = TimeoutsConfig().land_s + TO_BE_SURE_AND_WRITE_S
    assert float(service["TimeoutStopSec"]) >= needed_s


def test_the_service_flies_by_a_command_that_there_is(unit):
    program, *arguments = shlex.split(unit["Service"]["ExecStart"])
    assert Path(program).name == "companion"
    mission = Path(arguments[arguments.index("--mission") + 1])
    assert str(mission) == unit["Unit"]["ConditionPathExists"]
    assert not mission.exists()
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2
    assert str(mission) in done.output, "the options are read; only the file is not there"


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
def test_systemd_takes_the_unit(unit, tmp_path):
    program = shlex.split(unit["Service"]["ExecStart"])[0]
    there = tmp_path / UNIT.name
    there.write_text(UNIT.read_text().replace(program, shutil.which("true")))
    command = ["systemd-analyze", "verify", "--man=no", str(there)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60.0)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_container_does_nothing_unasked_lands_when_stopped_and_is_not_root():
    assert [json.loads(text) for text in instructions("ENTRYPOINT")] == [["companion"]]
    assert [json.loads(text) for text in instructions("CMD")] == [["--help"]]
    assert instructions("STOPSIGNAL") == ["SIGINT"]
    (user,) = instructions("USER")
    assert user.split(":")[0] not in ("0", "root")
    assert instructions("COPY") == ["dist/companion-*.whl /tmp/"]
