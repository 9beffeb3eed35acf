"""Position, velocity and acceleration setpoints of the offboard stream, for position control."""

import math

from sitl_shim.autopilot.interface import Motion, PositionSetpoint
from sitl_shim.autopilot.px4.position_control import TrajectorySetpoint
from sitl_shim.autopilot.thrust_axis import heading_of
from sitl_shim.frames import Vector3


def trajectory_setpoint(setpoint: PositionSetpoint, motion: Motion) -> TrajectorySetpoint | None:
    """The setpoint as position control takes it, without any smoothing.

    Args:
        setpoint: what came in; NaN where it says nothing.
        motion: the estimate, whose heading is kept where none is asked for.

    Returns:
        None if an axis has neither position, velocity nor acceleration: PX4 then takes the
        setpoint for invalid and descends.
    """
    x, y, z = setpoint.position_enu_m
    vx, vy, vz = setpoint.velocity_enu_m_s
    ax, ay, az = setpoint.acceleration_enu_m_s2
    has_xy = math.isfinite(x) and math.isfinite(y)
    has_vxy = math.isfinite(vx) and math.isfinite(vy)
    has_axy = math.isfinite(ax) and math.isfinite(ay)
    has_z, has_vz, has_az = math.isfinite(z), math.isfinite(vz), math.isfinite(az)
    if not ((has_xy or has_vxy or has_axy) and (has_z or has_vz or has_az)):
        return None
    yaw, yaw_rate = setpoint.yaw_enu_rad, setpoint.yaw_rate_rad_s
    return TrajectorySetpoint(
        (x, y) if has_xy else None,
        (vx, vy) if has_vxy else None,
        z if has_z else None,
        vz if has_vz else None,
        yaw if math.isfinite(yaw) else heading_of(motion.attitude_flu_to_enu),
        yaw_rate if math.isfinite(yaw_rate) else 0.0,
        _acceleration((ax, ay, az), horizontal=has_axy, vertical=has_az),
    )


def wants_takeoff(setpoint: PositionSetpoint, motion: Motion) -> bool:
    """Whether a vehicle on the ground is to leave it: the first finite vertical part decides."""
    z, vz = setpoint.position_enu_m[2], setpoint.velocity_enu_m_s[2]
    if math.isfinite(z):
        return z > motion.position_enu_m[2]
    if math.isfinite(vz):
        return vz > 0.0
    return setpoint.acceleration_enu_m_s2[2] > 0.0


def _acceleration(value: Vector3, *, horizontal: bool, vertical: bool) -> Vector3:
    x, y, z = value
    return (x if horizontal else 0.0, y if horizontal else 0.0, z if vertical else 0.0)
