"""Who flies: hand-overs as asked for, by the monitor and after a failure, without a bump."""

import math

import numpy as np
import pytest

from companion.config.monitor_models import SwitchConfig
from companion.config.resolve import load_flight
from companion.control import monitor
from companion.control.frameworks import Command, Limits, StackRecord, Tick
from companion.control.interfaces import InnerRecord
from companion.control.monitor import MonitorLimits
from companion.control.thrust_laws import ClimbRateField
from companion.flight.setpoints.stack_runner import StackRunner, UnsoundCommandError
from companion.flight.stacks import NamedStack, Stacks, make_stacks, only
from companion.frames import euler_from_quaternion, quaternion_from_euler
from companion.vehicle_state import VehicleState

STEP_S = 0.01
LIMITS = MonitorLimits(smoothing_s=0.1, alarm_after_s=0.05, ascend_after_s=1.0)


class Fake:
    """A stack that commands a fixed tilt, and whose ỹ and behaviour a test sets."""

    def __init__(self, tilt_rad, thrust=0.5, *, adapts=True):
        self.tilt_rad, self.field, self.adapts = tilt_rad, thrust, adapts
        self.y_tilde = 0.0
        self.raises = None
        self.start_raises = None
        self.starts = []
        self.thrust = ClimbRateField(1.0, 1.0)
        self.limits = Limits(0.6, 1.0, 1.0)
        self.attitude_loop = None

    def about(self, anchor):
        return self

    def without_adaptation(self, mean):
        if not self.adapts:
            return None
        held = Fake(self.tilt_rad + 0.1, self.field)
        held.mean = mean
        return held

    def start(self, state, thrust_memory=None, applied_u=None):
        if self.start_raises is not None:
            raise self.start_raises
        self.starts.append(applied_u)
        return Memory(0)

    def step(self, memory, tick, reference):
        if self.raises is not None:
            raise self.raises
        inner = InnerRecord(
            np.zeros(3),
            np.zeros(3),
            np.array([self.y_tilde, 0.0, 0.0]),
            np.array([1.0, 2.0, 3.0]),
            y_tilde_bound_m_s=np.ones(3),
            sigma_bound=np.full(3, 8.0),
        )
        attitude = quaternion_from_euler(self.tilt_rad, 0.0, 0.0)
        record = StackRecord(np.zeros(3), inner, np.zeros(3), self.tilt_rad, 0.0, 0.5, None)
        return Memory(memory.count + 1), Command(attitude, self.field), record


class Memory:
    def __init__(self, count):
        self.count = count
        self.thrust = None


def reference(times):
    return np.zeros((len(times), 3))


def flown(runner, begin_s, end_s):
    """Commanded rolls, thrusts and watches of the ticks between two times; t = 0 is the start."""
    out = []
    for k in range(round((end_s - begin_s) / STEP_S)):
        time_s = begin_s + k * STEP_S
        level = quaternion_from_euler(0.0, 0.0, 0.0)
        state = VehicleState(100.0 + time_s, (0.0,) * 3, (0.0,) * 3, level, (0.0,) * 3)
        command, record, watch = runner.step(Tick(state, 0.03, 0.0, time_s), reference)
        roll = math.nan
        if command is not None:
            roll = euler_from_quaternion(command.attitude_flu_to_enu)[0]
            assert record.roll_rad == pytest.approx(roll)
        out.append((roll, math.nan if command is None else command.thrust, watch))
    return out


def told(ticks):
    return [change for *_, watch in ticks for change in watch.changes]


def ladder(*stacks):
    levels = ("nominal", "reduced", "robust")
    return tuple(
        NamedStack(name, stack, level) for (name, stack), level in zip(stacks, levels, strict=False)
    )


def runner_of(*stacks, switches=(), others=None, limits=LIMITS, **keywords):
    switches = tuple(SwitchConfig(at_s=at_s, to=to) for at_s, to in switches)
    return StackRunner(Stacks(ladder(*stacks), others or {}, switches, limits, **keywords))


