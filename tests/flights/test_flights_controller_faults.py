"""What the companion does when its own controller fails: the ladder, rung by rung."""

import asyncio

import pytest

from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.qp.port import QpSolution

CONSTRAINED = {"controller.mpc.r_max_m_s2": "100"}
"""So that nearly every plan needs the solver."""
TIGHT = {"controller.mpc.r_max_m_s2": "20"}
"""So that every plan does; at this the solver now and then fails by itself."""


class Faulty:
    """A solver factory whose solvers fail as a schedule says, from the track's beginning on."""

    def __init__(self, bench, fault):
        """`fault` takes seconds since the beginning of the track: "", "fail" or "raise"."""
        self.fault = fault
        self.begun_s = None
        bench.after("track", 0.0, self.begin)

    def begin(self):
        self.begun_s = asyncio.get_running_loop().time()

    def __call__(self, p, a):
        solver = OsqpSolver(p, a)
        faulty = self

        class Solver:
            def solve(self, q, lower, upper):
                fault = ""
                if faulty.begun_s is not None:
                    fault = faulty.fault(asyncio.get_running_loop().time() - faulty.begun_s)
                if fault == "raise":
                    raise ZeroDivisionError("made up")
                if fault == "fail":
                    return QpSolution(None, "made up", 7)
                return solver.solve(q, lower, upper)

        return Solver()


def between(begin_s, end_s, fault):
    return lambda t: fault if begin_s <= t < end_s else ""


def fly(bench, fault, settings=CONSTRAINED):
    return bench.fly(settings=settings, make_solver=Faulty(bench, fault))


def test_a_solver_that_fails_for_a_while_is_bridged_by_the_shifted_plan(bench):
    flown = fly(bench, between(1.0, 1.2, "fail"))
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.told("fallback: shifted plan")
    assert not flown.told("level")
    statuses = [r.values["status"] for r in flown.records("plan")]
    assert 5 <= statuses.count("shifted_plan") <= 8
    assert "clipped_closed_form" not in statuses
    assert flown.outcome.fallbacks >= 15


def test_a_solver_that_fails_longer_is_bridged_by_the_clipped_closed_form(bench):
    flown = fly(bench, between(1.0, 1.7, "fail"))
    assert flown.outcome.outcome == "landed"
    (shifted,) = flown.told("fallback: shifted plan")
    clipped = flown.told("fallback: clipped closed form")
    statuses = [r.values["status"] for r in flown.records("plan")]
    assert statuses.count("shifted_plan") == 10
    assert statuses.count("clipped_closed_form") >= 10
    assert all(t > shifted for t in clipped)


def test_a_solver_that_fails_for_ever_hands_over_after_a_second(bench):
    flown = fly(bench, between(1.0, 1e9, "fail"), TIGHT)
    assert flown.outcome.outcome == "aborted"
    (over,) = flown.told("handing over: no plan could be solved for 1 s")
    assert over - flown.began("track") == pytest.approx(2.0, abs=0.1)
    assert flown.wire.setpoints_after(over) == []


def test_a_controller_that_raises_for_a_moment_holds_level_and_tracks_again(bench):
    flown = fly(bench, between(1.0, 1.3, "raise"))
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    (level,) = flown.told("level and holding altitude: the controller failed (ZeroDivisionError")
    (back,) = flown.told("tracking")
    assert level < back
    held = [s for s in flown.wire.setpoints if level + 0.02 < s.time_s < level + 0.25]
    assert held
    assert all(s.tilt_deg < 0.01 for s in held)


def test_a_controller_that_raises_for_ever_hands_over(bench):
    flown = fly(bench, between(1.0, 1e9, "raise"))
    assert flown.outcome.outcome == "aborted"
    (over,) = flown.told("handing over: the controller failed (ZeroDivisionError: made up)")
    assert over - flown.began("track") == pytest.approx(1.8, abs=0.1)
    assert flown.wire.setpoints_after(over) == []
    assert flown.wire.armed[-1][1] is False


