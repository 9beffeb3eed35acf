"""The process that flies, as the one that watches it sees it."""

import contextlib
import json
import signal

import pytest

from tools.soak import runs
from tools.soak.child import MANY
from tools.soak.plans import ROUND, FlightPlan


def test_a_process_that_fails_is_told_with_what_it_said(tmp_path):
    with pytest.raises(runs.ChildError, match="no-such-wind"):
        list(runs._said(MANY, tmp_path, [FlightPlan("px4", 4, wind="no-such-wind")]))


def test_the_process_ends_when_nobody_watches_any_more(tmp_path, monkeypatch):
    started = []

    class Talkative(runs.subprocess.Popen):
        def __init__(self, command, **options):
            super().__init__(["sh", "-c", "echo 1; exec sleep 1000"], **options)
            started.append(self)

    monkeypatch.setattr(runs.subprocess, "Popen", Talkative)
    with contextlib.closing(runs._said(MANY, tmp_path, [])) as said:
        assert next(said) == 1
        assert started[0].poll() is None
    assert started[0].poll() == -signal.SIGKILL


def test_flights_are_flown_in_whole_rounds_until_the_hours_are_over(tmp_path, monkeypatch):
    closed = []

    def said(mode, folder, plans):
        folder.mkdir()
        try:
            for number, _ in enumerate(plans):
                (folder / f"flight-{number:04d}").mkdir()
                yield {
                    "what": "flown",
                    "number": number,
                    "time_s": 60.0 * (number + 1),
                    "memory_mib": 140.0,
                    "outcome": "landed",
                    "completed": True,
                    "note": "",
                    "flight_s": 60.0,
                    "ticks": 4000,
                    "missed_deadlines": 0,
                    "latency_ms": None,
                    "timer_noise_ms": None,
                }
        finally:
            closed.append(True)

    monkeypatch.setattr(runs, "_said", said)
    monkeypatch.setattr(runs, "p99_ms", lambda *_: 0.7)
    told = []
    run = runs.many_flights(tmp_path / "flights", 0.25, None, None, told.append)
    assert len(run.flights) == len(told) == 2 * ROUND  # 15 minutes are one and a half
    assert closed
    assert [latency["p99_ms"] for latency in run.latencies] == [0.7] * 20
    assert json.dumps(run.flights)
    assert not (tmp_path / "flights").exists()  # the logs have been read
