"""`companion replay` and `companion recover`: what their options become, and their exit status."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.commands import recover as recover_command
from companion.commands import replay as replay_command
from companion.commands.recover import RecoverRequest
from companion.commands.replay import BadInputError, ReplayRequest


def run(*arguments):
    return CliRunner().invoke(app, arguments)


@pytest.fixture
def asked(monkeypatch):
    """What the commands were asked for; both end with 1."""
    found = []

    def answer(request):
        found.append(request)
        return 1

    monkeypatch.setattr(replay_command, "run_replay", answer)
    monkeypatch.setattr(recover_command, "run_recover", answer)
    return found


def test_replay_hands_on_its_options_and_its_status(asked):
    assert run("replay", "flights/1").exit_code == 1
    assert run("replay", "a", "--controller", "pid-l1", "--json", "--out", "b").exit_code == 1
    assert asked == [
        ReplayRequest(Path("flights/1"), None, False),
        ReplayRequest(Path("a"), "pid-l1", True, Path("b")),
    ]


def test_recover_hands_on_its_options_and_its_status(asked):
    assert run("recover", "flights/1").exit_code == 1
    assert run("recover", "a.mcap", "--out", "b.mcap").exit_code == 1
    assert asked == [
        RecoverRequest(Path("flights/1")),
        RecoverRequest(Path("a.mcap"), Path("b.mcap")),
    ]


def test_a_log_that_cannot_be_replayed_is_bad_input(monkeypatch):
    def refuse(request):
        raise BadInputError("no such log")

    monkeypatch.setattr(replay_command, "run_replay", refuse)
    result = run("replay", "nope")
    assert (result.exit_code, result.output) == (2, "error: no such log\n")


def test_what_is_not_there_cannot_be_recovered():
    assert run("recover", "/nowhere/flight.mcap").exit_code == 2
