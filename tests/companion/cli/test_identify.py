"""`companion identify`: what it refuses, and what a log says once more."""

import json

import pytest
from typer.testing import CliRunner

from companion.cli import app


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
        (("--connect", "udpin://127.0.0.1:1", "--lockstep"), "--lockstep belongs to"),
        (("--connect", "udpin://127.0.0.1:1", "--wind", "calm"), "--wind belongs to"),
        (("--connect", "nonsense"), "nonsense"),
        (("--log", "there", "--lockstep"), "--log reads a flight that was flown"),
        (("--log", "there", "--connect", "udpin://127.0.0.1:1"), "--log reads a flight"),
        (("--log", "there", "--vehicle", "nope"), "unknown vehicle 'nope'"),
        (("--set", "nonsense=1"), "nonsense"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_starts(here, arguments, said):
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert result.stderr.startswith("error: ")
    assert said in result.stderr
    assert list(here.iterdir()) == []


def test_a_folder_without_a_log_is_told_to_be_none(here):
    result = run("--log", str(here), "--json")
    assert result.exit_code == 4
    told = json.loads(result.stdout)
    assert told["verdict"] == "unidentified"
    assert "flight.mcap" in told["note"]
    assert "companion identify" in told["note"]


def test_a_folder_with_a_log_in_it_is_not_flown_into(here):
    (here / "flight.mcap").write_bytes(b"there")
    result = run("--lockstep", "--out", str(here))
    assert result.exit_code == 2
    assert "holds a flight's log already" in result.stderr
    assert (here / "flight.mcap").read_bytes() == b"there"
