"""Poses of the vehicle from outside: ODOMETRY, as PX4 reads it.

https://mavlink.io/en/messages/common.html#ODOMETRY,
https://docs.px4.io/main/en/ros/external_position_estimation.html.  What PX4 does with the fields:

* frame_id LOCAL_NED and LOCAL_ENU point north, LOCAL_FRD and LOCAL_FLU need not; of any other the
  position is dropped.
* q turns the body (FRD) into the world's NED or FRD axes, whatever frame_id says.
* estimator_type VISION, VIO, NAIVE and UNKNOWN go to the estimator; MOCAP goes to another topic,
  which the estimator does not read; anything else is refused with a text, which this leaves out.
* The covariance counts unless the type is NAIVE.
"""

from collections.abc import Callable, Mapping
from math import isfinite, nan

from sitl_shim.frames import (
    Vector3,
    attitude_from_wire,
    quaternion_normalise,
    swap_enu_ned,
)
from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.timesync import Timesync
from sitl_shim.mavlink.wire import Message
from sitl_shim.sensors.aiding import ExternalPose

_LOCAL_NED, _LOCAL_ENU, _LOCAL_FRD, _LOCAL_FLU = 1, 4, 20, 21
_UNKNOWN, _NAIVE, _VISION, _VIO = 0, 1, 2, 3
_X, _Y, _Z, _YAW = 0, 6, 11, 20
"""Places of the diagonal in the upper triangle, row by row."""


class ExternalPoses:
    """Hands poses to the estimator, with the time of the boot clock.

    Args:
        context: of the vehicle.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self._clocks = [Timesync() for _ in context.links]

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        return {"ODOMETRY": self._odometry}

    def timesync_answer(self, link: int, message: Message) -> None:
        """A client's answer to TIMESYNC, by which its time stamps will be read."""
        now_us = self._context.sim.stamp_us
        self._clocks[link].answer(message.ts1 // 1000, message.tc1 * 1e-3, now_us)

    def _odometry(self, link: int, message: Message) -> None:
        if message.estimator_type not in (_UNKNOWN, _NAIVE, _VISION, _VIO):
            return
        position = _position_enu(message.frame_id, (message.x, message.y, message.z))
        try:
            attitude = attitude_from_wire(quaternion_normalise(tuple(message.q)))
        except ValueError:
            return
        if position is None:
            return
        sim = self._context.sim
        stamp_us = self._clocks[link].boot_time_us(message.time_usec, sim.stamp_us)
        covariance = [nan] * 21 if message.estimator_type == _NAIVE else message.pose_covariance
        variances = [covariance[place] for place in (_X, _Y, _Z) if isfinite(covariance[place])]
        sim.receive_pose(
            ExternalPose(
                time_s=(stamp_us - sim.stamp_us + sim.elapsed_us) * 1e-6,
                position_enu_m=position,
                attitude_flu_to_enu=attitude,
                heading_is_arbitrary=message.frame_id in (_LOCAL_FRD, _LOCAL_FLU),
                position_variance_m2=max(variances, default=nan),
                yaw_variance_rad2=covariance[_YAW],
                reset_counter=message.reset_counter,
                quality=message.quality,
            )
        )


def _position_enu(frame: int, xyz: Vector3) -> Vector3 | None:
    """The position as NED or level FRD, turned to ENU as if forward were north."""
    if not all(map(isfinite, xyz)):
        return None
    x, y, z = xyz
    if frame in (_LOCAL_NED, _LOCAL_FRD):
        return swap_enu_ned(xyz)
    if frame == _LOCAL_ENU:
        return xyz
    if frame == _LOCAL_FLU:
        return swap_enu_ned((x, -y, -z))
    return None
