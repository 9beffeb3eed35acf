"""`report.html` of a flight, from its logs."""

import json

import pytest

from companion.commands.fly_again import flying_command
from companion.report.aftermath import score_and_draw
from tests.companion.report.pages.flight_folder import (
    MADE,
    REAL_TIME,
    config,
    fly_page,
    outcome,
    record,
)
from tests.companion.report.pages.sound_page import check_page


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flight")
    path, result, trouble = fly_page(folder)
    assert trouble is None
    return check_page(path), folder, result


def test_the_page_is_sound_and_begins_with_the_answer(flown):
    page, _, result = flown
    assert result["mean_tracking_error_m"] == pytest.approx(0.03, abs=1e-4)
    assert "Tracked to 30.0 mm on average; the largest error, 30.0 mm, came at" in page.said
    assert "glance good" in page.source


def test_the_figures_are_there_with_units_and_captions(flown):
    page, _, _ = flown
    assert {"path", "error", "tilt-thrust", "adaptation", "monitor", "timing"} <= set(page.ids)
    for label in ("north, m", "up, m", "commanded tilt, °", "ỹ, m/s", "computing, µs"):
        assert label in page.text
    assert "time since the trajectory's start, s" in page.text
    assert "latency, ms" not in page.text


def test_phases_files_and_commands_are_told(flown):
    page, folder, _ = flown
    assert {"flight.mcap", "flight.tlog", "result.json", "track.png"} == set(page.links)
    assert "connect0.0−4.02.0made up" in "".join(page.text).replace("\n", "")
    for command in ("live", "replay", "export"):
        assert f"companion {command} {folder}" in page.said
    assert MADE.command in page.text
    assert "companion 0.1.0, commit abc1234" in page.said


def test_the_same_flight_in_real_time_shows_its_latency_and_its_deadline(tmp_path):
    path, _, _ = fly_page(tmp_path, outcome(latency=REAL_TIME))
    page = check_page(path)
    assert "latency, ms" in page.text
    assert "deadline" in page.text
    assert "12.0 s in real time" in page.said


def test_a_flight_that_broke_off_says_why_with_what_the_autopilot_said(tmp_path):
    said = [
        (7.0, "warning", "the autopilot says: <b>Battery</b> low"),
        (8.5, "error", "handing over: no state"),
        (8.5, "info", "phase handed over: no state"),
    ]
    made = outcome("aborted", completed=False, note="no state for 0.8 s; the autopilot landed.")
    path, _, trouble = fly_page(tmp_path, made, end_s=8.0, fallback_s=(7.5, 8.0), messages=said)
    assert trouble is None
    page = check_page(path)
    assert "glance bad" in page.source
    assert (
        "Did not track to the end: 3.5 s of 6.0 s were flown, then the flight was aborted: no "
        "state for 0.8 s; the autopilot landed."
    ) in page.said
    assert "Once on a fallback, 0.48 s in all (shifted plan). The supervisor said: no state." in (
        page.said
    )
    assert "The autopilot said: <b>Battery</b> low." in page.said
    assert "handed over" in page.text


def test_a_flight_that_never_tracked_has_a_page_that_counts_from_the_logs_beginning(tmp_path):
    made = outcome("aborted", completed=False, note="no state")
    path, _, trouble = fly_page(tmp_path, made, end_s=3.5)
    assert trouble is None
    page = check_page(path)
    assert "aborted in the phase “hover”, 3.5 s after the log's beginning: no state." in page.said
    assert "time since the log's beginning, s" in page.text


def test_a_refused_flight_has_a_page_without_figures(tmp_path):
    path, _, trouble = fly_page(
        tmp_path, outcome("refused", completed=False, note="not ready", scored_s=None), end_s=0.0
    )
    assert trouble is None
    page = check_page(path)
    assert "Did not fly: not ready." in page.said
    assert page.figures == []


def test_without_being_asked_no_page_is_written(tmp_path):
    record(tmp_path)
    assert score_and_draw(config(), outcome(), tmp_path, 1.0)[1] is None
    assert not (tmp_path / "report.html").exists()


def test_logs_that_can_not_be_read_leave_a_page_that_says_so(tmp_path):
    record(tmp_path)
    (tmp_path / "flight.mcap").write_bytes(b"not a log at all" * 9)
    result, trouble = score_and_draw(config(), outcome(), tmp_path, 1.0, MADE)
    page = check_page(tmp_path / "report.html")
    assert result["outcome"] == "landed"
    assert trouble
    assert trouble in page.said


def test_no_trouble_of_the_page_costs_the_result(tmp_path, monkeypatch):
    def broken(*_):
        raise KeyError("no such key")

    record(tmp_path)
    monkeypatch.setattr("companion.report.flight_page.page.write_page", broken)
    result, trouble = score_and_draw(config(), outcome(), tmp_path, 1.0, MADE)
    assert "no such key" in trouble
    assert json.loads((tmp_path / "result.json").read_text()) == result
    assert result["mean_tracking_error_m"] == pytest.approx(0.03, abs=1e-4)


def test_the_command_that_flies_it_again_has_what_was_asked_for(tmp_path):
    command = flying_command(
        tmp_path / "my mission.yaml",
        {"seed": 3, "trajectory": 4, "switch": ["t=3:pid", "t=5:l1-off"], "wind": "fan"},
        ("controller.mpc.r_max_m_s2=50", "preflight.fix=true"),
        None,
        lockstep=True,
    )
    assert command == (
        f"companion fly --mission '{tmp_path}/my mission.yaml' --traj 4 --wind fan --seed 3 "
        "--switch t=3:pid --switch t=5:l1-off --set controller.mpc.r_max_m_s2=50 "
        "--set preflight.fix=true --lockstep"
    )
