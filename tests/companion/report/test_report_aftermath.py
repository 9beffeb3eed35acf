import json

import pytest

from companion.config.resolve import load_flight
from companion.flight.conduct import Outcome
from companion.flight.records import CHANNELS
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME, FlightLog
from companion.report.aftermath import score_and_draw
from tests.companion.report.test_report_flight_data import control, odometry

LANDED = Outcome("landed", True, "", (0.5, 1.5), 200, 0, 0, None, None, 0.0, 2.0)


@pytest.fixture
def folder(tmp_path):
    """Two seconds of hovering 5 cm too far to the east, truly; 4 cm as reported."""
    log = FlightLog(tmp_path, CHANNELS)
    for step in range(200):
        time_s = 0.01 * step
        log.record("control", time_s, control(time_s, position_enu_m=(0.04, 0.0, 0.0)))
        log.frame_in(time_s, odometry(time_s, (0.0, 0.05, 0.0)))
    log.close()
    return tmp_path


def test_a_flight_is_scored_drawn_and_written(folder):
    result, trouble = score_and_draw(load_flight(None, {}, {}), LANDED, folder, 1.0)

    assert trouble is None
    assert result["mean_tracking_error_m"] == pytest.approx(0.05)
    assert result["reported_mean_tracking_error_m"] == pytest.approx(0.04)
    assert json.loads((folder / "result.json").read_text()) == result
    assert (folder / "track.png").stat().st_size > 10_000


@pytest.mark.parametrize("name", [MCAP_NAME, TLOG_NAME])
@pytest.mark.parametrize("content", [None, b"not a log at all, but some other text\n" * 9])
def test_logs_that_can_not_be_read_cost_the_figures_but_not_the_result(folder, name, content):
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_bytes(content)

    result, trouble = score_and_draw(load_flight(None, {}, {}), LANDED, folder, 1.0)

    assert trouble
    assert result["outcome"] == "landed"
    assert result["mean_tracking_error_m"] is None
    assert json.loads((folder / "result.json").read_text()) == result


def test_logs_without_a_record_give_what_the_other_one_has(folder):
    (folder / TLOG_NAME).write_bytes(b"")
    result, trouble = score_and_draw(load_flight(None, {}, {}), LANDED, folder, 1.0)
    assert (trouble, result["error_against"]) == (None, "reported position")

    (folder / MCAP_NAME).write_bytes(b"")
    result, trouble = score_and_draw(load_flight(None, {}, {}), LANDED, folder, 1.0)
    assert (trouble, result["error_against"]) == (None, None)


def test_a_folder_that_can_not_be_written_is_told(folder):
    (folder / "result.json").mkdir()

    result, trouble = score_and_draw(load_flight(None, {}, {}), LANDED, folder, 1.0)

    assert "result.json" in trouble
    assert result["outcome"] == "landed"


def test_a_flight_that_never_tracked_has_a_result_and_no_picture(tmp_path):
    FlightLog(tmp_path, CHANNELS).close()
    refused = Outcome("refused", False, "not ready", None, 0, 0, 0, None, None, 0.0, 0.0)

    result, trouble = score_and_draw(load_flight(None, {}, {}), refused, tmp_path, 1.0)

    assert (trouble, result["mean_tracking_error_m"]) == (None, None)
    assert not (tmp_path / "track.png").exists()
