"""A tick of the control: what is sent at samples, in silence, and when the controller is broken."""

import math
from dataclasses import replace

import numpy as np
import pytest

from companion.config.resolve import load_flight
from companion.flight.assemble import make_stack, make_trajectory, supervisor_limits
from companion.flight.setpoints.control_loop import ControlLoop
from companion.flight.setpoints.stack_runner import Change
from companion.flight.setpoints.supervisor import Rung
from companion.flight.setpoints.timeline import plan_timeline
from companion.frames import quaternion_from_euler, tilt_cosine, yaw_of
from companion.vehicle_state import VehicleState

CONFIG = load_flight(None, {"trajectory": 4}, {})
LIMITS = supervisor_limits(CONFIG.mission)
POSITION = (0.1, -0.2, 2.0)
STEP_S = 0.01


class Stack:
    """The real stack, which can be told to misbehave."""

    def __init__(self):
        self._stack = make_stack(CONFIG.controller, CONFIG.vehicle, CONFIG.mission)
        self.thrust = self._stack.thrust
        self.spoil = lambda command: command
        self.raises = None
        self.start_raises = None
        self.starts = 0
        self.attitude_loop = None

    def about(self, anchor_enu_m):
        self._stack = self._stack.about(anchor_enu_m)
        return self

    def start(self, state, thrust_memory=None):
        self.starts += 1
        if self.start_raises is not None:
            raise self.start_raises
        return self._stack.start(state, thrust_memory)

    def step(self, memory, tick, reference):
        if self.raises is not None:
            raise self.raises
        memory, command, record = self._stack.step(memory, tick, reference)
        return memory, self.spoil(command), record


@pytest.fixture
def stack():
    return Stack()


@pytest.fixture
def loop(stack):
    return ControlLoop(stack, LIMITS)


def state_at(time_s, *, velocity=(0.0, 0.0, 0.0), tilt_deg=0.0, yaw=0.4):
    attitude = quaternion_from_euler(math.radians(tilt_deg), 0.0, yaw)
    return VehicleState(time_s, POSITION, velocity, attitude, (0.0, 0.0, 0.0))


def engage(loop, start_s=10.0):
    timeline = plan_timeline(
        make_trajectory(CONFIG.mission),
        start_s=start_s,
        from_m=np.array(POSITION),
        home_m=np.array(POSITION),
        hover_s=1.0,
        speed_m_s=0.6,
    )
    loop.engage(timeline, 0.4)


def fly(loop, begin_s, end_s, **state):
    count = round((end_s - begin_s) / STEP_S)
    return [loop.on_sample(state_at(begin_s + k * STEP_S, **state), 0.03) for k in range(count)]


def tilt_deg(output):
    return math.degrees(math.acos(min(1.0, tilt_cosine(output.attitude_flu_to_enu))))


def test_before_engagement_it_holds_level_at_its_heading(loop):
    (output,) = fly(loop, 10.0, 10.01, tilt_deg=5.0)
    assert output.rung is Rung.TRACK
    assert output.fallback == ""
    assert tilt_deg(output) == pytest.approx(0.0, abs=1e-6)
    assert yaw_of(output.attitude_flu_to_enu) == pytest.approx(0.4)
    assert output.thrust == pytest.approx(CONFIG.vehicle.hover_thrust, rel=0.05)
    assert loop.desired_position(10.0) is None


def test_engaged_it_tracks_from_the_second_sample_on(loop):
    engage(loop)
    outputs = fly(loop, 10.0, 10.2)
    assert outputs[0].stack is None
    assert all(o.stack is not None and o.rung is Rung.TRACK for o in outputs[1:])
    assert loop.desired_position(10.0) == pytest.approx(POSITION)


def test_engaging_at_a_tilt_continues_it(loop):
    engage(loop)
    outputs = fly(loop, 10.0, 10.02, tilt_deg=6.0)
    assert tilt_deg(outputs[1]) == pytest.approx(6.0, abs=1.5)


@pytest.mark.parametrize("back_s", [0.0, 0.01, 5.0])
def test_a_sample_that_is_not_later_is_not_flown_on(loop, back_s):
    fly(loop, 10.0, 10.1)
    assert loop.on_sample(state_at(10.09 - back_s), 0.03) is None
    assert loop.on_sample(state_at(10.11), 0.03) is not None


def test_after_release_time_may_begin_anew(loop):
    """The autopilot may have restarted before a person resumed."""
    fly(loop, 10.0, 10.1)
    loop.release()
    assert loop.on_sample(state_at(1.0), 0.03) is not None


def test_silence_within_the_limit_is_nothing(loop):
    engage(loop)
    fly(loop, 10.0, 10.2)
    assert loop.on_silence(10.25, 0.06, "") is None
    assert loop.rung is Rung.TRACK


