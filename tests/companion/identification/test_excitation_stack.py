"""The stack that plays an excitation, tick by tick."""

import math

import numpy as np
import pytest

from companion.config.resolve import load_flight
from companion.control.frameworks import Tick
from companion.experiments.identification_flight import load_identification, plan_identification
from companion.flight.assemble import make_paper_stack
from companion.frames import quaternion_from_euler
from companion.identification.excitation_stack import HOLD, ExcitationStack
from companion.thrust_meaning import COLLECTIVE, ThrustMeaning
from companion.vehicle_state import VehicleState

CLIMB_RATE = ThrustMeaning("climb_rate", 2.5, 1.5)
HOVER_M = (0.0, 0.0, 2.5)
DT = 0.01
BIG_ROLL_RAD = math.radians(8.0)


@pytest.fixture(scope="module")
def plan():
    return plan_identification(load_identification(None, {"vehicle": "x500"}, {}))


def stack_of(plan, thrust=COLLECTIVE):
    hold = make_paper_stack(plan.config.controller, plan.config.vehicle, plan.config.mission)
    if thrust is not COLLECTIVE:
        hold = make_paper_stack(
            plan.config.controller, plan.config.vehicle, plan.config.mission, thrust=thrust
        )
    return ExcitationStack(hold, plan.experiment.program, plan.experiment.box)


def state_at(time_s, position=HOVER_M, velocity=(0.0, 0.0, 0.0), yaw=0.0):
    attitude = quaternion_from_euler(0.0, 0.0, yaw)
    return VehicleState(time_s, position, velocity, attitude, (0.0, 0.0, 0.0))


def here(times_s):
    return np.tile(np.array(HOVER_M), (len(times_s), 1))


def play(stack, from_s, to_s, *, state=state_at, memory=None, yaw=0.0):
    """Records and commands of a vehicle that does not move, between two times of the timetable."""
    memory = memory or stack.start(state(from_s - DT))
    steps = []
    for k in range(round((to_s - from_s) / DT)):
        time_s = from_s + k * DT
        tick = Tick(state(time_s), 0.03, yaw, time_s)
        memory, command, record = stack.step(memory, tick, here)
        steps.append((time_s, command, record))
    return steps, memory


def left_of(steps):
    """What is told of parts that are left, each once."""
    return [left for left in dict.fromkeys(record.left for *_, record in steps) if left]


def begin_of(plan, name, nth=0):
    parts = plan.experiment.program.parts
    index = [k for k, part in enumerate(parts) if part.name == name][nth]
    return plan.experiment.program.begins_s[index], parts[index]


def test_before_the_timetable_begins_the_hold_flies(plan):
    steps, _ = play(stack_of(plan), -3.0, -1.0)
    assert {record.segment for *_, record in steps} == {HOLD}
    assert all(abs(record.roll_rad) < 1e-9 for *_, record in steps)


@pytest.mark.parametrize(("name", "which"), [("roll", 0), ("pitch", 1)])
def test_a_tilt_is_commanded_in_its_levels_and_the_other_one_held(plan, name, which):
    begin_s, part = begin_of(plan, name)
    steps, _ = play(stack_of(plan), begin_s - 0.2, begin_s + part.duration_s + 0.2)
    for time_s, _, record in steps:
        since_s = time_s - begin_s
        tilts = (record.roll_rad, record.pitch_rad)
        inside = 0.0 <= since_s < part.duration_s
        assert record.segment == (name if inside else HOLD)
        assert tilts[which] == pytest.approx(part.level(since_s) if inside else 0.0, abs=1e-9)
        assert tilts[1 - which] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("name", "which"), [("roll", 0), ("pitch", 1)])
def test_beneath_a_tilt_that_is_played_part_of_the_hold_stays_on(plan, name, which):
    """A vehicle that drifts away is led back, by less than the hold alone would."""
    begin_s, part = begin_of(plan, name)

    def adrift(time_s):
        return state_at(time_s, (0.3, 0.3, 2.5))

    steps, _ = play(stack_of(plan), begin_s, begin_s + 0.05, state=adrift)
    alone, _ = play(stack_of(plan), -1.0, -0.95, state=adrift)
    now = (steps[0][2].roll_rad, steps[0][2].pitch_rad)[which] - part.levels[0]
    held = (alone[0][2].roll_rad, alone[0][2].pitch_rad)[which]
    assert now == pytest.approx(0.4 * held, rel=0.02)
    assert held != 0.0


