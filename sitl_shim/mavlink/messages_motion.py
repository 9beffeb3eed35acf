"""Messages about how the vehicle moves and is made to move, from the autopilot's estimate.

Field meanings: https://mavlink.io/en/messages/common.html.  World NED, body FRD on the wire.
"""

import math
import struct

from sitl_shim.frames import (
    Vector3,
    attitude_to_wire,
    euler_from_quaternion,
    rotate_inverse,
    swap_enu_ned,
    swap_flu_frd,
)
from sitl_shim.mavlink.geodesy import global_position
from sitl_shim.mavlink.integers import int16, int32, uint16
from sitl_shim.mavlink.packets import Layout, Packet
from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import Simulation

_ATTITUDE = Layout(dialect.MAVLink_attitude_message)
_ATTITUDE_QUATERNION = Layout(dialect.MAVLink_attitude_quaternion_message, "<I7f16s")
_LOCAL_POSITION = Layout(dialect.MAVLink_local_position_ned_message)
_GLOBAL_POSITION = Layout(dialect.MAVLink_global_position_int_message)
_ALTITUDE = Layout(dialect.MAVLink_altitude_message)
_ATTITUDE_TARGET = Layout(dialect.MAVLink_attitude_target_message)
_POSITION_TARGET = Layout(dialect.MAVLink_position_target_local_ned_message)
_VFR_HUD = Layout(dialect.MAVLink_vfr_hud_message)
_GPS_RAW = Layout(dialect.MAVLink_gps_raw_int_message)
_SERVO_OUTPUT = Layout(dialect.MAVLink_servo_output_raw_message, "<I4H25s")
"""Of its sixteen servos four have something to say."""
_HIGHRES_IMU = Layout(dialect.MAVLink_highres_imu_message)
ODOMETRY = Layout(dialect.MAVLink_odometry_message, "<Q13f168s5B")
"""Its two covariances, 42 numbers, never change and stand as one."""

_NAN = math.nan
_GRAVITY_M_S2 = 9.80665
_FRAME_LOCAL_NED = 1
_PX4_OFFBOARD = 0x00060000
_ESTIMATOR_AUTOPILOT = 8
_NO_ROTATION = bytes(16)
"""The four last numbers of ATTITUDE_QUATERNION."""
_POSE_COVARIANCE = [_NAN] * 21
for _place, _variance in {0: 1e-4, 6: 1e-4, 11: 1e-4, 15: 1e-4, 18: 1e-4, 20: 1e-3}.items():
    _POSE_COVARIANCE[_place] = _variance  # the diagonal; PX4 leaves the rest NaN
_VELOCITY_COVARIANCE = [_NAN] * 21
for _place in (0, 6, 11):
    _VELOCITY_COVARIANCE[_place] = 1e-3
_COVARIANCES = struct.pack("<42f", *_POSE_COVARIANCE, *_VELOCITY_COVARIANCE)
_FIELD_NED_GAUSS: Vector3 = (0.2163, 0.0103, 0.4304)
"""Earth's magnetic field at the origin."""
_SERVO_LOW = 900
_SERVOS_UNUSED = struct.pack("<4HB8H", *[_SERVO_LOW] * 4, 0, *[_SERVO_LOW] * 8)
"""Servos 5 to 8, the port, servos 9 to 16."""
_TYPE_MASK_NOTHING = 63
_TYPE_MASK_NO_POSITION = 7


def attitude(sim: Simulation) -> Packet:
    """ATTITUDE (30)."""
    estimate = sim.estimate
    roll, pitch, yaw = euler_from_quaternion(attitude_to_wire(estimate.attitude_flu_to_enu))
    p, q, r = swap_flu_frd(estimate.rate_flu_rad_s)
    return Packet(_ATTITUDE, _ATTITUDE.pack(sim.estimate_ms, roll, pitch, yaw, p, q, r))


def attitude_quaternion(sim: Simulation) -> Packet:
    """ATTITUDE_QUATERNION (31)."""
    estimate = sim.estimate
    w, x, y, z = attitude_to_wire(estimate.attitude_flu_to_enu)
    p, q, r = swap_flu_frd(estimate.rate_flu_rad_s)
    content = _ATTITUDE_QUATERNION.pack(sim.estimate_ms, w, x, y, z, p, q, r, _NO_ROTATION)
    return Packet(_ATTITUDE_QUATERNION, content)