def test_silence_beyond_it_is_level_and_then_the_end(loop):
    engage(loop)
    fly(loop, 10.0, 10.2, tilt_deg=8.0)
    rungs = []
    for k in range(60):
        age = 0.11 + 0.02 * k
        output = loop.on_silence(10.19 + age, age, "all NaN")
        rungs.append(output.rung)
        if output.rung is Rung.LEVEL:
            assert output.fallback == "level"
            assert tilt_deg(output) == pytest.approx(0.0, abs=1e-6)
            assert 0.3 < output.thrust < 0.7
            assert "all NaN" in output.reason
        else:
            assert output.attitude_flu_to_enu is None
    assert rungs[0] is Rung.LEVEL
    assert rungs[-1] is Rung.HAND_OVER
    assert rungs.index(Rung.HAND_OVER) * 0.02 == pytest.approx(LIMITS.hand_over_after_s, abs=0.03)
    # The state's return changes nothing then.
    output = loop.on_sample(state_at(12.0), 0.03)
    assert output.rung is Rung.HAND_OVER
    assert output.attitude_flu_to_enu is None


def test_when_the_state_returns_the_controller_starts_anew_from_it(loop, stack):
    engage(loop)
    fly(loop, 10.0, 10.2)
    loop.on_silence(10.4, 0.2, "")
    outputs = fly(loop, 10.45, 10.5, tilt_deg=3.0)
    assert stack.starts == 2
    assert [o.rung for o in outputs[:2]] == [Rung.LEVEL, Rung.TRACK]
    assert tilt_deg(outputs[1]) == pytest.approx(3.0, abs=1.0)


def test_the_watch_does_not_hide_a_broken_controller(loop, stack):
    """Samples come and the state is fresh: the ladder must go on down all the same."""
    engage(loop)
    fly(loop, 10.0, 10.2)
    stack.raises = ZeroDivisionError("made up")
    rungs = []
    for k in range(100):
        now = 10.2 + k * STEP_S
        rungs.append(loop.on_sample(state_at(now), 0.03).rung)
        assert loop.on_silence(now + 0.005, 0.005, "") is None
    assert rungs[0] is Rung.LEVEL
    assert rungs.index(Rung.HAND_OVER) * STEP_S == pytest.approx(0.81, abs=0.02)


@pytest.mark.parametrize("where", ["start", "step"])
def test_whatever_raises_in_the_controller_ends_on_the_ladder(loop, stack, where):
    engage(loop)
    error = KeyError("made up")
    stack.start_raises = error if where == "start" else None
    stack.raises = error if where == "step" else None
    outputs = fly(loop, 10.0, 11.5)
    assert outputs[1].rung is Rung.LEVEL
    assert outputs[1].reason == "the controller failed (KeyError: 'made up')"
    assert outputs[-1].rung is Rung.HAND_OVER


@pytest.mark.parametrize(
    "change",
    [
        {"thrust": math.nan},
        {"thrust": 1.5},
        {"thrust": -0.1},
        {"attitude_flu_to_enu": (math.nan, 0.0, 0.0, 0.0)},
        {"attitude_flu_to_enu": (math.inf, 0.0, 0.0, 0.0)},
    ],
)
def test_a_command_that_is_not_finite_or_out_of_bounds_is_never_sent(loop, stack, change):
    engage(loop)
    fly(loop, 10.0, 10.2)
    stack.spoil = lambda command: replace(command, **change)
    outputs = fly(loop, 10.2, 10.5)
    assert {o.rung for o in outputs} == {Rung.LEVEL}
    for output in outputs:
        assert all(math.isfinite(c) for c in (*output.attitude_flu_to_enu, output.thrust))
        assert 0.0 <= output.thrust <= 1.0
    stack.spoil = lambda command: command
    assert fly(loop, 10.5, 10.6)[-1].rung is Rung.TRACK


def test_holding_level_works_against_a_climb_rate(loop, stack):
    engage(loop)
    stack.raises = KeyError()
    hover = fly(loop, 10.0, 10.1)[-1].thrust
    assert fly(loop, 10.1, 10.2, velocity=(0.0, 0.0, 0.5))[-1].thrust < hover - 0.02
    assert fly(loop, 10.2, 10.3, velocity=(0.0, 0.0, -0.5))[-1].thrust > hover + 0.02
    extreme = fly(loop, 10.3, 10.4, velocity=(0.0, 0.0, 50.0))[-1].thrust
    assert extreme >= CONFIG.vehicle.minimum_thrust


def test_unreachable_references_keep_the_command_within_the_tilt_limit(loop):
    far = plan_timeline(
        make_trajectory(CONFIG.mission),
        start_s=0.0,
        from_m=np.array((90.0, -90.0, 2.0)),
        home_m=np.array((90.0, -90.0, 2.0)),
        hover_s=60.0,
        speed_m_s=0.1,
    )
    loop.engage(far, 0.4)
    outputs = fly(loop, 10.0, 11.0)[1:]
    assert max(tilt_deg(o) for o in outputs) <= CONFIG.vehicle.tilt_limit_deg + 0.1
    assert max(tilt_deg(o) for o in outputs) > 5.0