def test_a_hand_over_repeats_the_old_command_and_fades_into_the_new_one():
    old, new = Fake(0.2, 0.4), Fake(-0.1, 0.7)
    runner = runner_of(("old", old), switches=[(1.0, "new")], others={"new": ladder(("new", new))})
    ticks = flown(runner, 0.0, 2.0)
    rolls = np.array([roll for roll, *_ in ticks])
    thrusts = np.array([thrust for _, thrust, _ in ticks])
    assert rolls[100] == pytest.approx(0.2)
    assert rolls[131] == pytest.approx(-0.1)
    assert np.abs(np.diff(rolls[1:])).max() < 0.3 * 1.6 / 30
    assert np.abs(np.diff(thrusts[1:])).max() < 0.3 * 1.6 / 30
    (change,) = told(ticks)
    assert (change.controller, change.cause, change.track_s) == ("new", "switch", 1.0)
    assert [watch.controller for *_, watch in ticks[98:102]] == ["old", "old", "new", "new"]
    # It was told what had been commanded: the sines of the tilt.
    assert new.starts[0][1] == pytest.approx(-math.sin(0.2))


def test_who_cannot_take_over_does_not_and_nothing_is_noticed_of_it():
    old, new = Fake(0.2), Fake(-0.1)
    new.start_raises = ValueError("made up")
    runner = runner_of(("old", old), switches=[(1.0, "new")], others={"new": ladder(("new", new))})
    ticks = flown(runner, 0.0, 2.0)
    assert {roll for roll, *_ in ticks[1:]} == {ticks[1][0]}
    (change,) = told(ticks)
    assert not change.handed_over
    assert change.text == "new cannot take over (ValueError: made up); old flies on"


def test_the_monitor_leads_down_and_back_up():
    first, second = Fake(0.1), Fake(0.0)
    runner = runner_of(("first", first), ("second", second))
    flown(runner, 0.0, 1.0)
    first.y_tilde = 1.3
    ticks = flown(runner, 1.0, 2.0)
    assert ticks[-1][2].controller == "second"
    assert ticks[-1][2].monitor == "reduced"
    (change,) = told(ticks)
    assert change.cause == "monitor"
    assert "the monitor saw ỹ 1." in change.text
    first.y_tilde = 0.0
    ticks = flown(runner, 2.0, 4.0)
    assert ticks[-1][2].controller == "first"
    assert ticks[-1][2].monitor == "nominal"


def test_a_monitor_that_may_not_act_only_warns():
    first = Fake(0.1)
    first.y_tilde = 5.0
    runner = runner_of(("first", first), ("second", Fake(0.0)), acts=False)
    ticks = flown(runner, 0.0, 2.0)
    assert {watch.controller for *_, watch in ticks} == {"first"}
    (change,) = told(ticks)
    assert not change.handed_over


@pytest.mark.parametrize("error", [ZeroDivisionError("made up"), KeyError("x")])
def test_when_the_monitor_itself_fails_the_flight_goes_on_as_it_is(monkeypatch, error):
    def fail(*_):
        raise error

    stack = Fake(0.1)
    runner = runner_of(("first", stack), ("second", Fake(0.0)))
    before = flown(runner, 0.0, 0.5)
    monkeypatch.setattr(monitor, "step", fail)
    stack.y_tilde = 9.0
    after = flown(runner, 0.5, 2.0)
    assert [roll for roll, *_ in after] == [before[-1][0]] * len(after)
    assert {watch.controller for *_, watch in after} == {"first"}
    assert {watch.monitor for *_, watch in after} == {"failed"}
    (change,) = told(after)
    assert "the monitor failed" in change.text
    assert "it watches no more; first flies on" in change.text


@pytest.mark.parametrize("broken", ["raises", "unsound"])
def test_a_controller_that_fails_is_relieved_at_once_and_for_good(broken):
    first, second = Fake(0.1), Fake(0.0)
    runner = runner_of(("first", first), ("second", second))
    flown(runner, 0.0, 1.0)
    if broken == "raises":
        first.raises = KeyError("made up")
    else:
        first.field = math.nan
    ticks = flown(runner, 1.0, 1.1)
    assert all(math.isfinite(roll) and math.isfinite(thrust) for roll, thrust, _ in ticks)
    (change,) = told(ticks)
    assert change.cause == "failure"
    first.raises, first.field = None, 0.5
    assert {w.controller for *_, w in flown(runner, 1.1, 20.0)} == {"second"}


