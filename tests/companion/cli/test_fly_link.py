"""What of the link can't be had is told in a sentence, and nothing is started."""

import pytest
from typer.testing import CliRunner

from companion.cli import app

LOCAL = "link.forward=[{url: 'udpin://127.0.0.1:14600'}]"


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
    return CliRunner().invoke(app, ["fly", "--out", "out", *arguments])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--lockstep", "--set", LOCAL), "real time"),
        (("--lockstep", "--set", "link.mission_backend=mavsdk"), "real time"),
        (("--set", "link.forward=[{url: 'udpin://0.0.0.0:14600'}]"), "remote: true"),
        (("--set", "link.forward=[{url: 'udpout://192.168.1.20:14550'}]"), "remote: true"),
        (("--set", "link.forward=[{url: 'tcpout://127.0.0.1:5760'}]"), "cannot be forwarded to"),
        (("--set", "link.forward=[{url: '127.0.0.1:5760'}]"), "scheme"),
        (("--connect", "serial:///dev/ttyACM0"), "no baud rate"),
        (("--connect", "serial:///dev/no-such-device:57600"), "there is no device"),
        (("--connect", "tcpout://no-such-host.invalid:5760"), "is not known"),
        (("--lockstep", "--system-id", "0"), "link.system_id"),
        (("--lockstep", "--system-id", "256"), "link.system_id"),
    ],
)
def test_what_is_wrong_with_the_link_is_told(here, arguments, says):
    result = run(*arguments)

    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert says in " ".join(result.stderr.split())
    assert not (here / "out").exists()


def test_the_system_to_fly_comes_from_the_command_line(monkeypatch):
    chosen = []

    def fly(config, *_, **__):
        chosen.append(config.mission.link.system_id)
        raise KeyboardInterrupt

    monkeypatch.setattr("companion.commands.fly._fly", fly)
    run("--lockstep", "--system-id", "3")

    assert chosen == [3]