def test_a_tilt_is_of_the_body_wherever_it_points(plan):
    begin_s, part = begin_of(plan, "roll")
    yaw = 2.0
    steps, _ = play(
        stack_of(plan),
        begin_s,
        begin_s + 0.1,
        state=lambda t: state_at(t, yaw=yaw),
        yaw=yaw,
    )
    _, command, record = steps[5]
    assert record.roll_rad == pytest.approx(part.levels[0])
    assert record.pitch_rad == pytest.approx(0.0, abs=1e-9)
    expected = quaternion_from_euler(part.levels[0], 0.0, yaw)
    assert command.attitude_flu_to_enu == pytest.approx(expected, abs=1e-6)


def test_tilts_are_played_about_the_trim_that_the_hold_has_found(plan):
    begin_s, part = begin_of(plan, "roll")
    stack = stack_of(plan)
    lean = math.radians(5.0)

    def leaning(time_s):
        attitude = quaternion_from_euler(lean, 0.0, 0.0)
        return VehicleState(time_s, HOVER_M, (0.0, 0.0, 0.0), attitude, (0.0, 0.0, 0.0))

    steps, _ = play(stack, begin_s, begin_s + 0.1, state=leaning)
    assert steps[5][2].roll_rad == pytest.approx(lean + part.levels[0], abs=1e-6)


def test_thrust_is_played_over_a_hold_that_is_weaker_than_the_flights_own(plan):
    begin_s, part = begin_of(plan, "thrust")
    stack = stack_of(plan)
    steps, _ = play(stack, begin_s, begin_s + part.durations_s[0] - 0.02)
    hover = steps[0][2].hover_thrust
    _, command, record = steps[0]
    assert record.segment == "thrust"
    assert command.thrust == pytest.approx(hover * (1.0 + part.levels[0] / 9.80665), rel=1e-6)
    rising, _ = play(
        stack,
        begin_s,
        begin_s + 0.03,
        state=lambda t: state_at(t, velocity=(0.0, 0.0, 0.4)),
    )
    less = (command.thrust - rising[0][1].thrust) / hover * 9.80665
    assert less == pytest.approx(0.4 * 1.0, rel=1e-6)


def test_quick_thrusts_do_not_lead_the_estimate_of_the_hover_thrust_astray(plan):
    begin_s, part = begin_of(plan, "thrust")
    steps, _ = play(stack_of(plan), begin_s, begin_s + part.duration_s)
    hovers = {record.hover_thrust for *_, record in steps}
    assert len(hovers) == 1


def test_over_a_climb_rate_field_all_vertical_time_goes_to_the_climb_rate(plan):
    stack = stack_of(plan, CLIMB_RATE)
    for name in ("thrust", "climb"):
        begin_s, part = begin_of(plan, name)
        instead = part.over_climb_rate
        steps, _ = play(stack, begin_s, begin_s + part.slot_s + 0.1)
        for time_s, command, record in steps:
            inside = time_s - begin_s < instead.duration_s
            assert record.segment == ("climb" if inside else HOLD)
            if inside:
                level = instead.level(time_s - begin_s)
                rate = 2.5 if level > 0.0 else 1.5
                assert record.applied_u[2] == pytest.approx(level)
                assert command.thrust == pytest.approx(0.5 + 0.5 * level / rate)


def test_a_swing_is_pushed_along_its_way_and_led_back_to_it(plan):
    begin_s, part = begin_of(plan, "swing")
    since_s = 5.0
    (x, y), (v_x, v_y), _ = part.swing.motion(since_s)
    push = part.swing.motion(since_s + 0.2)[2]

    def one(off):
        def state(time_s):
            velocity = (v_x, v_y, 0.0) if time_s > begin_s + since_s - 0.005 else (0.0, 0.0, 0.0)
            at = part.swing.position_m(max(0.0, time_s - begin_s))
            return state_at(time_s, (at[0] + off, at[1], 2.5), velocity)

        steps, _ = play(stack_of(plan), begin_s, begin_s + since_s + 0.01, state=state)
        return steps[-1][2]

    along, beside = one(0.0), one(0.1)
    assert along.segment == "swing"
    assert along.applied_u[:2] * 9.80665 == pytest.approx(push, rel=0.05)
    assert beside.applied_u[0] < along.applied_u[0]
    assert x != 0.0
    assert y != 0.0


def test_a_swing_is_left_where_the_vehicle_is_far_off_its_way(plan):
    begin_s, _ = begin_of(plan, "swing")
    far = 0.45 * plan.experiment.box.horizontal_m

    def astray(time_s):
        return state_at(time_s, (far if time_s > begin_s + 0.5 else 0.0, 0.0, 2.5))

    steps, _ = play(stack_of(plan), begin_s, begin_s + 1.0, state=astray)
    segments = [record.segment for *_, record in steps]
    assert segments[:50] == ["swing"] * 50
    assert set(segments[52:]) == {HOLD}
    (left,) = left_of(steps)
    assert "the part 'swing' is not played beyond 0.5 of its 15.0 s" in left
    assert "off the swing's way" in left


