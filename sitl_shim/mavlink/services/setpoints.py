"""Position, velocity and acceleration setpoints, local and global.

https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_LOCAL_NED
"""

import math
from collections.abc import Callable, Mapping

from sitl_shim.autopilot.interface import PositionSetpoint
from sitl_shim.frames import Vector3, swap_enu_ned
from sitl_shim.mavlink.geodesy import local_position
from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.wire import Message

_LOCAL_NED, _LOCAL_OFFSET, _BODY_NED, _BODY_OFFSET = 1, 7, 8, 9
_GLOBAL, _RELATIVE, _GLOBAL_INT, _RELATIVE_INT = 0, 3, 5, 6
_BODY_FRAMES = (_BODY_NED, _BODY_OFFSET)
_OFFSET_FRAMES = (_LOCAL_OFFSET, _BODY_OFFSET)
_FORCE = 0x200
_YAW_IGNORE, _YAW_RATE_IGNORE = 0x400, 0x800
_POSITION_SHIFT, _VELOCITY_SHIFT, _ACCELERATION_SHIFT = 0, 3, 6


class PositionSetpoints:
    """Takes setpoints for the autopilot.

    Args:
        context: of the vehicle.
    """

    def __init__(self, context: Context) -> None:
        self._context = context

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        return {
            "SET_POSITION_TARGET_LOCAL_NED": self._local,
            "SET_POSITION_TARGET_GLOBAL_INT": self._global,
        }

    def _local(self, link: int, message: Message) -> None:
        frame = message.coordinate_frame
        known = frame in (_LOCAL_NED, *_OFFSET_FRAMES, *_BODY_FRAMES)
        if not known or message.type_mask & _FORCE or not self._concerns(message):
            return
        mask = message.type_mask
        position = _masked((message.x, message.y, message.z), mask, _POSITION_SHIFT)
        if frame == _BODY_NED:  # velocities and accelerations alone turn with the heading
            position = (math.nan, math.nan, math.nan)
        turn_rad = self._heading_rad() if frame in _BODY_FRAMES else 0.0
        position = _turned(position, turn_rad)
        if frame in _OFFSET_FRAMES:
            north, east, down = swap_enu_ned(self._context.sim.estimate.position_enu_m)
            position = (position[0] + north, position[1] + east, position[2] + down)
        self._take(message, position, turn_rad)

    def _global(self, link: int, message: Message) -> None:
        frame = message.coordinate_frame
        known = frame in (_GLOBAL, _GLOBAL_INT, _RELATIVE, _RELATIVE_INT)
        if not known or message.type_mask & _FORCE or not self._concerns(message):
            return
        sim = self._context.sim
        latitude_deg, longitude_deg = message.lat_int * 1e-7, message.lon_int * 1e-7
        east, north = local_position(sim.origin, latitude_deg, longitude_deg)
        if frame in (_GLOBAL, _GLOBAL_INT):
            up = message.alt - sim.origin.altitude_amsl_m
        else:
            home = sim.autopilot.home_enu_m or (0.0, 0.0, 0.0)
            up = message.alt + home[2]
        position = _masked((north, east, -up), message.type_mask, _POSITION_SHIFT)
        self._take(message, position, 0.0)

    def _concerns(self, message: Message) -> bool:
        return self._context.concerns(message, any_system=True)

    def _heading_rad(self) -> float:
        """Where the nose points, from north to the east."""
        w, x, y, z = self._context.sim.estimate.attitude_flu_to_enu
        yaw_enu_rad = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return math.pi / 2.0 - yaw_enu_rad

    def _take(self, message: Message, position_ned_m: Vector3, turn_rad: float) -> None:
        mask = message.type_mask
        velocity = _masked((message.vx, message.vy, message.vz), mask, _VELOCITY_SHIFT)
        acceleration = _masked((message.afx, message.afy, message.afz), mask, _ACCELERATION_SHIFT)
        yaw_rad = math.nan if mask & _YAW_IGNORE else message.yaw + turn_rad
        yaw_rate = math.nan if mask & _YAW_RATE_IGNORE else -message.yaw_rate
        self._context.sim.autopilot.receive_position_setpoint(
            PositionSetpoint(
                swap_enu_ned(position_ned_m),
                swap_enu_ned(_turned(velocity, turn_rad)),
                swap_enu_ned(_turned(acceleration, turn_rad)),
                math.pi / 2.0 - yaw_rad,
                yaw_rate,
            )
        )


def _masked(vector: Vector3, mask: int, shift: int) -> Vector3:
    """The vector with NaN where the mask says to ignore, or where it is not finite."""
    x, y, z = (
        math.nan if mask >> (shift + axis) & 1 or not math.isfinite(value) else value
        for axis, value in enumerate(vector)
    )
    return (x, y, z)


def _turned(vector_ned: Vector3, heading_rad: float) -> Vector3:
    """A vector given along the nose, in NED."""
    if heading_rad == 0.0:
        return vector_ned
    x, y, z = vector_ned
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    return (cosine * x - sine * y, sine * x + cosine * y, z)
