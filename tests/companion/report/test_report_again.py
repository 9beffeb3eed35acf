"""A flight's page from its folder alone: of a finished flight as it was, of one that was cut off as
far as its log goes."""

import json
import re
import shutil
from html import escape

import pytest

from companion.commands.fly import FlyRequest, run_fly
from companion.commands.report import ReportRequest, run_report
from companion.config.yaml_source import ConfigError
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME
from companion.report.again import report_flight
from companion.report.pages.provenance import Provenance
from tests.flights.bench import SHORT

MADE = Provenance("companion report here", "1.2.3")


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A short flight in lockstep, with all that the command makes of it."""
    folder = tmp_path_factory.mktemp("flown")
    (folder / "short.csv").write_text(SHORT)
    overrides = {"trajectory": str(folder / "short.csv"), "seed": 1}
    out = folder / "flight"
    run_fly(FlyRequest(None, overrides, ("hover_s=0.2",), True, out, True, False))
    return out


@pytest.fixture
def folder(flown, tmp_path):
    return shutil.copytree(flown, tmp_path / "flight")


def cut_off(folder, share):
    """As `kill -9` leaves it: the logs end somewhere, and nothing was made of them."""
    for name in ("result.json", "report.html", "track.png"):
        (folder / name).unlink()
    for name in (MCAP_NAME, TLOG_NAME):
        whole = (folder / name).read_bytes()
        (folder / name).write_bytes(whole[: int(share * len(whole))])


def test_a_finished_flight_has_the_same_page_again(folder):
    before, picture = (folder / "report.html").read_text(), (folder / "track.png").read_bytes()
    for name in ("report.html", "track.png"):
        (folder / name).unlink()
    result = json.loads((folder / "result.json").read_text())

    made = report_flight(folder, MADE)

    assert made.result == result | {"log_dir": str(folder)}
    after = made.page.read_text()
    glance = before[before.index("<main") : before.index("<figure")]
    assert glance in after
    assert "companion report here" in after
    assert result["command"].startswith("companion fly --traj ")
    assert f"<code>{escape(result['command'])}</code>" in after
    assert (folder / "track.png").read_bytes() == picture


@pytest.mark.parametrize(
    ("share", "completed", "sentence"),
    [
        (0.3, False, "the flight was cut off in the phase “"),
        (0.6, False, "were flown, then the flight was cut off: the log ends in the phase “track”"),
        (0.8, True, "It did not end as planned: the log ends in the phase “"),
    ],
)
def test_a_flight_that_was_cut_off_has_its_page_as_far_as_its_log_goes(
    folder, share, completed, sentence
):
    cut_off(folder, share)

    made = report_flight(folder, MADE)

    assert made.result["outcome"] == "unfinished"
    assert made.result["completed"] == completed
    assert sentence in made.page.read_text()
    assert not (folder / "result.json").exists(), "it may still fly"


def test_what_a_log_says_of_a_whole_flight_is_its_result(folder):
    result = json.loads((folder / "result.json").read_text())
    cut_off(folder, 1.0)

    made = report_flight(folder, MADE).result

    not_recorded = {"command", "outcome", "note", "wall_s", "log_dir", "autopilot", "monitor_worst"}
    assert made.pop("flight_s") <= result.pop("flight_s"), "the landing is in no record"
    assert {k: v for k, v in made.items() if k not in not_recorded} == {
        k: v for k, v in result.items() if k not in not_recorded
    }


def test_the_command_tells_and_writes(folder, capsys):
    (folder / "report.html").unlink()
    run_report(ReportRequest(folder / MCAP_NAME))
    told = capsys.readouterr().out
    assert "landed" in told
    assert str(folder / "report.html") in told
    assert (folder / "report.html").is_file()


def falsify(folder, **values):
    path = folder / "result.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | values))


@pytest.mark.parametrize(
    ("hurt", "text"),
    [
        (lambda folder: (folder / MCAP_NAME).write_bytes(b""), "ends before a flight began"),
        (lambda folder: (folder / MCAP_NAME).write_text("no log at all" * 9), "not the log of a"),
        (lambda folder: (folder / TLOG_NAME).unlink(), "not there"),
        (lambda folder: (folder / "result.json").write_text("[1, 2]"), "it lacks"),
        (lambda folder: (folder / "result.json").write_text("{}"), "it lacks .*outcome"),
        (lambda folder: (folder / "result.json").write_text('{"outcome": '), "Expecting"),
        (lambda folder: falsify(folder, wall_s="x"), "not what this version writes"),
        (lambda folder: falsify(folder, flight_s=float("nan")), "NaN is no figure"),
    ],
)
def test_what_can_not_be_read_is_told_with_its_file(folder, hurt, text):
    hurt(folder)
    with pytest.raises(ConfigError, match=f"^{re.escape(str(folder))}/[a-z.]+: .*{text}") as caught:
        report_flight(folder, MADE)
    assert str(caught.value).count(str(folder)) == 1


def test_a_flights_page_lies_nowhere_else(folder, tmp_path):
    with pytest.raises(ConfigError, match="Leave --out out"):
        run_report(ReportRequest(folder, tmp_path / "elsewhere"))
