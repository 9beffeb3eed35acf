"""`companion faults`: which rows it flies, and how it tells what came of them."""

import json
import re
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.commands import faults as faults_command
from companion.commands.faults import FaultsRequest, run_faults
from companion.experiments.faults.study import StudyInterruptedError
from tests.companion.experiments.faults import made_up


def run(folder, *only, **options):
    request = FaultsRequest(only=only, jobs=1, out=folder, **options)
    return run_faults(request, made_up.verdict)


def test_a_failed_row_is_told_with_its_promise_and_how_to_fly_it_again(tmp_path, capsys):
    assert not run(tmp_path, "delay", "reboot")
    said = " ".join(capsys.readouterr().out.split())
    assert "failed delay (ardupilot) the trajectory was not flown to its end" in said
    assert "again: companion fly --lockstep --traj " in said
    assert "failed reboot (px4) ValueError: no such <fault>" in said
    assert "0 rows passed, 2 failed" in said


def test_all_that_passes_is_told_as_passed(tmp_path, capsys):
    assert run(tmp_path, "delay", "jitter", autopilot="px4")
    assert "2 rows passed, 0 failed" in capsys.readouterr().out


def test_the_files_say_the_same_as_the_terminal(tmp_path, capsys):
    run(tmp_path, "delay", "reboot", json_output=True)
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((tmp_path / "faults.json").read_text())
    assert told["counts"] == {"passed": 0, "failed": 2, "not flown": 0}
    delay, reboot = told["rows"]
    assert [flight["passed"] for flight in delay["flights"]] == [True, False]
    assert delay["flights"][0]["measured"]["detected_after_s"] == pytest.approx(0.2)
    assert delay["flights"][1]["broken"] == ["the trajectory was not flown to its end"]
    assert reboot["flights"][0]["broken"] == ["ValueError: no such <fault>"]
    assert told["made"]["command"] == "companion faults --only delay --only reboot --seed 1"


def test_the_page_needs_nothing_but_itself(tmp_path):
    run(tmp_path, "delay", "reboot")
    page = (tmp_path / "faults.html").read_text(encoding="utf-8")
    links = re.findall(r'(?:src|href)="([^"#][^"]*)"', page)
    assert links == ["faults.json"]
    assert "no such &lt;fault&gt;" in page
    assert page.count("<svg ") == 2
    for drawing in re.findall(r"<svg .*?</svg>", page, re.DOTALL):
        names = {text.text for text in ElementTree.fromstring(drawing).iter("text")}
        assert {"error, mm", "tilt, °", "fault", "seen", "track"} <= names


def test_rows_of_a_process_are_shown_as_not_flown(tmp_path, capsys):
    table = tmp_path / "t.yaml"
    sentences = "{name: kill, group: process, what: x, detected: x, done: x, seen: x, test: t.py::t"
    table.write_text(f"rows:\n  - {sentences}, kind: process}}\n")
    assert run(tmp_path, table=table)
    assert "run by pytest -m faults" in capsys.readouterr().out
    page = (tmp_path / "faults.html").read_text(encoding="utf-8")
    assert "run by pytest -m faults" in page
    assert json.loads((tmp_path / "faults.json").read_text())["counts"]["not flown"] == 1


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--only", "nope"), "--only nope: there is no such row."),
        (("--autopilot", "cleanflight"), "--autopilot cleanflight: give px4, ardupilot or both."),
        (("nope.yaml",), "nope.yaml: can't be read"),
    ],
)
def test_what_can_not_be_flown_is_refused(tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["faults", *arguments])
    assert result.exit_code == 2, result.output
    assert says in result.output


@pytest.mark.parametrize(
    ("ending", "status"),
    [
        (lambda request: True, 0),
        (lambda request: False, 1),
        (StudyInterruptedError("interrupted: nothing was written."), 4),
        (OSError("disk full"), 2),
    ],
)
def test_the_exit_status_says_how_it_ended(monkeypatch, ending, status):
    def end(request):
        if isinstance(ending, Exception):
            raise ending
        return ending(request)

    monkeypatch.setattr(faults_command, "run_faults", end)
    assert CliRunner().invoke(app, ["faults"]).exit_code == status
