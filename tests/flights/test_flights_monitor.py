"""The in-flight monitor and hand-overs, in lockstep flights of the simulated bebop2."""

import math
from dataclasses import replace

import numpy as np
import pytest

from companion.config.resolve import load_flight
from companion.experiments.attitude_lag import attitude_lag
from companion.experiments.flight_task import LoadedTask
from companion.experiments.fly_task import fly_loaded
from companion.experiments.memory_log import MemoryLog
from companion.experiments.perturbed_plant import write_plant
from companion.flight.assemble import make_trajectory
from companion.flight.embedded_shim import embedded_shim
from tests.flights.bench import Bench

FRAGILE = {
    "controller.l1.m": "[0.9, 0.9, 3.75]",
    "controller.l1.omega": "[0.4, 0.4, 4.0]",
    "controller.l1.k": "[0.45, 0.45, 0.55]",
    "controller.fallback": "l1",
}
"""The best gains on the nominal vehicle, without room for more lag; below it no MPC at all."""


def fly(trajectory, *, wind="calm", switch=(), settings=None, plant=None, controller="mpc-l1"):
    """Outcome, times since the trajectory's start, and arrays of a flight from the air."""
    options = {"trajectory": trajectory, "wind": wind, "seed": 1, "controller": controller}
    options |= {"switch": list(switch)} if switch else {}
    config = load_flight(None, options, settings or {})
    shim = embedded_shim(config)
    shim = shim if plant is None else replace(shim, vehicle=str(plant))
    log = MemoryLog()
    outcome = fly_loaded(
        LoadedTask(config, shim), make_trajectory(config.mission), log, airborne=True
    )
    ticks = log.data().ticks
    return outcome, ticks.time_s - outcome.scored_s[0], ticks


@pytest.mark.parametrize(
    ("trajectory", "wind"), [(1, "calm"), (2, "gusts"), (4, "fan"), (5, "gusts")]
)
def test_a_nominal_flight_is_left_alone(trajectory, wind):
    outcome, _, ticks = fly(trajectory, wind=wind)
    assert outcome.outcome == "tracked"
    assert outcome.changes == ()
    assert 0.1 < max(outcome.monitor_worst.values()) < 0.9
    assert set(ticks.watched.controller) == {"", "mpc-l1"}


def test_a_vehicle_that_lags_twice_as_much_is_left_to_the_fallback_without_chatter(tmp_path):
    plant = write_plant("bebop2", (attitude_lag(2.0),), tmp_path / "late.yaml")
    outcome, times, ticks = fly(1, settings=FRAGILE, plant=plant)
    assert outcome.outcome == "tracked"
    handed = [change for change in outcome.changes if change.handed_over]
    assert handed[0].controller == "l1"
    assert "setpoint slew" in handed[0].text
    # One attempt at the way back, which fails: then it stays where it is.
    assert [change.controller for change in handed] == ["l1", "mpc-l1", "l1"]
    assert np.diff([change.time_s for change in handed]).min() > 0.3
    last = handed[-1].track_s
    assert set(ticks.watched.controller[times > last + 0.1]) == {"l1"}
    tilt = np.hypot(ticks.roll_rad, ticks.pitch_rad)
    assert math.degrees(np.abs(tilt[times > last + 4.0]).max()) < 12.0


@pytest.mark.parametrize(
    ("controller", "switch", "flown"),
    [
        ("mpc-l1", ("t=6:l1-off", "t=12:l1-on"), ["mpc-l1, L1 off", "mpc-l1"]),
        ("mpc-l1", ("t=6:mpc-pid-joint",), ["mpc-pid-joint"]),
        ("mpc-l1-plus", ("t=6:mpc-l1", "t=12:mpc-l1-plus"), ["mpc-l1", "mpc-l1-plus"]),
        ("mpc-l1-plus", ("t=6:l1-off", "t=12:l1-on"), ["mpc-l1-plus, L1 off", "mpc-l1-plus"]),
    ],
)
def test_a_hand_over_that_is_asked_for_has_no_bump(controller, switch, flown):
    outcome, times, ticks = fly(4, switch=switch, controller=controller)
    assert outcome.outcome == "tracked"
    assert [(change.cause, change.handed_over) for change in outcome.changes] == [
        ("switch", True)
    ] * len(switch)
    assert [change.controller for change in outcome.changes] == flown
    tilt = np.stack([ticks.roll_rad, ticks.pitch_rad], axis=1)
    steps = np.linalg.norm(np.diff(tilt, axis=0), axis=1)
    thrust_steps = np.abs(np.diff(ticks.thrust))
    usual = (times[1:] > 0.0) & (times[1:] < 5.9)
    for change in outcome.changes:
        at = int(np.argmin(np.abs(times - change.track_s))) - 1
        assert steps[at] <= np.median(steps[usual])
        assert thrust_steps[at] <= np.median(thrust_steps[usual])
        fading = slice(at, at + 15)
        assert steps[fading].max() < 2.0 * steps[usual].max()
        assert thrust_steps[fading].max() < 2.0 * thrust_steps[usual].max()


def test_a_whole_flight_tells_a_hand_over_in_its_log_and_on_the_terminal(tmp_path):
    bench = Bench(tmp_path)
    flown = bench.fly(settings={"switch": "['t=1:pid-l1', 't=2:l1-off']"})
    assert flown.outcome.outcome == "landed"
    handed = [change.controller for change in flown.outcome.changes if change.handed_over]
    assert handed == ["pid-l1", "pid-l1, L1 off"]
    names = [record.values["controller"] for record in flown.records("control")]
    order = list(dict.fromkeys(name for name in names if name))
    assert order == ["mpc-l1", "pid-l1", "pid-l1, L1 off"]
    texts = [r.values["text"] for r in flown.records("event")]
    assert any("mpc-l1 → pid-l1: as asked for" in text for text in texts)
    assert [name for _, name in flown.seen.phases].count("switch") == 2
