import math
from types import SimpleNamespace

import pytest
from pymavlink.dialects.v20 import all as dialect

from sitl_shim.mavlink.services.external_pose import ExternalPoses

NAN = math.nan


class Listener:
    """In place of a simulation: keeps the poses that would go to the estimator."""

    elapsed_us = stamp_us = 3_000_000

    def __init__(self):
        self.poses = []

    def receive_pose(self, pose):
        self.poses.append(pose)


@pytest.fixture
def listener():
    return Listener()


def odometry(**changes):
    fields = {
        "time_usec": 42,
        "frame_id": 20,
        "child_frame_id": 12,
        "x": 1.0,
        "y": 2.0,
        "z": -3.0,
        "q": [1.0, 0.0, 0.0, 0.0],
        "vx": NAN,
        "vy": NAN,
        "vz": NAN,
        "rollspeed": NAN,
        "pitchspeed": NAN,
        "yawspeed": NAN,
        "pose_covariance": [NAN] * 21,
        "velocity_covariance": [NAN] * 21,
        "reset_counter": 7,
        "estimator_type": 2,
        "quality": 90,
    }
    return dialect.MAVLink_odometry_message(**(fields | changes))


def handle(listener, message):
    service = ExternalPoses(SimpleNamespace(sim=listener, links=[None]))
    service.handlers["ODOMETRY"](0, message)
    return listener.poses


def test_a_pose_goes_to_the_estimator_in_its_own_frames(listener):
    (pose,) = handle(listener, odometry())
    assert pose.position_enu_m == (2.0, 1.0, 3.0)
    # No yaw in NED: the nose points north, along y in ENU.
    assert pose.attitude_flu_to_enu == pytest.approx((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
    assert pose.heading_is_arbitrary
    assert (pose.reset_counter, pose.quality) == (7, 90)
    assert pose.time_s == 3.0  # not the stamp's: the clocks are not synchronised yet


@pytest.mark.parametrize(
    ("frame", "xyz", "arbitrary"),
    [
        (1, (1.0, 2.0, -3.0), False),
        (4, (2.0, 1.0, 3.0), False),
        (20, (1.0, 2.0, -3.0), True),
        (21, (1.0, -2.0, 3.0), True),
    ],
)
def test_each_frame_means_the_same_place(listener, frame, xyz, arbitrary):
    x, y, z = xyz
    (pose,) = handle(listener, odometry(frame_id=frame, x=x, y=y, z=z))
    assert pose.position_enu_m == (2.0, 1.0, 3.0)
    assert pose.heading_is_arbitrary is arbitrary


@pytest.mark.parametrize("kind", [5, 4, 8])  # MOCAP goes elsewhere; GPS and AUTOPILOT nowhere
def test_estimators_that_px4s_does_not_read(listener, kind):
    assert handle(listener, odometry(estimator_type=kind)) == []


@pytest.mark.parametrize(
    "changes", [{"x": NAN}, {"q": [NAN] * 4}, {"q": [0.0] * 4}, {"frame_id": 8}]
)
def test_what_says_no_pose_is_dropped(listener, changes):
    assert handle(listener, odometry(**changes)) == []


def test_the_covariance_counts_unless_the_estimate_is_naive(listener):
    covariance = [NAN] * 21
    covariance[0], covariance[6], covariance[11], covariance[20] = 0.01, 0.04, 0.02, 0.5
    handle(listener, odometry(pose_covariance=covariance))
    handle(listener, odometry(pose_covariance=covariance, estimator_type=1))
    told, naive = listener.poses
    assert told.position_variance_m2 == pytest.approx(0.04)
    assert told.yaw_variance_rad2 == pytest.approx(0.5)
    assert math.isnan(naive.position_variance_m2)
