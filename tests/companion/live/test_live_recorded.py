"""Recorded flights on the page: what the frames say is what was recorded."""

import json
import math
import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.live.watching import MOST_FRAMES, RecordedFlightError, Watched, watch_recorded
from companion.recording.mcap_log import read_records


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A short flight through a fan's jet."""
    where = tmp_path_factory.mktemp("flown") / "flight"
    done = CliRunner().invoke(
        app, ["fly", "--traj", "2", "--wind", "fan", "--lockstep", "--out", str(where)]
    )
    assert done.exit_code == 0, done.output
    return where


@pytest.fixture(scope="module")
def watched(folder) -> Watched:
    return watch_recorded(folder)


def test_frames_come_twenty_times_a_second_in_order(watched) -> None:
    times = [frame["t"] for frame in watched.frames]
    steps = np.diff(times)
    assert times[0] >= 0.0
    assert steps.min() >= 0.05 - 1e-6
    assert np.median(steps) < 0.075
    assert times[-1] == pytest.approx(watched.flight["duration_s"], abs=0.2)


def test_everything_is_json_without_numbers_that_are_none(watched) -> None:
    json.dumps([watched.flight, watched.frames, watched.messages], allow_nan=False)


def test_the_error_is_the_distance_to_the_desired_position(watched, folder) -> None:
    tracked = [f for f in watched.frames if f["phase"] == "track"]
    assert len(tracked) > 300
    for frame in tracked:
        assert frame["error_mm"] == pytest.approx(
            1e3 * math.dist(frame["position"], frame["desired"])
        )
    result = json.loads((folder / "result.json").read_text())
    mean_mm = np.mean([frame["error_mm"] for frame in tracked])
    assert mean_mm == pytest.approx(1e3 * result["reported_mean_tracking_error_m"], rel=0.15)


def test_the_desired_path_is_where_the_desired_positions_were(watched) -> None:
    path = np.array(watched.flight["scene"]["desired_enu_m"])
    for frame in watched.frames:
        if frame["phase"] == "track":
            assert np.min(np.linalg.norm(path - frame["desired"], axis=1)) < 0.05


def test_the_preview_begins_at_the_desired_position_and_looks_ahead(watched) -> None:
    frames = [f for f in watched.frames if f["phase"] == "track" and f["preview"]]
    assert frames
    for frame in frames:
        assert math.dist(frame["preview"][0], frame["desired"]) < 1e-3


def test_the_fan_stands_in_the_scene_and_its_push_is_seen(watched) -> None:
    [fan] = watched.flight["scene"]["fans"]
    assert math.hypot(*fan["direction_enu"]) == pytest.approx(1.0)
    assert max(math.hypot(*f["push"]) for f in watched.frames if f["push"]) > 0.5


def test_the_path_lies_within_the_geofence(watched) -> None:
    fence = watched.flight["scene"]["geofence"]
    for frame in watched.frames:
        if frame["phase"] == "track":
            assert all(
                low <= p <= high
                for low, p, high in zip(
                    fence["low_enu_m"], frame["position"], fence["high_enu_m"], strict=True
                )
            )


def test_the_flight_says_who_flew_what_and_how_it_ended(watched) -> None:
    flight = watched.flight
    assert flight["mode"] == "recorded"
    assert flight["commands"] is False
    assert (flight["controller"], flight["autopilot"], flight["wind"]) == ("mpc-l1", "px4", "fan")
    assert flight["result"]["outcome"] == "landed"
    begin_s, end_s = flight["scored_s"]
    assert end_s - begin_s == pytest.approx(20.0)
    inside = [f["phase"] for f in watched.frames if begin_s + 0.1 < f["t"] < end_s - 0.1]
    assert set(inside) == {"track"}


def test_mode_arming_and_phases_before_setpoints_flow_are_seen(watched) -> None:
    before = [f for f in watched.frames if f["controller"] == ""]
    assert {"ready", "arm", "take off"} <= {f["phase"] for f in before}
    assert {f["armed"] for f in before} >= {False, True}
    assert any(f["position"] is not None for f in before)


