"""ODOMETRY (331) that carries a pose to the autopilot's estimator.

https://mavlink.io/en/messages/common.html#ODOMETRY.  What the autopilots read of it:

* PX4 (docs.px4.io/main/en/ros/external_position_estimation.html) takes MAV_FRAME_LOCAL_FRD for
  level axes that need not point north, and ArduPilot takes no other pair of frames than LOCAL_FRD
  with BODY_FRD.
* PX4's estimator reads the type VISION.  What is sent as MOCAP goes to another topic of PX4's,
  which its EKF2 does not read.
* The time stamp is of the clock by which we answer the autopilot's TIMESYNC questions, and is
  turned into the autopilot's by the autopilot.
"""

import math
import struct

from companion.frames import attitude_to_wire, swap_enu_ned
from companion.mavlink.messages import MessageId, Outgoing
from companion.mocap.pose import Pose

_WIRE = struct.Struct("<Q3f4f3f3f21f21f5b")
_FRAME_LOCAL_FRD, _FRAME_BODY_FRD = 20, 12
_ESTIMATOR_VISION = 2
_GOOD = 100
"""Percent."""
_UNKNOWN = math.nan
_NOT_MEASURED = (_UNKNOWN,) * 6
_VELOCITY_COVARIANCE = (_UNKNOWN,) * 21
_POSITION_PLACES, _ATTITUDE_PLACES = (0, 6, 11), (15, 18, 20)
"""Of the diagonal in the upper triangle of 6 x 6, row by row."""


class OdometryMessages:
    """Makes the messages of one stream of poses.

    Args:
        position_sigma_m: standard deviation of each coordinate.
        attitude_sigma_rad: standard deviation of each angle.
    """

    def __init__(self, position_sigma_m: float, attitude_sigma_rad: float) -> None:
        covariance = [_UNKNOWN] * 21
        for place in _POSITION_PLACES:
            covariance[place] = position_sigma_m**2
        for place in _ATTITUDE_PLACES:
            covariance[place] = attitude_sigma_rad**2
        self._covariance = tuple(covariance)

    def message(self, pose: Pose, reset_counter: int) -> Outgoing:
        """The message of a pose.

        Args:
            pose: of the vehicle.
            reset_counter: grows with every jump of the poses.
        """
        return Outgoing(
            MessageId.ODOMETRY,
            _WIRE.pack(
                max(0, round(pose.captured_s * 1e6)),
                *swap_enu_ned(pose.position_enu_m),
                *attitude_to_wire(pose.attitude_flu_to_enu),
                *_NOT_MEASURED,
                *self._covariance,
                *_VELOCITY_COVARIANCE,
                _FRAME_LOCAL_FRD,
                _FRAME_BODY_FRD,
                ((reset_counter + 128) & 0xFF) - 128,
                _ESTIMATOR_VISION,
                _GOOD,
            ),
        )
