"""`companion check`: its options, its statuses, and what it prints."""

import json

import pytest

from companion.commands.check import BadInputError, CheckRequest, run_check
from companion.preflight.finding import Verdict


def request(*, settings=(), overrides=None, **options):
    return CheckRequest(None, overrides or {}, tuple(settings), **options)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"overrides": {"connect": "udp:14540"}}, "udpin://HOST:PORT"),
        ({"overrides": {"vehicle": "airbus"}}, "unknown vehicle 'airbus'"),
        ({"overrides": {"autopilot": "betaflight"}}, "autopilot"),
        ({"overrides": {"trajectory": "none.csv"}}, "none.csv"),
        ({"settings": ["preflight.battery_warn_below=0.1"]}, "battery_refuse_below"),
        ({"overrides": {"connect": "udpin://127.0.0.1:1"}, "lockstep": True}, "--lockstep belongs"),
    ],
)
def test_what_cannot_be_asked_for(options, text):
    with pytest.raises(BadInputError) as raised:
        run_check(request(**options))
    assert text in str(raised.value)


def test_restoring_needs_a_vehicle_and_a_list_and_nothing_to_set(tmp_path):
    path = tmp_path / "restore.json"
    with pytest.raises(BadInputError, match="give --connect"):
        run_check(request(restore=path))
    connected = {"connect": "udpin://127.0.0.1:0"}
    with pytest.raises(BadInputError, match="cannot be read"):
        run_check(request(overrides=connected, restore=path))
    with pytest.raises(BadInputError, match="give one of them"):
        run_check(request(overrides=connected, restore=path, fix=True))
    with pytest.raises(BadInputError, match="--out does not go with --restore"):
        run_check(request(overrides=connected, restore=path, out=path))
    with pytest.raises(BadInputError, match="--out names the restore file"):
        run_check(request(overrides=connected, out=path))


@pytest.mark.parametrize(
    ("autopilot", "verdict", "last"),
    [
        ("px4", Verdict.OK, "fine: nothing stands against a flight"),
        ("ardupilot", Verdict.WARNING, "2 warnings: it would fly, see above"),
    ],
)
def test_for_a_person(capsys, autopilot, verdict, last):
    overrides = {"autopilot": autopilot, "seed": 1}
    assert run_check(request(overrides=overrides, lockstep=True)) is verdict
    out, err = capsys.readouterr()
    assert err == ""
    assert max(map(len, out.splitlines())) <= 80
    assert out.splitlines()[0] == "check of the embedded shim (bebop2)"
    assert out.splitlines()[-1] == last


def test_for_a_machine_one_object_and_nothing_else(capsys, tmp_path):
    overrides = {"autopilot": "ardupilot", "seed": 1}
    options = {"lockstep": True, "json_output": True, "fix": True, "out": tmp_path / "r.json"}
    run_check(request(overrides=overrides, **options))
    out, err = capsys.readouterr()
    data = json.loads(out)
    assert data["link"] == "the embedded shim (bebop2)"
    assert data["measured"]["identity"]["autopilot"] == "ardupilot"
    assert [line.split()[1] for line in err.splitlines()] == [
        "GUID_TIMEOUT",
        "MAV_GCS_SYSID",
        "FS_GCS_ENABLE",
    ]


@pytest.mark.parametrize(
    ("verdict", "status"), [("ok", 0), ("note", 0), ("warning", 1), ("refusal", 3)]
)
def test_the_exit_status_is_the_verdict(monkeypatch, verdict, status):
    from typer.testing import CliRunner

    from companion.cli import app
    from companion.commands import check as check_command

    asked = []
    monkeypatch.setattr(
        check_command, "run_check", lambda request: asked.append(request) or Verdict(verdict)
    )
    done = CliRunner().invoke(app, ["check", "--traj", "3", "--set", "hover_s=1"])
    assert done.exit_code == status
    assert asked[0].overrides == {"trajectory": 3}
    assert asked[0].settings == ("hover_s=1",)


@pytest.mark.parametrize(("error", "status"), [(BadInputError("no"), 2), (KeyboardInterrupt(), 4)])
def test_the_exit_status_when_nothing_came_of_it(monkeypatch, error, status):
    from typer.testing import CliRunner

    from companion.cli import app
    from companion.commands import check as check_command

    def fail(request):
        raise error

    monkeypatch.setattr(check_command, "run_check", fail)
    assert CliRunner().invoke(app, ["check"]).exit_code == status