def test_a_log_that_was_cut_off_is_shown_to_where_it_ends(folder, tmp_path, watched) -> None:
    cut = tmp_path / "cut"
    shutil.copytree(folder, cut)
    for name in ("flight.mcap", "flight.tlog"):
        data = (cut / name).read_bytes()
        (cut / name).write_bytes(data[: len(data) * 6 // 10])
    (cut / "result.json").unlink()
    part = watch_recorded(cut)
    assert 100 < len(part.frames) < len(watched.frames)
    assert part.flight["result"] is None


def test_without_packets_the_records_are_shown(folder, tmp_path) -> None:
    bare = tmp_path / "bare"
    shutil.copytree(folder, bare)
    (bare / "flight.tlog").unlink()
    frames = watch_recorded(bare).frames
    assert any(frame["error_mm"] is not None for frame in frames)
    assert all(frame["truth"] is None for frame in frames)


def test_a_folder_without_a_log_is_refused_with_what_to_do(tmp_path) -> None:
    with pytest.raises(RecordedFlightError, match="companion fly"):
        watch_recorded(tmp_path)
    done = CliRunner().invoke(app, ["live", str(tmp_path)])
    assert done.exit_code == 2
    assert "companion fly" in done.output


def test_a_log_of_another_version_is_shown_without_its_scene(folder) -> None:
    records = list(read_records(folder / "flight.mcap"))
    strange = dict(records[0].values, mission={"of": "another version"})
    watched = Watched(strange, "recorded")
    for record in records[1:400]:
        watched.take(("record", record.time_s, record.topic, record.values))
    assert watched.look(records[400].time_s)["position"] is not None
    assert watched.flight["scene"]["desired_enu_m"] is None


def test_a_long_flight_is_thinned() -> None:
    watched = Watched(None, "live")
    watched.take(("record", 0.0, "event", {"severity": "info", "text": "x"}))
    for k in range(MOST_FRAMES + 100):
        watched.look(0.05 * k)
    assert len(watched.frames) <= MOST_FRAMES
    assert watched.frames[-1]["t"] == pytest.approx(0.05 * (MOST_FRAMES + 99))
    assert watched.frames[0]["t"] == 0.0


def test_late_setpoints_are_counted_and_the_largest_of_an_interval_is_shown() -> None:
    watched = Watched(None, "live")
    for k, latency_s in enumerate((0.001, 0.007, 0.002)):
        watched.take(
            (
                "record",
                0.01 * k,
                "control",
                {
                    "latency_s": latency_s,
                    "computed_us": 100.0 * k,
                    "received_s": 0.01 * k,
                    "sent": True,
                },
            )
        )
    frame = watched.look(0.03)
    assert frame["latency_ms"] == pytest.approx(7.0)
    assert frame["computed_us"] == 200.0
    assert frame["state_age_ms"] == pytest.approx(10.0)
    assert frame["missed_deadlines"] == 1
    assert watched.look(0.05)["latency_ms"] is None


def test_a_pause_between_setpoints_is_a_missed_deadline_as_the_flight_counts_them() -> None:
    watched = Watched(None, "live")
    for received_s in (0.0, 0.01, 1.0, 1.01):
        tick = {"latency_s": 0.001, "received_s": received_s, "sent": True}
        watched.take(("record", received_s, "control", tick))
    assert watched.look(1.02)["missed_deadlines"] == 1
    watched.take(("record", 3.0, "input", {"kind": "start", "values": {}}))
    tick = {"latency_s": 0.001, "received_s": 3.0, "sent": True}
    watched.take(("record", 3.0, "control", tick))
    assert watched.look(3.02)["missed_deadlines"] == 1


def test_the_page_counts_as_many_missed_deadlines_as_the_flight(watched, folder) -> None:
    result = json.loads((folder / "result.json").read_text())
    assert watched.frames[-1]["missed_deadlines"] == result["missed_deadlines"]