def local_position_ned(sim: Simulation) -> Packet | None:
    """LOCAL_POSITION_NED (32); None while the estimator has no local position.

    ODOMETRY, by PX4's source, goes on all the same, with what is reckoned from the accelerations.
    """
    if not sim.estimate.local_position_valid:
        return None
    x, y, z = swap_enu_ned(sim.estimate.position_enu_m)
    vx, vy, vz = swap_enu_ned(sim.estimate.velocity_enu_m_s)
    content = _LOCAL_POSITION.pack(sim.estimate_ms, x, y, z, vx, vy, vz)
    return Packet(_LOCAL_POSITION, content)


def odometry(sim: Simulation) -> Packet:
    """ODOMETRY (331) as PX4 sends it: child_frame_id is the world's too, velocity is NED."""
    estimate = sim.estimate
    x, y, z = swap_enu_ned(estimate.position_enu_m)
    vx, vy, vz = swap_enu_ned(estimate.velocity_enu_m_s)
    p, q, r = swap_flu_frd(estimate.rate_flu_rad_s)
    content = ODOMETRY.pack(
        sim.estimate_us,
        x,
        y,
        z,
        *attitude_to_wire(estimate.attitude_flu_to_enu),
        vx,
        vy,
        vz,
        p,
        q,
        r,
        _COVARIANCES,
        _FRAME_LOCAL_NED,
        _FRAME_LOCAL_NED,
        sim.estimate_resets & 0xFF,
        _ESTIMATOR_AUTOPILOT,
        0,
    )
    return Packet(ODOMETRY, content)


def global_position_int(sim: Simulation) -> Packet:
    """GLOBAL_POSITION_INT (33)."""
    estimate = sim.estimate
    latitude, longitude, altitude_mm = global_position(sim.origin, estimate.position_enu_m)
    vx, vy, vz = swap_enu_ned(estimate.velocity_enu_m_s)
    content = _GLOBAL_POSITION.pack(
        sim.estimate_ms,
        latitude,
        longitude,
        altitude_mm,
        int32(_height_above_home_m(sim) * 1000.0),
        int16(vx * 100.0),
        int16(vy * 100.0),
        int16(vz * 100.0),
        round(_heading_deg(sim) * 100.0) % 36000,
    )
    return Packet(_GLOBAL_POSITION, content)


def gps_raw_int(sim: Simulation) -> Packet:
    """GPS_RAW_INT (24): a good fix at the estimated position."""
    estimate = sim.estimate
    latitude, longitude, altitude_mm = global_position(sim.origin, estimate.position_enu_m)
    east, north, _ = estimate.velocity_enu_m_s
    speed = math.hypot(east, north)
    course_deg = math.degrees(math.atan2(east, north)) % 360.0
    content = _GPS_RAW.pack(
        sim.stamp_us,
        latitude,
        longitude,
        altitude_mm,
        70,  # dilution of precision, times 100
        80,
        uint16(speed * 100.0),
        round(course_deg * 100.0) % 36000,
        3,  # a three-dimensional fix
        16,  # satellites
        altitude_mm,
        900,  # accuracies, mm and mm/s
        1780,
        250,
        0,
        0,
    )
    return Packet(_GPS_RAW, content)


def highres_imu(sim: Simulation) -> Packet:
    """HIGHRES_IMU (105)."""
    return imu_packet(sim, 1.0, 63)


def imu_packet(sim: Simulation, field_scale: float, updated: int) -> Packet:
    """HIGHRES_IMU (105).

    Args:
        sim: of the vehicle.
        field_scale: what the magnetic field is multiplied by.
        updated: HIGHRES_IMU_UPDATED_FLAGS.
    """
    ax, ay, az, p, q, r, mx, my, mz = imu_readings(sim)
    altitude_m = sim.origin.altitude_amsl_m + sim.estimate.position_enu_m[2]
    content = _HIGHRES_IMU.pack(
        sim.estimate_us,
        ax,
        ay,
        az,
        p,
        q,
        r,
        mx * field_scale,
        my * field_scale,
        mz * field_scale,
        _pressure_hpa(altitude_m),
        0.0,
        altitude_m,
        15.0,
        updated,
        0,
    )
    return Packet(_HIGHRES_IMU, content)


