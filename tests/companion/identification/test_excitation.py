"""The timetable of an identification flight: its parts come back, and fit into the box."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.identification.excitation import (
    LARGEST_BOX_M,
    SMALLEST_BOX_M,
    Box,
    box_about,
    plan_program,
)

_GRAVITY_M_S2 = 9.80665
boxes = st.floats(SMALLEST_BOX_M, LARGEST_BOX_M)
heights = st.floats(1.1, 20.0)


def flown(part, *, step_s=0.001):
    """Greatest way, and the way and the speed that are left, of a vehicle that obeys at once."""
    position = speed = farthest = 0.0
    steps = round(part.duration_s / step_s)
    for k in range(steps):
        level = part.level((k + 0.5) * step_s)
        if part.axis == "climb":
            position += level * step_s
            speed = 0.0
        else:
            push = level if part.axis == "lift" else _GRAVITY_M_S2 * math.tan(level)
            position += speed * step_s + 0.5 * push * step_s**2
            speed += push * step_s
        farthest = max(farthest, abs(position))
    return farthest, position, speed


def stepped(program):
    """The parts of levels, those for a climb-rate field too."""
    both = [p for part in program.parts for p in (part, part.over_climb_rate) if p is not None]
    return [part for part in both if part.axis not in ("none", "swing")]


@settings(deadline=None, derandomize=True, max_examples=20)
@given(boxes, heights)
def test_each_part_of_steps_ends_at_rest_and_not_far_from_where_it_began(box_m, height_m):
    for part in stepped(plan_program(box_about(box_m, height_m), 3.0)):
        farthest, way, speed = flown(part)
        assert abs(way) <= farthest
        assert abs(speed) < 0.02, part.name
        if part.axis in ("roll", "pitch"):
            assert abs(way) < 0.5 * farthest, part.name


@settings(deadline=None, derandomize=True, max_examples=20)
@given(boxes, heights)
def test_no_part_of_steps_alone_leads_further_than_six_tenths_of_the_box(box_m, height_m):
    box = box_about(box_m, height_m)
    for part in stepped(plan_program(box, 3.0)):
        limit = box.vertical_m if part.axis in ("lift", "climb") else box.horizontal_m
        assert flown(part)[0] <= 0.6 * limit, part.name


def test_each_tilt_has_edges_enough():
    parts = plan_program(box_about(2.5, 2.5), 3.0).parts
    for part in parts:
        if part.axis in ("roll", "pitch"):
            assert len(part.levels) >= 12
            assert len(set(part.durations_s)) >= 5


@settings(deadline=None, derandomize=True, max_examples=20)
@given(boxes, st.floats(1.0, 10.0))
def test_the_swing_begins_and_ends_at_rest_and_stays_in_box_and_speed(box_m, limit_m_s):
    (swing,) = (
        part.swing
        for part in plan_program(box_about(box_m, 2.5), limit_m_s).parts
        if part.swing is not None
    )
    times = [0.01 * k for k in range(round(100 * swing.duration_s) + 1)]
    motions = [swing.motion(time_s) for time_s in times]
    for ends in (motions[0], motions[-1]):
        assert all(abs(c) < 2e-2 for vector in ends for c in vector)
    farthest = max(max(abs(c) for c in position) for position, *_ in motions)
    assert 0.2 * min(box_m, limit_m_s / 2.0) < farthest < 0.75 * box_m
    assert max(math.hypot(*velocity) for _, velocity, _ in motions) < 1.02 * limit_m_s
    for before, (_, velocity, push), after in zip(motions, motions[1:], motions[2:], strict=False):
        for axis in (0, 1):
            way, change = after[0][axis] - before[0][axis], after[1][axis] - before[1][axis]
            assert way / 0.02 == pytest.approx(velocity[axis], abs=0.03)
            assert change / 0.02 == pytest.approx(push[axis], abs=0.2)


def test_every_command_that_is_identified_is_played():
    parts = plan_program(box_about(2.5, 2.5), 3.0).parts
    played = {(part.name, part.axis) for part in parts}
    assert played == {
        ("hover", "none"),
        ("roll", "roll"),
        ("pitch", "pitch"),
        ("thrust", "lift"),
        ("climb", "climb"),
        ("swing", "swing"),
    }
    instead = [part.over_climb_rate for part in parts if part.over_climb_rate is not None]
    assert [(part.name, part.axis) for part in instead] == [("climb", "climb")] * 2
    assert sum(part.duration_s for part in instead) > 16.0


def test_parts_do_not_overlap_and_each_is_found_in_its_time():
    program = plan_program(box_about(2.5, 2.5), 3.0)
    assert program.at(-0.1) is None
    assert program.at(program.duration_s) is None
    ends = [b + p.slot_s for b, p in zip(program.begins_s, program.parts, strict=True)]
    for index, (begin, end) in enumerate(zip(program.begins_s, ends, strict=True)):
        assert program.at(begin) == index
        assert program.at(end - 1e-6) == index
        assert program.at(end + 1e-6) is None
    later = [*program.begins_s[1:], program.duration_s]
    assert all(end + 0.4 < begin for end, begin in zip(ends, later, strict=True))


def test_the_timetable_takes_no_more_than_a_minute():
    assert plan_program(box_about(2.5, 2.5), 3.0).duration_s <= 60.0


@pytest.mark.parametrize(
    ("box_m", "height_m", "said"),
    [(0.5, 2.5, "a box of ±0.5 m"), (50.0, 2.5, "a box of ±50 m"), (2.5, 0.8, "a hover of 0.8 m")],
)
def test_a_box_in_which_nothing_can_be_flown_is_refused(box_m, height_m, said):
    with pytest.raises(ValueError, match=said):
        box_about(box_m, height_m)


def test_the_box_ends_above_the_ground():
    for height_m in (1.1, 1.3, 1.7, 5.0):
        assert height_m - box_about(2.0, height_m).vertical_m >= 0.5 - 1e-9


def test_outside_is_told_by_the_axis_that_is_furthest_out():
    box = Box(2.0, 1.0)
    assert box.outside_m((0.0, 0.0, 0.0)) < 0.0
    assert box.outside_m((1.9, -1.9, 0.9)) < 0.0
    assert box.outside_m((0.0, -2.3, 0.0)) == pytest.approx(0.3)
    assert box.outside_m((0.0, 0.0, -1.2)) == pytest.approx(0.2)
