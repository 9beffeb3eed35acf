"""What does not fit is told with time, figure, limit and remedy."""

from dataclasses import replace

import numpy as np
import pytest

from companion.trajectories.feasibility import (
    Fence,
    MotionLimits,
    fence_problems_of,
    problems_of,
)
from companion.trajectories.from_file import SplineTrajectory
from companion.trajectories.harmonic import TEST_TRAJECTORIES

WIDE = MotionLimits(3.0, 4.2)
FENCE = Fence((-3.0, -3.0, 0.2), (3.0, 3.0, 4.0))
CIRCLE = TEST_TRAJECTORIES[2]


@pytest.mark.parametrize("number", [1, 2, 3, 4, 5])
def test_the_test_trajectories_fit(number):
    assert problems_of(TEST_TRAJECTORIES[number], WIDE) == []
    assert fence_problems_of(TEST_TRAJECTORIES[number], FENCE) == []


def test_too_fast():
    (text,) = problems_of(CIRCLE, replace(WIDE, speed_m_s=0.9))
    assert text.startswith("trajectory '2 circle' needs a speed of 1.00 m/s at t = ")
    assert "the vehicle's limit is 0.9 m/s. Fly it slower, or raise the limit" in text


def test_too_hard_an_acceleration():
    (text,) = problems_of(CIRCLE, replace(WIDE, acceleration_m_s2=0.5))
    assert "needs an acceleration of 1." in text
    assert "m/s² at t = " in text
    assert "the vehicle's limit is 0.5 m/s²" in text


@pytest.mark.parametrize(
    ("low", "high", "says"),
    [
        ((-3.0, -3.0, 0.2), (0.75, 3.0, 4.0), "0.25 m outside on x, where -3 … 0.75 m is"),
        ((-3.0, -0.6, 0.2), (3.0, 3.0, 4.0), "0.40 m outside on y, where -0.6 … 3 m is"),
        ((-3.0, -3.0, 1.5), (3.0, 3.0, 4.0), "0.30 m outside on z, where 1.5 … 4 m is"),
    ],
)
def test_outside_the_geofence(low, high, says):
    (text,) = fence_problems_of(CIRCLE, Fence(low, high))
    assert text.startswith("trajectory '2 circle' leaves the geofence at t = ")
    assert says in text
    assert "Move the origin, or widen `geofence` in the mission." in text


def test_the_time_and_place_told_are_those_of_the_worst_point():
    climb = SplineTrajectory("hop", (0.0, 4.0, 8.0), ((0, 0, 1), (0, 0, 3), (0, 0, 1)))
    (text,) = fence_problems_of(climb, replace(FENCE, high_m=(3.0, 3.0, 2.0)))
    assert "at t = 4.00 s: (0.00, 0.00, 3.00) m is 1.00 m outside on z" in text


def test_everything_that_is_wrong_is_told_at_once():
    assert len(problems_of(CIRCLE, MotionLimits(0.1, 0.1))) == 2


def test_a_motion_that_is_not_a_number_does_not_fit():
    class Broken:
        name, scored_s, end_s = "broken", 1.0, 1.0

        def motion(self, times_s):
            motion = CIRCLE.motion(times_s)
            return replace(motion, velocity_m_s=np.full_like(motion.velocity_m_s, np.nan))

    assert any("speed of nan" in text for text in problems_of(Broken(), WIDE))