def imu_readings(
    sim: Simulation,
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Specific force (m/s²), rates (rad/s) and magnetic field (gauss), FRD."""
    estimate = sim.estimate
    frd_to_ned = attitude_to_wire(estimate.attitude_flu_to_enu)
    ax, ay, az = swap_enu_ned(estimate.acceleration_enu_m_s2)
    force = rotate_inverse(frd_to_ned, (ax, ay, az - _GRAVITY_M_S2))
    gyro = swap_flu_frd(estimate.rate_flu_rad_s)
    field = rotate_inverse(frd_to_ned, _FIELD_NED_GAUSS)
    return (*force, *gyro, *field)


def altitude(sim: Simulation) -> Packet:
    """ALTITUDE (141)."""
    up = sim.estimate.position_enu_m[2]
    amsl = sim.origin.altitude_amsl_m + up
    relative = _height_above_home_m(sim)
    content = _ALTITUDE.pack(sim.estimate_us, amsl, amsl, up, relative, _NAN, relative)
    return Packet(_ALTITUDE, content)


def vfr_hud(sim: Simulation) -> Packet:
    """VFR_HUD (74): without an airspeed."""
    return hud_packet(sim, airspeed_m_s=_NAN)


def hud_packet(sim: Simulation, *, airspeed_m_s: float | None) -> Packet:
    """VFR_HUD (74).

    Args:
        sim: of the vehicle.
        airspeed_m_s: what it says of it; None says the ground speed.
    """
    east, north, climb = sim.estimate.velocity_enu_m_s
    _, _, thrust = sim.autopilot.attitude_setpoint
    throttle = max(0.0, min(1.0, thrust)) if sim.autopilot.armed else 0.0
    ground_speed = math.hypot(east, north)
    content = _VFR_HUD.pack(
        ground_speed if airspeed_m_s is None else airspeed_m_s,
        ground_speed,
        sim.origin.altitude_amsl_m + sim.estimate.position_enu_m[2],
        climb,
        round(_heading_deg(sim)) % 360,
        round(throttle * 100.0) if throttle == throttle else 0,
    )
    return Packet(_VFR_HUD, content)


def attitude_target(sim: Simulation) -> Packet:
    """ATTITUDE_TARGET (83): what the attitude controller follows."""
    setpoint, rates, thrust = sim.autopilot.attitude_setpoint
    content = _ATTITUDE_TARGET.pack(
        sim.stamp_ms, *attitude_to_wire(setpoint), *swap_flu_frd(rates), thrust, 0
    )
    return Packet(_ATTITUDE_TARGET, content)


def position_target_local_ned(sim: Simulation) -> Packet | None:
    """POSITION_TARGET_LOCAL_NED (85): NaN while position control is idle.

    None while attitudes or rates are followed: PX4 has no such setpoint to tell then.
    """
    target = sim.autopilot.position_target
    if target is None and sim.autopilot.heartbeat.custom_mode == _PX4_OFFBOARD:
        return None
    idle = (_NAN, _NAN, _NAN)
    if target is None:
        yaw = math.radians(_heading_deg(sim))
        position, velocity, acceleration = idle, idle, (0.0, 0.0, 100.0)
        mask = _TYPE_MASK_NOTHING
    else:
        position = swap_enu_ned(target.position_enu_m) if target.position_enu_m else idle
        velocity = swap_enu_ned(target.velocity_enu_m_s) if target.velocity_enu_m_s else idle
        acceleration = (
            swap_enu_ned(target.acceleration_enu_m_s2) if target.acceleration_enu_m_s2 else idle
        )
        yaw = math.pi / 2.0 - target.yaw_enu_rad
        mask = 0 if target.position_enu_m else _TYPE_MASK_NO_POSITION
    content = _POSITION_TARGET.pack(
        sim.stamp_ms,
        *position,
        *velocity,
        *acceleration,
        math.remainder(yaw, 2.0 * math.pi),
        0.0,
        mask,
        _FRAME_LOCAL_NED,
    )
    return Packet(_POSITION_TARGET, content)


def servo_output_raw(sim: Simulation) -> Packet:
    """SERVO_OUTPUT_RAW (36): 900 disarmed, 1000 to 2000 armed."""
    if sim.autopilot.armed:
        rotors = [round(1000.0 + 1000.0 * signal) for signal in sim.autopilot.rotor_commands]
    else:
        rotors = [_SERVO_LOW] * 4
    # This stamp alone has 32 bits for its microseconds: it goes round after 71 minutes.
    stamp_us = sim.stamp_us & 0xFFFFFFFF
    return Packet(_SERVO_OUTPUT, _SERVO_OUTPUT.pack(stamp_us, *rotors, _SERVOS_UNUSED))


def _height_above_home_m(sim: Simulation) -> float:
    home = sim.autopilot.home_enu_m
    return sim.estimate.position_enu_m[2] - (home[2] if home else 0.0)


def _heading_deg(sim: Simulation) -> float:
    """Clockwise from north, 0 to 360."""
    w, x, y, z = attitude_to_wire(sim.estimate.attitude_flu_to_enu)
    yaw = math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return math.degrees(yaw) % 360.0


def _pressure_hpa(altitude_m: float) -> float:
    """Of the standard atmosphere's troposphere, which is not asked about places far outside it."""
    return 1013.25 * math.pow(1.0 - 2.25577e-5 * max(-11e3, min(44e3, altitude_m)), 5.25588)
