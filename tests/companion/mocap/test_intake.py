import math

import pytest

from companion.frames import quaternion_from_euler
from companion.mocap.intake import Intake, Plausible
from companion.mocap.pose import RoomAxes, RoomPose
from companion.mocap.sender_clock import SenderClock

LEVEL = (1.0, 0.0, 0.0, 0.0)


def make(latency_s=0.0):
    return Intake(
        RoomAxes(y_up=False, room_yaw_rad=0.0, body_yaw_rad=0.0),
        Plausible(speed_m_s=5.0, rate_rad_s=10.0),
        latency_s=latency_s,
        timeout_s=0.3,
    )


def feed(intake, stamps, x=0.0, offset=100.0, attitude=LEVEL):
    return [intake.take(RoomPose(t, (x, 0.0, 1.0), attitude), t + offset) for t in stamps]


def every(start, count, period=0.01):
    return [start + k * period for k in range(count)]


def test_poses_in_order_are_taken():
    intake = make()
    assert all(feed(intake, every(1.0, 10)))
    assert intake.taken == 10
    assert not intake.dropped
    assert intake.newest.captured_s == pytest.approx(101.09, abs=1e-4)


def test_a_pose_that_was_overtaken_or_repeated_is_dropped():
    intake = make()
    feed(intake, [1.0, 1.02])
    newest = intake.newest
    assert feed(intake, [1.01]) == [False]
    assert feed(intake, [1.02]) == [False]
    assert intake.newest is newest
    assert intake.dropped == {"out of order": 2}


def test_a_clock_that_was_set_back_is_followed_after_a_few_poses():
    intake = make()
    feed(intake, every(1000.0, 5))
    taken = [
        intake.take(RoomPose(t, (0.0, 0.0, 1.0), LEVEL), 1200.0 + t) for t in every(0.0, 8, 0.01)
    ]
    assert taken == [False] * 4 + [True] * 4
    assert intake.newest.captured_s == pytest.approx(1200.07, abs=1e-3)


def test_a_pose_that_took_too_long_is_dropped():
    intake = make()
    feed(intake, every(1.0, 20))
    assert not intake.take(RoomPose(1.5, (0.0, 0.0, 1.0), LEVEL), 101.5 + 0.4)
    assert intake.dropped == {"stale": 1}


def test_jitter_is_taken_out_of_the_time_and_the_latency_is_put_in():
    intake = make(latency_s=0.02)
    for k in range(50):
        late = 0.005 * (k % 3)
        intake.take(RoomPose(0.01 * k, (0.0, 0.0, 1.0), LEVEL), 50.0 + 0.01 * k + late)
    assert intake.newest.captured_s == pytest.approx(50.0 + 0.49 - 0.02, abs=2e-4)


def test_a_swapped_body_is_dropped_and_the_flight_goes_on():
    intake = make()
    feed(intake, every(1.0, 10))
    assert feed(intake, [1.10, 1.11], x=3.0) == [False, False]
    assert feed(intake, [1.12], x=0.02) == [True]
    assert intake.jumps == 0
    assert intake.dropped == {"too far away": 2}


def test_poses_that_agree_somewhere_else_are_a_jump():
    intake = make()
    feed(intake, every(1.0, 10))
    assert feed(intake, every(1.1, 6), x=3.0) == [False] * 4 + [True] * 2
    assert intake.jumps == 1
    assert intake.newest.position_enu_m[0] == 3.0


def test_poses_that_do_not_agree_are_no_jump():
    intake = make()
    feed(intake, every(1.0, 10))
    for k in range(20):
        assert feed(intake, [1.1 + 0.01 * k], x=3.0 + 2.0 * (k % 2)) == [False]
    assert intake.jumps == 0


def test_a_flipped_attitude_is_too_far_away():
    intake = make()
    feed(intake, every(1.0, 10))
    flipped = quaternion_from_euler(0.0, 0.0, math.pi)
    assert feed(intake, [1.1], attitude=flipped) == [False]


def test_the_sign_of_a_quaternion_means_nothing():
    intake = make()
    feed(intake, every(1.0, 10))
    assert feed(intake, [1.1], attitude=(-1.0, 0.0, 0.0, 0.0)) == [True]


def test_a_vehicle_may_have_moved_while_it_was_not_seen():
    intake = make()
    feed(intake, every(1.0, 10))
    assert feed(intake, [2.1], x=4.0) == [True]
    assert intake.jumps == 0


def test_a_slow_drift_between_the_clocks_is_followed():
    clock = SenderClock()
    for k in range(100_000):
        received = 0.01 * k
        ours = clock.ours(received * (1.0 - 1e-4), received)
    assert ours == pytest.approx(received, abs=1e-3)
