"""One call flies in lockstep: what comes back, what is refused, and that it is repeatable."""

import asyncio
import html
import json
import math

import numpy as np
import pytest

from companion.api import InputError, fly, make_trajectory, read_flight, score

SHORT = make_trajectory(
    lambda s: (0.3 * math.sin(s), 0.3 * math.cos(s), 1.2), 4.0, name="short circle"
)


@pytest.fixture(scope="module")
def flight():
    return fly(SHORT, wind="gusts", seed=2)


def test_what_comes_back_says_how_it_went(flight):
    assert (flight.outcome, flight.completed, flight.note) == ("tracked", True, "")
    assert (flight.trajectory, flight.controller) == ("short circle", "mpc-l1")
    assert (flight.vehicle, flight.wind, flight.seed) == ("bebop2", "gusts", 2)
    assert flight.folder is None
    assert 0.001 < flight.mean_error_m < 0.04
    assert flight.figures.mean_error_m <= flight.figures.rms_error_m <= flight.figures.max_error_m


def test_the_arrays_have_a_row_for_each_sample(flight):
    n = len(flight.ticks.time_s)
    assert flight.ticks.position_enu_m.shape == (n, 3)
    tracked = (flight.ticks.track_s >= 0.0) & (flight.ticks.track_s <= 4.0)
    assert 350 < tracked.sum() < 450
    error = flight.ticks.position_enu_m[tracked] - flight.ticks.desired_enu_m[tracked]
    mean_m = np.linalg.norm(error, axis=1).mean()
    assert mean_m == pytest.approx(flight.figures.reported_mean_error_m, rel=0.01)
    assert set(flight.ticks.controller[tracked]) == {"mpc-l1"}


def test_the_error_over_time_is_what_the_figures_are_of(flight):
    times_s, error_m = flight.error()
    assert times_s[0] >= 0.0
    assert times_s[-1] <= 4.0
    assert error_m.mean() == pytest.approx(flight.mean_error_m, abs=1e-12)


def test_a_part_is_scored_like_the_whole(flight):
    assert score(flight) == flight.figures
    times_s, error_m = flight.error()
    later = error_m[times_s >= 2.0]
    assert score(flight, (2.0, 4.0)).mean_error_m == pytest.approx(later.mean(), rel=0.01)
    with pytest.raises(InputError, match="empty"):
        score(flight, (2.0, 1.0))


def test_the_same_call_gives_the_same_flight_also_within_a_running_loop(flight):
    async def in_a_notebook():
        return fly(SHORT, wind="gusts", seed=np.int64(2))

    again = asyncio.run(in_a_notebook())

    assert np.array_equal(again.ticks.thrust, flight.ticks.thrust, equal_nan=True)
    assert np.array_equal(again.truth.position_enu_m, flight.truth.position_enu_m)


def test_a_folder_is_read_back_as_it_was_flown(flight, tmp_path):
    written = fly(SHORT, wind="gusts", seed=2, folder=tmp_path / "flight")

    read = read_flight(tmp_path / "flight")

    assert {"flight.mcap", "flight.tlog", "result.json", "report.html"} <= {
        path.name for path in written.folder.iterdir()
    }
    page = (written.folder / "report.html").read_text(encoding="utf-8")
    assert "companion.api.fly(trajectory=short circle, wind=" in html.unescape(page)
    assert written.warnings == ()
    assert read.figures == written.figures == flight.figures
    assert read.scored_s == written.scored_s
    assert (read.outcome, read.trajectory, read.wind) == ("tracked", "short circle", "gusts")
    assert np.array_equal(read.ticks.track_s, written.ticks.track_s)
    with pytest.raises(InputError, match="log already"):
        fly(SHORT, folder=tmp_path / "flight")


@pytest.mark.parametrize(("share", "completed"), [(1.0, True), (0.7, False)])
def test_a_flight_without_its_result_is_unfinished(tmp_path, share, completed):
    fly(SHORT, folder=tmp_path)
    (tmp_path / "result.json").unlink()
    log = tmp_path / "flight.mcap"
    log.write_bytes(log.read_bytes()[: int(share * log.stat().st_size)])

    read = read_flight(tmp_path)

    assert (read.outcome, read.completed) == ("unfinished", completed)
    assert math.isinf(read.mean_error_m) != completed
    assert score(read).mean_error_m < 0.04
    assert "the log ends in the phase" in read.note


def test_an_empty_log_is_no_flight(tmp_path):
    for name in ("flight.mcap", "flight.tlog"):
        (tmp_path / name).touch()
    with pytest.raises(InputError, match="ends before a flight began"):
        read_flight(tmp_path)


def test_what_was_asked_for_on_the_command_line_can_be_asked_for_here():
    horizon = np.int64(20)
    flight = fly(
        SHORT, settings={"controller.mpc.horizon": horizon, "supervisor.jump_limit_m": 0.5}
    )
    assert flight.completed


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"controller": "mpc"}, "unknown controller 'mpc'"),
        ({"trajectory": 7}, "numbered 1 to 5"),
        ({"trajectory": object()}, "no trajectory: it has no 'name'"),
        ({"trajectory": SHORT, "wind": "fan"}, "--wind fan"),
        ({"wind": 3.0}, "is no wind"),
        ({"fallback": "mpc-l1"}, "belongs to a controller of one's own"),
        ({"settings": {"controller.mpc.horizn": 20}}, "horizn"),
        ({"plant": "nowhere.yaml"}, "plant: nowhere.yaml: no such YAML file"),
        ({"settings": ["controller.mpc.horizon"]}, "Give {key: value}"),
        ({"settings": {"hover_s": object()}}, "nothing that YAML has"),
        ({"seed": 1.5}, "seed 1.5 is no whole number"),
        ({"settings": {"connect": "udpin://127.0.0.1:14540"}}, "a real vehicle is flown by"),
    ],
)
def test_what_cannot_be_flown_is_refused_with_the_remedy(arguments, says):
    with pytest.raises(InputError, match=says):
        fly(**arguments)


def test_a_trajectory_that_the_vehicle_cannot_fly_is_refused():
    with pytest.raises(InputError, match="needs a speed of"):
        fly(make_trajectory(lambda s: (2.0 * math.sin(2.5 * s), 0.0, 1.2), 8.0))


def test_the_folder_of_something_else_is_no_flight(tmp_path):
    with pytest.raises(InputError, match="no flight can be read"):
        read_flight(tmp_path)
    (tmp_path / "flight.mcap").write_bytes(b"not a log, but long enough")
    (tmp_path / "flight.tlog").write_bytes(b"")
    (tmp_path / "result.json").write_text(json.dumps([]))
    with pytest.raises(InputError, match="no flight can be read"):
        read_flight(tmp_path)
