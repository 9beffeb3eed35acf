"""From what a run showed to its verdicts, soak.json and soak.png."""

import json

import numpy as np
import pytest

from tools.soak import figure, report
from tools.soak.child import LONG, MANY, REAL_TIME
from tools.soak.runs import Run
from tools.soak.verdicts import fitted, unplanned_endings

FLIGHT = {
    "outcome": "landed",
    "completed": True,
    "note": "",
    "flight_s": 700.0,
    "missed_deadlines": 0,
}


def a_run(name=REAL_TIME, count=600, *, memory_per_h=0.0, noise_mib=0.0, handles=None, flights=1):
    rng = np.random.default_rng(3)
    samples = [
        {
            "time_s": 1000.0 + k,
            "memory_mib": 80.0 + memory_per_h * k / 3600.0 + noise_mib * rng.standard_normal(),
            "handles": 12 if handles is None else handles(k),
            "tasks": 6,
        }
        for k in range(count)
    ]
    latencies = [{"time_s": sample["time_s"], "p99_ms": 1.2} for sample in samples[5::10]]
    return Run(name, samples, latencies, [FLIGHT] * flights)


def words(run):
    return {fit.gauge.key: fit.word for fit in fitted(run)}


def test_a_run_in_which_nothing_grows_passes():
    run = a_run(noise_mib=0.01)
    assert set(words(run).values()) == {"passed"}
    assert report.passed([(run, fitted(run))])


def test_memory_that_grows_faster_than_its_limit_is_told():
    assert words(a_run(memory_per_h=1.2, noise_mib=0.001))["memory_mib"] == "grows"
    assert words(a_run(memory_per_h=0.8, noise_mib=0.001))["memory_mib"] == "passed"


def test_what_is_too_noisy_to_tell_is_not_shown_and_does_not_pass():
    run = a_run(noise_mib=5.0)
    fits = fitted(run)
    assert words(run)["memory_mib"] == "not shown"
    assert not report.passed([(run, fits)])
    told = report.lines([(run, fits)])
    assert "times as long may tell" in told[0]
    assert not any("times as long" in line for line in told[1:])


def test_one_handle_that_stays_open_is_growth():
    assert words(a_run(handles=lambda k: 12 + (k > 400)))["handles"] != "passed"


def test_what_grows_while_warming_up_only_is_no_growth():
    assert words(a_run(handles=lambda k: 12 + (k > 60)))["handles"] == "passed"


def test_a_run_that_is_too_short_gets_no_verdict():
    with pytest.raises(ValueError, match="real time: too short"):
        fitted(a_run(count=40))


def test_of_many_flights_a_round_is_a_block():
    run = a_run(MANY, 80)
    run.latencies = [
        {"time_s": s["time_s"], "p99_ms": 1 + k % 10} for k, s in enumerate(run.samples)
    ]
    assert [fit.trend.blocks for fit in fitted(run)] == [6] * 4
    assert words(run)["p99_ms"] == "passed"


def test_a_flight_that_does_not_land_fails_the_run():
    run = a_run(LONG)
    run.flights = [FLIGHT, FLIGHT | {"outcome": "aborted", "note": "the link was lost"}]
    assert unplanned_endings(run) == ["long flight, flight 2: aborted the link was lost"]
    found = [(run, fitted(run))]
    assert not report.passed(found)
    assert "the link was lost" in report.lines(found)[-1]


def test_report_and_figure_are_written(tmp_path):
    run = a_run(noise_mib=0.01)
    found = [(run, fitted(run))]
    report.write(tmp_path / "soak.json", found)
    figure.draw(tmp_path / "soak.png", found)
    told = json.loads((tmp_path / "soak.json").read_text())
    assert told["passed"] is True
    assert [gauge["verdict"] for gauge in told["runs"][0]["gauges"]] == ["passed"] * 4
    assert len(told["runs"][0]["samples"]) == 600
    assert (tmp_path / "soak.png").stat().st_size > 10_000