def test_a_part_is_left_where_the_vehicle_would_stop_outside_and_not_taken_up_again(plan):
    begin_s, part = begin_of(plan, "roll")
    stack = stack_of(plan)
    out = 0.95 * plan.experiment.box.horizontal_m

    def running(time_s):
        gone = 0.5 < time_s - begin_s < 0.7
        return state_at(time_s, (0.0, -1.0, 2.5), (0.0, -(out - 0.9) * gone, 0.0))

    steps, _ = play(stack, begin_s, begin_s + part.duration_s, state=running)
    segments = [record.segment for *_, record in steps]
    assert segments[:50] == ["roll"] * 50
    assert set(segments[52:]) == {HOLD}
    (left,) = left_of(steps)
    assert "the part 'roll' is not played beyond 0.5 of its 7.8 s" in left
    assert "stopped at the edge of its box" in left
    # The hold brakes against the way out.
    assert steps[55][2].roll_rad < 0.0


def test_a_part_that_was_missed_is_not_begun_in_its_midst(plan):
    begin_s, part = begin_of(plan, "pitch")
    steps, _ = play(stack_of(plan), begin_s + 0.5, begin_s + part.duration_s)
    assert {record.segment for *_, record in steps} == {HOLD}
    (left,) = left_of(steps)
    assert "the part 'pitch' is not played beyond 0.5 of its 7.8 s" in left
    assert "the hold had to begin anew" in left


def test_of_a_timetable_that_is_played_whole_nothing_is_told_to_be_left(plan):
    for thrust in (COLLECTIVE, CLIMB_RATE):
        stack = stack_of(plan, thrust)
        before_swing_s, _ = begin_of(plan, "swing")
        steps, _ = play(stack, -1.0, before_swing_s)
        assert left_of(steps) == []


def test_the_hover_is_what_it_is_from_wherever_it_begins(plan):
    begin_s, part = begin_of(plan, "hover")
    steps, _ = play(stack_of(plan), begin_s + 2.0, begin_s + part.duration_s)
    assert {record.segment for *_, record in steps} == {"hover"}


def test_the_commanded_tilt_never_exceeds_the_vehicles_limit(plan):
    limit = math.radians(plan.config.vehicle.tilt_limit_deg)
    begin_s, part = begin_of(plan, "roll")

    def leaning(time_s):
        attitude = quaternion_from_euler(limit, 0.0, 0.0)
        return VehicleState(time_s, HOVER_M, (0.0, 0.0, 0.0), attitude, (0.0, 0.0, 0.0))

    steps, _ = play(stack_of(plan), begin_s, begin_s + part.duration_s, state=leaning)
    assert max(abs(record.roll_rad) for *_, record in steps) <= limit + 1e-9


def test_what_is_not_finite_raises_in_place_of_being_sent(plan):
    stack = stack_of(plan)
    memory = stack.start(state_at(0.0))
    bad = Tick(state_at(0.01, (math.nan, 0.0, 2.5)), 0.03, 0.0, 0.01)
    with pytest.raises(ValueError, match="not finite"):
        stack.step(memory, bad, here)
    with pytest.raises(ValueError, match="time does not advance"):
        stack.step(memory, Tick(state_at(0.0), 0.03, 0.0, 0.0), here)


def test_the_hold_keeps_a_slow_vehicle_steady():
    """Through a lag of 0.35 s, in all, from a metre off: it comes back and rings down."""
    config = load_flight(None, {"controller": str(_hold_file()), "vehicle": "sih_quadx"}, {})
    stack = make_paper_stack(config.controller, config.vehicle, config.mission)
    memory = stack.start(state_at(0.0, (1.0, 0.0, 2.5)))
    x, v, tilt, lag, delay = 1.0, 0.0, 0.0, 0.25, 10
    queue = [0.0] * delay
    course = []
    for k in range(1, 4001):
        tick = Tick(state_at(k * DT, (x, 0.0, 2.5), (v, 0.0, 0.0)), 0.0, 0.0, k * DT)
        memory, _, record = stack.step(memory, tick, here)
        queue.append(float(record.applied_u[0]))
        tilt += DT / lag * (queue.pop(0) - tilt)
        v += 9.80665 * tilt * DT
        x += v * DT
        course.append(x)
    assert max(abs(c) for c in course[2000:]) < 0.05
    assert min(course) > -0.6


def _hold_file():
    from companion.config.resolve import configs_folder

    return configs_folder() / "identify" / "hold.yaml"
