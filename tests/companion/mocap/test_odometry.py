import math

import pytest

from companion.frames import quaternion_from_euler
from companion.mavlink.codec import Packer, decode
from companion.mavlink.framing import Framer
from companion.mocap.odometry import OdometryMessages
from companion.mocap.pose import Pose


def on_the_wire(pose, resets=0):
    raw = Packer(1).pack(OdometryMessages(0.002, 0.01).message(pose, resets))
    (frame,) = Framer().feed(raw)
    return decode(frame)


def test_it_is_what_both_autopilots_read():
    pose = Pose(12.5, (1.0, 2.0, 3.0), quaternion_from_euler(0.0, 0.0, math.pi / 2))
    message = on_the_wire(pose, resets=3)
    assert message.get_type() == "ODOMETRY"
    assert message.time_usec == 12_500_000
    assert (message.frame_id, message.child_frame_id) == (20, 12)  # LOCAL_FRD, BODY_FRD
    assert message.estimator_type == 2  # VISION: what goes out as MOCAP, PX4's EKF2 does not read
    assert (message.reset_counter, message.quality) == (3, 100)
    assert (message.x, message.y, message.z) == (2.0, 1.0, -3.0)
    # The nose points along y (north): no yaw in NED, w first.
    assert list(message.q) == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-6)


def test_what_was_not_measured_is_nan():
    message = on_the_wire(Pose(1.0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))
    rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
    assert all(map(math.isnan, (message.vx, message.vy, message.vz, *rates)))
    assert all(map(math.isnan, message.velocity_covariance))


def test_the_variances_are_on_the_diagonal_of_the_upper_triangle():
    covariance = on_the_wire(Pose(1.0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))).pose_covariance
    known = {k: v for k, v in enumerate(covariance) if not math.isnan(v)}
    assert known == {
        0: pytest.approx(4e-6),
        6: pytest.approx(4e-6),
        11: pytest.approx(4e-6),
        15: pytest.approx(1e-4),
        18: pytest.approx(1e-4),
        20: pytest.approx(1e-4),
    }


@pytest.mark.parametrize("resets", [0, 127, 128, 255, 256, 1000])
def test_the_reset_counter_goes_round(resets):
    pose = Pose(1.0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    assert on_the_wire(pose, resets).reset_counter == resets % 256
