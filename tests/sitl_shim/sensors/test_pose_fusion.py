import math
from dataclasses import replace

import pytest

from sitl_shim.frames import quaternion_from_euler
from sitl_shim.sensors.aiding import Aiding, ExternalPose
from sitl_shim.sensors.pose_fusion import PoseFusion

STEP_S = 0.004
ALL = Aiding(gnss=False, pose_horizontal=True, pose_height=True, pose_yaw=True)


class Still:
    """A vehicle that hovers at a point, and whose acceleration is measured with an error."""

    def __init__(self, aiding=ALL, error=(0.0, 0.0, 0.0), at=(1.0, 2.0, 3.0), yaw=0.0):
        self.fusion = PoseFusion()
        self.aiding, self.error, self.at, self.yaw = aiding, error, at, yaw
        self.heading = 0.0
        self.ticks = 0
        self.resets = 0

    @property
    def now_s(self):
        return self.ticks * STEP_S

    def run(self, duration_s, pose_hz=50.0, delay_s=0.0, **changes):
        every = round(1.0 / pose_hz / STEP_S) if pose_hz else 0
        for _ in range(round(duration_s / STEP_S)):
            self.ticks += 1
            self.fusion.predict(self.now_s, STEP_S, self.error, self.heading)
            if every and self.ticks % every == 0:
                fields = {
                    "time_s": self.now_s - delay_s,
                    "position_enu_m": self.at,
                    "attitude_flu_to_enu": quaternion_from_euler(0.0, 0.0, self.yaw),
                    "reset_counter": self.resets,
                } | changes
                self.fusion.take(ExternalPose(**fields), self.aiding, self.now_s)
        return self.fusion

    def off_m(self):
        return math.dist(self.fusion.position, self.at)


def test_it_starts_at_the_pose_and_stays_there():
    still = Still(yaw=0.7)
    fusion = still.run(1.0)
    assert still.off_m() < 1e-6
    assert fusion.yaw_correction_rad == pytest.approx(0.7)
    assert fusion.valid(still.now_s, 5.0)


def test_one_pose_alone_starts_nothing():
    still = Still()
    still.run(0.02)
    assert not still.fusion.started


def test_poses_that_come_too_seldom_start_nothing():
    still = Still()
    still.run(5.0, pose_hz=4.0)
    assert not still.fusion.started
    assert not still.fusion.valid(still.now_s, 5.0)


def test_a_steady_error_of_the_acceleration_is_learnt():
    still = Still(error=(0.2, -0.1, 0.05))
    still.run(2.0)
    early = still.off_m()
    still.run(20.0)
    assert early > 0.01
    assert still.off_m() < 0.002


def test_without_poses_it_drifts_and_after_a_while_it_is_lost():
    still = Still(error=(0.02, 0.0, 0.0))
    still.run(1.0)
    still.run(3.0, pose_hz=0)
    assert not still.fusion.fusing
    assert still.fusion.valid(still.now_s, 5.0)
    drift = still.off_m()
    assert 0.02 < drift < 0.2
    still.run(2.5, pose_hz=0)
    assert still.off_m() > 2.0 * drift
    assert not still.fusion.valid(still.now_s, 5.0)


def test_when_poses_come_back_it_starts_there_again():
    still = Still(error=(0.1, 0.0, 0.0))
    still.run(1.0)
    still.run(10.0, pose_hz=0)
    assert still.off_m() > 1.0
    still.run(1.0)
    assert still.off_m() < 0.05
    assert still.fusion.valid(still.now_s, 5.0)


