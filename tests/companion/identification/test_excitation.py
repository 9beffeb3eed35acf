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


@settings(deadline=None, derandomize=True, max_examples=20)
@given(boxes, heights)
def test_each_part_ends_where_it_began_and_at_rest(box_m, height_m):
    for part in plan_program(box_about(box_m, height_m)).parts:
        farthest, way, speed = flown(part)
        assert abs(way) <= 0.02 * max(farthest, 0.01), part.name
        assert abs(speed) < 0.02, part.name


@settings(deadline=None, derandomize=True, max_examples=20)
@given(boxes, heights)
def test_no_part_alone_leads_further_than_half_of_the_box(box_m, height_m):
    box = box_about(box_m, height_m)
    for part in plan_program(box).parts:
        limit = box.vertical_m if part.axis in ("lift", "climb") else box.horizontal_m
        assert flown(part)[0] <= 0.5 * limit, part.name


def test_every_command_that_is_identified_is_played():
    parts = plan_program(box_about(2.5, 2.5)).parts
    played = {(part.name, part.axis) for part in parts}
    assert played == {
        ("hover", "none"),
        ("roll", "roll"),
        ("pitch", "pitch"),
        ("thrust", "lift"),
        ("climb", "climb"),
        ("swing", "pitch"),
    }
    instead = [part.over_climb_rate for part in parts if part.over_climb_rate is not None]
    assert [(part.name, part.axis) for part in instead] == [("climb", "climb")]


def test_parts_do_not_overlap_and_each_is_found_in_its_time():
    program = plan_program(box_about(2.5, 2.5))
    assert program.at(-0.1) is None
    assert program.at(program.duration_s) is None
    ends = [b + p.slot_s for b, p in zip(program.begins_s, program.parts, strict=True)]
    for index, (begin, end) in enumerate(zip(program.begins_s, ends, strict=True)):
        assert program.at(begin) == index
        assert program.at(end - 1e-6) == index
        assert program.at(end + 1e-6) is None
    later = [*program.begins_s[1:], program.duration_s]
    assert all(end + 0.4 < begin for end, begin in zip(ends, later, strict=True))


def test_a_flight_in_the_default_box_takes_less_than_a_minute():
    assert plan_program(box_about(2.5, 2.5)).duration_s < 60.0


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