def test_with_nobody_below_a_failure_is_the_supervisors():
    stack = Fake(0.1)
    runner = runner_of(("first", stack))
    flown(runner, 0.0, 0.1)
    stack.raises = KeyError("made up")
    with pytest.raises(KeyError):
        flown(runner, 0.1, 0.2)
    stack.raises, stack.field = None, 1.5
    flown(runner, 0.2, 0.21)
    with pytest.raises(UnsoundCommandError):
        flown(runner, 0.21, 0.22)


def test_the_adaptation_is_switched_off_at_its_mean_and_on_again_with_its_memory():
    stack = Fake(0.1)
    runner = runner_of(("one", stack), switches=[(1.0, "l1-off"), (2.0, "l1-on")])
    ticks = flown(runner, 0.0, 3.0)
    assert [c.controller for c in told(ticks)] == ["one, L1 off", "one"]
    assert ticks[180][0] == pytest.approx(0.2)
    assert ticks[-1][0] == pytest.approx(0.1)
    assert len(stack.starts) == 1


def test_what_has_no_adaptation_or_has_it_on_already_flies_on():
    runner = runner_of(("one", Fake(0.1, adapts=False)), switches=[(1.0, "l1-off"), (2.0, "l1-on")])
    changes = told(flown(runner, 0.0, 3.0))
    assert [c.handed_over for c in changes] == [False, False]
    assert "no adaptation" in changes[0].text
    assert "on already" in changes[1].text


def test_handing_over_to_who_flies_already_is_nothing():
    one, same = Fake(0.2), Fake(0.2)
    runner = runner_of(
        ("one", one), ("below", Fake(0.1)),
        switches=[(1.0, "one"), (2.0, "l1-off"), (3.0, "one"), (4.0, "one")],
        others={"one": ladder(("one", same))},
    )  # fmt: skip
    changes = told(flown(runner, 0.0, 5.0))
    assert [c.handed_over for c in changes] == [False, True, True, False]
    assert changes[0].text == "hand-over to one: nothing is to be done; one flies on"
    assert [c.controller for c in changes] == ["one", "one, L1 off", "one", "one"]
    assert (len(one.starts), len(same.starts)) == (1, 1)


def test_engaging_again_begins_with_the_configured_one_and_its_hand_overs():
    runner = runner_of(
        ("old", Fake(0.2)), switches=[(1.0, "new")], others={"new": ladder(("new", Fake(0.0)))}
    )
    assert flown(runner, 0.0, 2.0)[-1][2].controller == "new"
    runner.engage((0.0, 0.0, 0.0))
    ticks = flown(runner, 10.0, 10.02)
    assert len(told(ticks)) == 1
    runner.engage((0.0, 0.0, 0.0))
    assert flown(runner, -5.0, 0.5)[-1][2].controller == "old"


def test_a_single_stack_is_watched_by_nobody():
    stack = Fake(0.1)
    stack.y_tilde = 100.0
    ticks = flown(StackRunner(only(stack)), 0.0, 2.0)
    assert not told(ticks)
    assert {watch.monitor for *_, watch in ticks} == {""}


def test_a_ladder_is_the_configured_one_then_its_cautious_variant_then_its_fallback():
    plus = make_stacks(load_flight(None, {"controller": "mpc-l1-plus"}, {}))
    assert [(rung.name, rung.level) for rung in plus.ladder] == [
        ("mpc-l1-plus", "nominal"),
        ("mpc-l1-plus, cautious", "reduced"),
        ("mpc-l1", "robust"),
    ]
    plain = make_stacks(load_flight(None, {"switch": ["t=3:pid-l1"]}, {}))
    assert [rung.name for rung in plain.ladder] == ["mpc-l1"]
    assert [rung.name for rung in plain.others["pid-l1"]] == ["pid-l1"]
    assert plain.monitor.delay_made_for_s == pytest.approx(0.03)