def test_late_poses_of_a_moving_vehicle_do_not_pull_it_back():
    def fly(delay_s, told):
        fusion = PoseFusion()
        fusion.begin((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0, valid=True)
        aiding = Aiding(
            gnss=False, pose_horizontal=True, pose_delay_s=0.0 if told else delay_s, pose_yaw=True
        )
        for k in range(1, 1501):
            now_s = k * STEP_S
            fusion.predict(now_s, STEP_S, (0.0, 0.0, 0.0), 0.0)
            if k % 5 == 0:
                position = (now_s - delay_s, 0.0, 0.0)
                stamp = now_s - delay_s if told else now_s
                pose = ExternalPose(stamp, position, (1.0, 0.0, 0.0, 0.0))
                fusion.take(pose, aiding, now_s)
        return fusion.position[0] - now_s

    assert abs(fly(0.06, told=True)) < 0.005
    assert abs(fly(0.06, told=False)) < 0.005  # EKF2_EV_DELAY says it instead
    assert abs(fly(0.06, told=True) - fly(0.0, told=True)) < 0.005


def test_a_pose_older_than_what_is_remembered_is_dropped():
    still = Still()
    still.run(1.0)
    before = still.fusion.position
    pose = ExternalPose(still.now_s - 0.5, (9.0, 9.0, 9.0), (1.0, 0.0, 0.0, 0.0))
    still.fusion.take(pose, ALL, still.now_s)
    assert still.fusion.position == before


def test_a_jump_without_a_word_is_rejected_for_a_second_and_then_believed():
    still = Still()
    still.run(1.0)
    still.at = (4.0, 2.0, 3.0)
    still.run(0.9)
    assert still.fusion.position[0] == pytest.approx(1.0, abs=1e-3)
    still.run(0.3)
    assert still.fusion.position[0] == pytest.approx(4.0, abs=0.05)


def test_a_jump_with_the_reset_counter_is_followed_at_once():
    still = Still()
    still.run(1.0)
    still.at, still.resets = (4.0, 2.0, 3.0), 1
    resets = still.fusion.resets
    still.run(0.04)
    assert still.off_m() < 1e-3
    assert still.fusion.resets == resets + 1


def test_poses_of_too_low_a_quality_are_dropped():
    still = Still(aiding=Aiding(gnss=False, pose_horizontal=True, least_quality=50))
    still.run(1.0, quality=20)
    assert not still.fusion.started
    still.run(1.0, quality=60)
    assert still.fusion.started


def test_a_pose_that_says_it_is_bad_counts_for_less():
    def settle(variance):
        still = Still()
        still.run(1.0, position_variance_m2=variance)
        still.at = (1.2, 2.0, 3.0)
        still.run(0.2, position_variance_m2=variance)
        return still.fusion.position[0] - 1.0

    assert 0.0 < settle(0.25) < 0.6 * settle(1e-6)


def test_without_the_poses_yaw_the_room_is_turned_to_ours():
    aiding = Aiding(gnss=False, pose_horizontal=True, pose_yaw=False)
    still = Still(aiding=aiding, at=(1.0, 0.0, 0.0), yaw=math.pi / 2)
    still.run(1.0)
    # The pose's nose points along the room's y, ours along our x: the room is turned by -90 deg.
    assert still.fusion.position == pytest.approx((0.0, -1.0, 0.0), abs=1e-6)


def test_yaw_follows_slowly_as_the_gyro_is_trusted():
    still = Still()
    still.run(1.0)
    still.yaw = 0.2
    still.run(1.0)
    assert 0.0 < still.fusion.yaw_correction_rad < 0.1
    still.run(60.0)
    assert still.fusion.yaw_correction_rad == pytest.approx(0.2, abs=0.01)


def test_a_pose_a_thousand_kilometres_away_is_none():
    still = Still()
    still.run(1.0)
    still.resets = 1
    still.run(2.0, position_enu_m=(1.1e6, 2.0, 3.0))
    assert still.off_m() < 1e-6
    still.run(2.0, position_enu_m=(9.9e5, 2.0, 3.0))
    assert still.fusion.position[0] == pytest.approx(9.9e5)


@pytest.mark.parametrize("least_noise_m", [0.01, 0.05])
def test_a_pose_far_away_does_not_make_it_fast(least_noise_m):
    still = Still(replace(ALL, least_position_noise_m=least_noise_m))
    still.run(1.0)
    still.run(3.0, pose_hz=0)
    still.at = (9e5, -9e5, 9e5)
    still.run(0.04, pose_hz=250)
    still.at = (-9e5, 9e5, 0.0)
    still.run(3.0, pose_hz=250)
    assert max(map(abs, still.fusion.velocity)) <= 100.0
    assert max(map(abs, still.fusion.position)) <= 1e6


def test_a_height_that_is_not_asked_for_neither_counts_nor_hinders():
    still = Still(replace(ALL, pose_height=False), error=(0.1, -0.1, 0.0), at=(1.0, 2.0, 0.0))
    still.run(1.0)
    resets = still.fusion.resets
    still.run(15.0, position_enu_m=(1.0, 2.0, 3.0))
    assert still.off_m() < 0.01
    assert still.fusion.position[2] == 0.0
    assert still.fusion.resets == resets


def test_a_rejected_height_does_not_hinder_the_horizontal_position():
    still = Still(error=(0.1, -0.1, 0.0))
    still.run(1.0)
    still.run(0.9, position_enu_m=(1.0, 2.0, 9.0))
    assert math.dist(still.fusion.position[:2], still.at[:2]) < 0.05
    assert still.fusion.position[2] == pytest.approx(3.0, abs=1e-3)
    still.run(0.3, position_enu_m=(1.0, 2.0, 9.0))
    assert still.fusion.position[2] == pytest.approx(9.0, abs=0.05)


def test_a_rejected_horizontal_position_does_not_hinder_the_height():
    still = Still(error=(0.0, 0.0, 0.1))
    still.run(1.0)
    still.run(0.9, position_enu_m=(9.0, 2.0, 3.0))
    assert still.fusion.position == pytest.approx((1.0, 2.0, 3.0), abs=0.05)


@pytest.mark.parametrize("least_noise_m", [0.01, 0.03, 0.1])
@pytest.mark.parametrize("delay_s", [0.0, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("pose_hz", [25.0, 50.0, 125.0])
def test_it_is_stable_however_late_poses_come(least_noise_m, delay_s, pose_hz):
    still = Still(replace(ALL, least_position_noise_m=least_noise_m), error=(0.2, -0.1, 0.05))
    still.run(10.0, pose_hz=pose_hz, delay_s=delay_s)
    still.at = (1.0 + 2.0 * least_noise_m, 2.0, 3.0)
    still.run(10.0, pose_hz=pose_hz, delay_s=delay_s)
    assert still.off_m() < 0.01
    assert math.hypot(*still.fusion.velocity) < 0.02
