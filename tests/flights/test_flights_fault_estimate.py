"""What the estimator does to a flight: steps, losses, states that stand still, clocks that jump."""

import math

import pytest

from companion.flight.inbox import PilotCommand
from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures

pytestmark = pytest.mark.faults

WAIT = {"timeouts.handed_over_s": "3.0"}
FAULT_S = 4.0


def step(by_m, at_s=FAULT_S, **keys):
    """The estimate steps by so much, east."""
    fault = {"fault": "estimator_reset", "at_s": at_s, "since": "setpoints"}
    return fault | {"position_enu_m": [by_m, 0.0, 0.0]} | keys


def at(fault, at_s=FAULT_S, **keys):
    return {"fault": fault, "at_s": at_s, "since": "setpoints"} | keys


def tilts(flown, begin_s, end_s):
    return [s.tilt_deg for s in flown.wire.setpoints if begin_s <= s.time_s < end_s]


def test_steps_of_30_cm_announced_or_not_and_of_the_heading_are_followed_without_a_bump(bench):
    """The second takes the first one back; so does the third, 10 degrees of heading."""
    faults = {
        "vehicle": [
            step(0.3),
            step(-0.3, FAULT_S + 2.0, announced=False),
            at("estimator_reset", FAULT_S + 3.0, yaw_deg=10.0),
        ]
    }
    flown = bench.fly(faults=faults)
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.outcome.fallbacks == 0
    (first,) = flown.told("the estimate jumped (announced): position by 0.30 m")
    (second,) = flown.told("the estimate jumped (unannounced): position by 0.30 m")
    (third,) = flown.told("the estimate jumped (announced): heading by 10 degrees")
    assert (second - first, third - first) == pytest.approx((2.0, 3.0), abs=0.05)
    for said in (first, second):
        before, after = tilts(flown, said - 0.05, said), tilts(flown, said, said + 0.05)
        assert max(after) < max(before) + 1.5
        assert max(tilts(flown, said, said + 1.5)) < 12.0


@pytest.mark.parametrize(("autopilot", "announced"), [("px4", True), ("ardupilot", False)])
def test_a_step_of_3_m_is_not_followed(bench, autopilot, announced):
    bench.flies = autopilot
    faults = {"vehicle": [step(3.0, announced=announced)]}
    flown = bench.fly(faults=faults, settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    (level,) = flown.told("level and holding altitude: the estimate of the position jumped by 3.0")
    (over,) = flown.told("handing over: the estimate of the position jumped by 3.0 m, for 0.8 s")
    assert over - level == pytest.approx(0.8, abs=0.03)
    assert max(tilts(flown, level, math.inf)) < 0.01
    assert flown.wire.modes[-1][1] in ("posctl", "brake")


def test_a_heading_that_steps_by_20_degrees_is_not_flown_on(bench):
    """With that much mpc-l1 would swing to the flight's end."""
    faults = {"vehicle": [at("estimator_reset", yaw_deg=20.0)]}
    flown = bench.fly(faults=faults, settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    (level,) = flown.told("level and holding altitude: the estimate of the heading jumped by 20")
    (over,) = flown.told("handing over: the estimate of the heading jumped by 20 degrees, for 0.8")
    assert over - level == pytest.approx(0.8, abs=0.03)
    assert max(tilts(flown, level, math.inf)) < 0.01


def test_an_estimate_that_steps_at_each_moment_is_told_without_a_flood_and_handed_over(bench):
    """The heading there and back, 25 times within half a second."""
    faults = {
        "vehicle": [
            at("estimator_reset", FAULT_S + 0.02 * k, yaw_deg=10.0 * (-1) ** k) for k in range(25)
        ]
    }
    flown = bench.fly(faults=faults, settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    assert len(flown.told("the estimate jumped (announced): heading by 10 degrees")) == 1
    assert len(flown.told("handing over: the estimate of the heading jumped 21 times")) == 1


def test_a_position_that_is_lost_and_a_state_that_stands_still_for_a_moment_are_flown_level(bench):
    """PX4's ODOMETRY goes on, by dead reckoning: its ESTIMATOR_STATUS tells."""
    faults = {
        "vehicle": [
            at("position_loss", lasts_s=0.5),
            at("frozen_telemetry", FAULT_S + 2.5, lasts_s=0.4),
        ]
    }
    flown = bench.fly(faults=faults)
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    lost, frozen = flown.told("level and holding altitude: no usable state")
    reasons = [text for _, _, text in flown.seen.messages if text.startswith("level and")]
    assert "says that it has lost its position" in reasons[0]
    assert "frozen while their stamps go on" in reasons[1]
    assert frozen - lost == pytest.approx(2.5, abs=0.2)
    assert len(flown.told("tracking")) == 2
    error = tracking_figures(read_flight(flown.folder), flown.outcome.scored_s).against_truth
    assert error.mean_m < 0.3


def test_a_state_that_stands_still_for_good_is_handed_over_and_not_resumed_on(bench):
    bench.flies = "ardupilot"
    bench.after("handed over", 1.0, lambda: bench.inbox.put(PilotCommand.RESUME))
    flown = bench.fly(faults={"vehicle": [at("frozen_telemetry", lasts_s=100.0)]}, settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    (over,) = flown.told(
        "handing over: no usable state for more than 100 ms (position and velocity"
    )
    assert len(flown.told("handed over: not resumed: no usable state of the vehicle arrives")) == 1
    assert flown.wire.setpoints_after(over + 1.05) == []
    assert flown.wire.modes[-1][1] == "brake"


def test_a_clock_that_jumps_ahead_is_handed_over_and_a_person_can_resume(bench):
    bench.after("handed over", 4.0, lambda: bench.inbox.put(PilotCommand.RESUME))
    bench.flies = "ardupilot"
    flown = bench.fly(faults={"vehicle": [at("clock_jump", by_s=5.0)]}, check=False)
    (level,) = flown.told("level and holding altitude: no usable state for more than 100 ms (the")
    assert "clock has jumped ahead by 5.0 s" in next(
        text for time_s, _, text in flown.seen.messages if time_s == level
    )
    assert len(flown.told("handing over")) == 1
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed


def test_a_clock_that_is_set_back_is_handed_over_at_once_and_is_no_restart(bench):
    flown = bench.fly(faults={"vehicle": [at("clock_jump", by_s=-2.0)]}, settings=WAIT, check=False)
    (over,) = flown.told("handed over: the autopilot's clock was set back")
    assert over - flown.began("approach") < FAULT_S + 0.4
    assert flown.wire.setpoints_after(over) == []
    assert "restarted" not in flown.outcome.note
    assert flown.wire.modes[-1][1] == "posctl"
