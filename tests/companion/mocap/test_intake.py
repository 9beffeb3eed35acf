import math

import pytest

from companion.frames import quaternion_from_euler
from companion.mocap.intake import Intake
from companion.mocap.plausible import Plausible
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


def feed(intake, stamps, x=0.0, noise=1e-9, attitude=LEVEL, **state):
    return [
        intake.take(RoomPose(t, (x, 0.0, 1.0 + noise * t), attitude), t + 100.0, **state)
        for t in stamps
    ]


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


@pytest.mark.parametrize("frames_hz", [30, 100, 500])
def test_on_the_ground_poses_that_agree_somewhere_else_for_a_second_are_a_jump(frames_hz):
    intake, period = make(), 1.0 / frames_hz
    feed(intake, every(1.0, 10, period))
    begin = 1.0 + 10 * period
    taken = feed(intake, every(begin, 2 * frames_hz, period), x=3.0)
    assert taken.index(True) * period == pytest.approx(1.0, abs=1.01 * period)
    assert all(taken[taken.index(True) :])
    assert intake.jumps == 1
    assert intake.newest.position_enu_m[0] == 3.0


def test_poses_that_come_back_within_the_second_were_no_jump():
    intake = make()
    feed(intake, every(1.0, 10))
    assert not any(feed(intake, every(1.1, 95), x=3.0))
    assert all(feed(intake, every(2.05, 10), x=0.02))
    assert not any(feed(intake, every(2.15, 95), x=3.0))
    assert intake.jumps == 0


@pytest.mark.parametrize("x", [0.2, 0.5, 2.0, 30.0])
def test_once_armed_no_jump_is_believed_however_long_it_lasts(x):
    intake = make()
    feed(intake, every(1.0, 20))
    # In a second a vehicle could have got to most of these places; but it did not fly there.
    assert not any(feed(intake, every(1.2, 1000), x=x, armed=True))
    assert intake.jumps == 0
    assert intake.newest.position_enu_m[0] == 0.0
    assert f"jumped by {x:.1f} m" in intake.trouble


def test_once_armed_no_turn_in_place_is_believed():
    intake = make()
    feed(intake, every(1.0, 20))
    flipped = quaternion_from_euler(0.0, 0.0, math.pi)
    assert not any(feed(intake, every(1.2, 500), attitude=flipped, armed=True))
    assert "180°" in intake.trouble


def test_false_poses_of_two_places_by_turns_are_not_believed_either():
    intake = make()
    feed(intake, every(1.0, 20))
    for k in range(300):
        x = 1.0 + 0.6 * (k % 2)
        assert feed(intake, [1.2 + 0.01 * k], x=x, armed=True) == [False]


def test_false_poses_after_a_gap_in_them_are_still_not_believed():
    intake = make()
    feed(intake, every(1.0, 20))
    assert not any(feed(intake, every(1.2, 3), x=2.0, armed=True))
    assert not any(feed(intake, every(1.6, 100), x=2.0, armed=True))


def test_the_true_poses_are_believed_again_after_false_ones_in_flight():
    intake = make()
    feed(intake, every(1.0, 20))
    assert not any(feed(intake, every(1.2, 20), x=2.0, armed=True))
    assert all(feed(intake, every(1.4, 20), x=0.3, armed=True))
    assert intake.trouble == ""


def test_a_vehicle_that_hovered_can_not_be_far_away_after_a_gap():
    intake = make()
    feed(intake, every(1.0, 20), armed=True)
    # At its highest speed it could; but it would have to get to that speed first.
    assert not any(feed(intake, every(1.4, 3), x=1.0, armed=True))
    assert all(feed(intake, every(1.43, 3), x=0.3, armed=True))


def test_a_fast_vehicle_is_believed_after_a_gap_and_with_late_stamps():
    intake = make()
    for k in range(20):
        t = 1.0 + 0.01 * k
        assert feed(intake, [t], x=4.0 * 0.01 * k, armed=True) == [True]
    # 0.2 s of frames that were held up, stamped as they came.
    for k in range(20):
        assert feed(intake, [1.4 + 0.001 * k], x=0.8 + 4.0 * 0.01 * k, armed=True) == [True]


@pytest.mark.parametrize("in_air", [False, True])
def test_once_armed_a_pose_that_is_repeated_with_fresh_stamps_is_dropped(in_air):
    intake = make()
    feed(intake, every(1.0, 100))
    assert all(feed(intake, every(2.0, 10), armed=True, in_air=in_air))
    (first, *others) = feed(intake, every(2.1, 50), noise=0.0, armed=True, in_air=in_air)
    assert first
    assert not any(others)
    assert intake.received_s == 102.1
    assert intake.dropped == {"repeated": 49}
    assert "the system repeats it" in intake.trouble
    # The last bit of one number is enough.
    assert feed(intake, [2.6], x=5e-324, noise=0.0, armed=True, in_air=in_air) == [True]
    assert intake.trouble == ""


def test_a_source_without_noise_may_repeat_itself_while_the_vehicle_stands():
    intake = make()
    assert all(feed(intake, every(1.0, 100), noise=0.0))
    assert all(feed(intake, every(2.0, 500), noise=0.0, armed=True))
    assert not any(feed(intake, every(7.0, 10), noise=0.0, armed=True, in_air=True))


def test_a_source_with_noise_is_not_taken_for_one_without_after_it_was_covered():
    intake = make()
    feed(intake, every(1.0, 100), noise=0.0)
    feed(intake, every(2.0, 100))
    feed(intake, every(3.0, 1), noise=0.0, armed=True)
    assert not any(feed(intake, every(3.01, 10), noise=0.0, armed=True))


def test_poses_that_do_not_agree_are_no_jump():
    intake = make()
    feed(intake, every(1.0, 10))
    for k in range(300):
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
