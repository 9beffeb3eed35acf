"""Links that lose, delay and spoil: what is flown through, and what ends a flight well."""

import math

import pytest

from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures
from tests.flights.bench import assert_setpoints_are_sound

WAIT = {"timeouts.handed_over_s": "3.0"}
TILT_LIMIT_DEG = 35.0
ARM = 400
FAULT_S = 5.0
"""After the first setpoints that the vehicle follows."""


def setpoints_lost(until_s=None):
    """Nothing that is sent to the vehicle arrives, from the fault's time on."""
    fault = {"way": "setpoints", "since": "setpoints", "from_s": FAULT_S, "pause": True}
    return {"link": [fault if until_s is None else fault | {"until_s": until_s}]}


@pytest.mark.faults
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_link_that_loses_a_third_both_ways_is_flown_through(bench, autopilot):
    """The error is what the shipped gains reach with 70 ms of delay and half of the setpoints."""
    bench.flies = autopilot
    flown = bench.fly(options={"trajectory": 2}, faults="bad-link", check=False)
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    assert flown.outcome.fallbacks == 0
    error = tracking_figures(read_flight(flown.folder), flown.outcome.scored_s).against_truth
    assert error.mean_m < 0.35
    for s in flown.wire.setpoints:
        assert all(math.isfinite(c) for c in (*s.quaternion, s.thrust))
        assert s.tilt_deg <= TILT_LIMIT_DEG + 0.1
    # Asked for as often as needed, and never again once it had been answered.
    arming = [t for t, command, parameters in flown.wire.commands if command == ARM]
    assert arming
    assert max(arming) <= flown.began("take off")


@pytest.mark.faults
@pytest.mark.parametrize(("autopilot", "ends_in"), [("px4", "posctl"), ("ardupilot", "brake")])
def test_a_link_that_is_too_slow_ends_tracking_and_the_vehicle_is_handed_over(
    bench, autopilot, ends_in
):
    bench.flies = autopilot
    flown = bench.fly(faults="slow-link", settings=WAIT, check=False)
    assert flown.outcome.outcome == "aborted"
    first = next(t for t, name in flown.wire.modes if name in ("offboard", "guided"))
    (level,) = flown.told("level and holding altitude")
    (over,) = flown.told("handing over")
    # The mode is reported once a second: setpoints were followed for up to so long before.
    assert level - flown.began("approach") < FAULT_S + 1.0
    assert level > first
    assert over - level == pytest.approx(0.8, abs=0.05)
    assert all(s.tilt_deg <= TILT_LIMIT_DEG + 0.1 for s in flown.wire.setpoints)
    assert max(s.tilt_deg for s in flown.wire.setpoints if s.time_s > level) < 0.01
    assert flown.wire.modes[-1][1] == ends_in


def test_a_way_to_the_vehicle_that_slows_down_is_noticed_though_the_state_is_fresh(bench):
    fault = {"way": "setpoints", "since": "setpoints", "from_s": FAULT_S, "delay_s": 0.15}
    flown = bench.fly(faults={"link": [fault]}, settings=WAIT, check=False)
    (level,) = flown.told("level and holding altitude: a setpoint acts more than 100 ms after")
    (over,) = flown.told("handing over: a setpoint acts more than 100 ms after")
    assert level - flown.began("approach") < FAULT_S + 1.6
    assert over - level == pytest.approx(0.8, abs=0.05)
    assert flown.wire.modes[-1][1] == "posctl"


@pytest.mark.parametrize(
    ("until_s", "brakes"), [(FAULT_S + 3.0, True), (None, False)], ids=["for 3 s", "for good"]
)
def test_an_ardupilot_that_answers_nothing_is_handed_over_as_soon_as_it_hears(
    bench, until_s, brakes
):
    """It flies its last target on and says nothing: its answers to TIMESYNC are missed."""
    bench.flies = "ardupilot"
    flown = bench.fly(faults=setpoints_lost(until_s), settings=WAIT, check=False)
    assert flown.outcome.outcome == "aborted"
    (said,) = flown.told("handed over: for 1.0 s the autopilot has answered nothing (TIMESYNC)")
    assert FAULT_S + 1.0 < said - flown.began("approach") < FAULT_S + 1.6
    assert flown.wire.modes[-1][1] == ("brake" if brakes else "guided")
    held_until = said + 1.05
    assert flown.wire.setpoints_after(held_until) == []
    assert len(flown.told("mode brake was commanded and not confirmed")) == (not brakes)


def test_a_third_of_a_second_without_setpoints_is_flown_through(bench):
    flown = bench.fly(faults=setpoints_lost(FAULT_S + 0.3))
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.outcome.fallbacks == 0
    assert_setpoints_are_sound(flown.wire, TILT_LIMIT_DEG)