def test_holding_level_ends_a_climb(bench):
    """Level and *hold altitude*: a climb rate at the fault dies away."""
    path = "t,x,y,z\n0,0,0,2.4\n1,0,0,2.6\n2,0,0,3.0\n3,0,0,3.4\n4,0,0,3.6\n"
    (bench.folder / "short.csv").write_text(path)
    flown = fly(bench, between(2.0, 1e9, "raise"))
    (over,) = flown.told("handing over")
    climb = {r.time_s: r.values["velocity_enu_m_s"][2] for r in flown.records("control")}
    before = [v for t, v in climb.items() if over - 0.9 < t < over - 0.8]
    after = [v for t, v in climb.items() if over - 0.1 < t < over]
    assert max(before) > 0.3
    assert max(abs(v) for v in after) < 0.15


@pytest.mark.parametrize("fault", ["fail", "raise"])
def test_a_fault_that_comes_and_goes_does_not_flood_the_pilot(bench, fault):
    flown = fly(bench, lambda t: fault if t > 0.5 and t % 0.06 < 0.03 else "")
    messages = [text for _, severity, text in flown.seen.messages if "companion" not in text]
    assert len(messages) <= 8, messages
    if fault == "raise":  # most of the time it holds level: that may not go on for ever
        assert flown.outcome.outcome == "aborted"
        assert flown.told("handing over: the controller failed")
    else:  # shifted plans track well enough
        assert flown.outcome.outcome == "landed"


def test_a_record_that_cannot_be_kept_does_not_end_the_flight(bench, monkeypatch):
    """Logging is for people; it comes after the vehicle."""
    from companion.recording.flight_log import FlightLog

    keep = FlightLog.record

    def record(self, topic, time_s, values):
        if topic == "plan":
            raise TypeError("made up")
        keep(self, topic, time_s, values)

    monkeypatch.setattr(FlightLog, "record", record)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.told("a record of 'plan' was lost (TypeError: made up)")


def test_a_display_that_fails_does_not_end_the_flight(bench, monkeypatch):
    from tests.flights.bench import Seen

    def tick(self, view):
        raise RuntimeError("made up")

    monkeypatch.setattr(Seen, "tick", tick)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    events = [r.values["text"] for r in flown.records("event")]
    assert any("the display failed (RuntimeError: made up)" in text for text in events)


def test_an_error_in_the_flight_itself_stops_the_stream_and_is_said(bench, monkeypatch):
    from companion.flight.setpoints.timeline import Timeline

    def finished(self, autopilot_time_s):
        if autopilot_time_s > self.start_s + 4.0:
            raise RuntimeError("made up")
        return False

    monkeypatch.setattr(Timeline, "finished", finished)
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    (said,) = flown.told("The companion failed (RuntimeError: made up)")
    assert flown.wire.setpoints_after(said) == []
    assert any("Traceback" in r.values["text"] for r in flown.records("event"))


def test_an_error_in_the_stream_hands_over(bench, monkeypatch):
    """asyncio swallows what a datagram's handler raises: the stream must notice by itself."""
    from companion.flight.setpoints.control_loop import ControlLoop

    on_sample = ControlLoop.on_sample

    def failing(self, state, loop_delay_s):
        if self.timeline is not None and state.time_s > self.timeline.start_s + 4.0:
            raise RuntimeError("made up")
        return on_sample(self, state, loop_delay_s)

    monkeypatch.setattr(ControlLoop, "on_sample", failing)
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    (over,) = flown.told("handing over: the companion failed (RuntimeError: made up)")
    assert flown.wire.setpoints_after(over) == []
    assert flown.wire.armed[-1][1] is False


@pytest.mark.parametrize("helper", ["housekeeping", "watch"])
def test_a_helper_that_dies_ends_the_flight(bench, monkeypatch, helper):
    from companion.flight.setpoints.setpoint_stream import SetpointStream
    from companion.flight.vehicle.connection import Connection

    owner = {"housekeeping": Connection, "watch": SetpointStream}[helper]
    original = getattr(owner, helper)

    async def dying(self, *arguments):
        task = asyncio.ensure_future(original(self, *arguments))
        try:
            await asyncio.sleep(22.0)
            raise RuntimeError("made up")
        finally:
            task.cancel()

    monkeypatch.setattr(owner, helper, dying)
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    (said,) = flown.told("The companion failed (RuntimeError: made up): handing over")
    assert said == pytest.approx(22.0, abs=0.01)
    assert flown.wire.setpoints[-1].time_s <= said