def test_outside_the_geofence_the_vehicle_is_levelled_and_handed_over(loop):
    """Whatever the outer controller is: not all of them know the fence."""
    engage(loop, 0.9)
    far = CONFIG.mission.geofence.high_m[0] + 0.6
    outputs = []
    for k in range(1, 150):
        state = replace(state_at(1.0 + k * STEP_S), position_enu_m=(far, 0.0, 2.0))
        outputs.append(loop.on_sample(state, 0.03))
    assert outputs[0].rung is Rung.LEVEL
    assert "0.6 m outside the geofence" in outputs[0].reason
    assert tilt_cosine(outputs[0].attitude_flu_to_enu) == pytest.approx(1.0)
    assert outputs[-1].rung is Rung.HAND_OVER
    assert outputs[-1].attitude_flu_to_enu is None


def test_a_little_outside_the_geofence_is_flown_on(loop):
    """The MPC's bound is soft."""
    engage(loop, 0.9)
    near = CONFIG.mission.geofence.high_m[0] + 0.3
    for k in range(1, 20):
        state = replace(state_at(1.0 + k * STEP_S), position_enu_m=(near, 0.0, 2.0))
        assert loop.on_sample(state, 0.03).rung is Rung.TRACK


def alternating(loop, speed_m_s, every=1):
    """Ten seconds of a velocity that is wrong at each, or each second, third … sample."""
    for k in range(1000):
        wrong = speed_m_s if k % (every + 1) == 0 else 0.0
        yield loop.on_sample(state_at(10.0 + k * STEP_S, velocity=(wrong, 0.0, 0.0)), 0.03)


@pytest.mark.parametrize(("speed_m_s", "every"), [(1.6, 1), (2.0, 2), (2.0, 7)])
def test_a_velocity_that_keeps_stepping_ends_on_the_ladder(loop, speed_m_s, every):
    engage(loop)
    outputs = list(alternating(loop, speed_m_s, every))
    stepped = [o for o in outputs[1:] if o.rung is Rung.TRACK and o.stack is None]
    assert stepped == []  # what holds level says so
    first = next(o for o in outputs if o.rung is Rung.LEVEL)
    assert "velocity by" in first.reason
    assert outputs[-1].rung is Rung.HAND_OVER
    assert "velocity jumped 21 times" in outputs[-1].reason


def test_after_a_single_step_of_the_velocity_it_is_level_for_a_tick(loop):
    engage(loop)
    fly(loop, 10.0, 10.2)
    outputs = fly(loop, 10.2, 10.4, velocity=(1.6, 0.0, 0.0))
    assert [o.rung for o in outputs] == [Rung.LEVEL] + [Rung.TRACK] * 19
    assert "the estimate jumped (unannounced): velocity by 1.6 m/s" in outputs[0].reason
    assert outputs[0].remark == ""  # it is told once
    assert all(o.stack is not None for o in outputs[1:])


@pytest.mark.parametrize(
    ("turn_deg", "slew", "over", "ends"),
    [
        (9.5, 1.2, False, True),
        (0.0, 1.2, False, False),  # it swings for another reason
        (9.5, 0.8, False, False),
        (9.5, math.nan, False, False),
        (9.5, 1.2, True, False),  # the next controller flies already
    ],
)
def test_a_vehicle_that_swings_since_its_heading_jumped_is_handed_over(
    loop, monkeypatch, turn_deg, slew, over, ends
):
    engage(loop)
    fly(loop, 10.0, 10.2)
    outputs = fly(loop, 10.2, 10.3, yaw=0.4 + math.radians(turn_deg))
    assert {o.rung for o in outputs} == {Rung.TRACK}
    flown = loop._runner.step

    def alarmed(tick, reference):
        command, record, watch = flown(tick, reference)
        change = Change(tick.state.time_s, tick.track_s, "mpc-l1", "monitor", "it swings", over)
        gauges = watch.gauges._replace(slew=slew)
        return command, record, replace(watch, changes=(change,), gauges=gauges)

    monkeypatch.setattr(loop._runner, "step", alarmed)
    outputs = fly(loop, 10.3, 10.31, yaw=0.4 + math.radians(turn_deg))
    monkeypatch.undo()
    outputs += fly(loop, 10.31, 11.5, yaw=0.4 + math.radians(turn_deg))
    rungs = [o.rung for o in outputs]
    if ends:
        assert "swings since the heading jumped (10 degrees" in outputs[0].reason
        assert rungs[0] is Rung.LEVEL
        assert Rung.TRACK not in rungs  # also when the alarm is over
        assert rungs[-1] is Rung.HAND_OVER
    else:
        assert set(rungs) == {Rung.TRACK}
