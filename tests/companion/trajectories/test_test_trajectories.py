"""The five test trajectories against their formulas, written out here once more."""

import math

import numpy as np
import pytest

from companion.trajectories.harmonic import TEST_TRAJECTORIES

T = np.arange(0.0, 22.0, 0.01)


def path_time(t):
    x = np.clip(t / 2, 0, 1)
    return 2 * (7 * x**5 - 14 * x**6 + 10 * x**7 - 2.5 * x**8) + np.maximum(t - 2, 0)


def expected(number, s):
    sin, cos = np.sin, np.cos
    still = np.zeros_like(s)
    tilt = math.radians(25)
    r = 1.2 * cos(1.65 * s)
    return np.stack(
        {
            1: (-1.0 * cos(0.67 * s), -0.6 * cos(0.67 * s), 1.2 - 0.25 * cos(0.67 * s)),
            2: (cos(s), sin(s), 1.2 + still),
            3: (
                1.2 * cos(1.1 * s) * math.cos(tilt),
                0.8 * sin(1.1 * s),
                1.2 + 1.2 * cos(1.1 * s) * math.sin(tilt),
            ),
            4: (1.2 * sin(0.8 * s), 0.9 * sin(1.6 * s), 1.2 + 0.35 * sin(0.8 * s + 0.7)),
            5: (r * cos(0.55 * s), r * sin(0.55 * s), 1.2 + 0.4 * sin(1.1 * s)),
        }[number],
        axis=1,
    )


each = pytest.mark.parametrize("number", [1, 2, 3, 4, 5])


@each
def test_scored_part_follows_the_formula(number):
    t = np.linspace(0.0, 20.0, 4001)
    np.testing.assert_allclose(
        TEST_TRAJECTORIES[number].position(t), expected(number, path_time(t)), atol=1e-12
    )


@each
def test_twenty_seconds_are_scored_and_two_more_bring_it_to_rest(number):
    assert TEST_TRAJECTORIES[number].scored_s == 20.0
    assert TEST_TRAJECTORIES[number].end_s == 22.0


@each
def test_motion_has_the_same_positions_as_position(number):
    trajectory = TEST_TRAJECTORIES[number]
    np.testing.assert_array_equal(trajectory.motion(T).position_m, trajectory.position(T))


@each
def test_derivatives_agree_with_finite_differences(number):
    trajectory = TEST_TRAJECTORIES[number]
    t = np.arange(-0.5, 22.5, 0.01) + 0.003
    h = 1e-4
    before, at, after = (trajectory.motion(t + d) for d in (-h, 0.0, h))
    velocity = (after.position_m - before.position_m) / (2 * h)
    acceleration = (after.velocity_m_s - before.velocity_m_s) / (2 * h)
    np.testing.assert_allclose(at.velocity_m_s, velocity, atol=1e-6)
    np.testing.assert_allclose(at.acceleration_m_s2, acceleration, atol=1e-5)


@pytest.mark.parametrize(
    ("number", "speed", "acceleration"),
    # The line's 0.56 is 0.6 where one digit is given.
    [(1, 0.8, 0.56), (2, 1.0, 1.1), (3, 1.3, 1.45), (4, 1.7, 2.4), (5, 2.0, 3.65)],
)
def test_top_speed_and_acceleration(number, speed, acceleration):
    motion = TEST_TRAJECTORIES[number].motion(np.arange(0.0, 20.0, 0.005))
    top_speed = np.linalg.norm(motion.velocity_m_s, axis=1).max()
    top_acceleration = np.linalg.norm(motion.acceleration_m_s2, axis=1).max()
    assert top_speed == pytest.approx(speed, rel=0.05)
    assert top_acceleration == pytest.approx(acceleration, rel=0.05)


@each
def test_stopping_needs_no_more_than_one_and_a_half_times_the_acceleration_of_flying(number):
    acceleration = np.linalg.norm(TEST_TRAJECTORIES[number].motion(T).acceleration_m_s2, axis=1)
    assert acceleration[T > 20.0].max() <= 1.5 * acceleration[T <= 20.0].max()


@each
@pytest.mark.parametrize("time", [-3.0, 0.0, 22.0, 30.0])
def test_rests_before_and_after(number, time):
    trajectory = TEST_TRAJECTORIES[number]
    motion = trajectory.motion(np.array([time]))
    end = 0.0 if time <= 0.0 else 22.0
    np.testing.assert_allclose(motion.position_m, trajectory.position(np.array([end])), atol=1e-12)
    np.testing.assert_allclose(motion.velocity_m_s, 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.acceleration_m_s2, 0.0, atol=1e-12)


@each
@pytest.mark.parametrize("time", [0.0, 2.0, 20.0, 22.0])
def test_no_jolt_where_the_ramps_meet(number, time):
    motion = TEST_TRAJECTORIES[number].motion(np.array([time - 1e-7, time + 1e-7]))
    for values in (motion.position_m, motion.velocity_m_s, motion.acceleration_m_s2):
        np.testing.assert_allclose(values[0], values[1], atol=1e-5)


@each
def test_stays_in_a_lab_of_3_by_3_by_2_metres(number):
    position = TEST_TRAJECTORIES[number].position(T)
    assert (np.ptp(position, axis=0) <= (3.0, 3.0, 2.0)).all()
    assert position[:, 2].min() > 0.5
