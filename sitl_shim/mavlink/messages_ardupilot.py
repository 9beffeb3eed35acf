"""Messages that only ArduPilot sends, or that it fills otherwise than PX4.

As a running ArduCopter 4.7-dev was recorded.  Field meanings:
https://mavlink.io/en/messages/ardupilotmega.html.
"""

import math

from sitl_shim.frames import (
    attitude_to_wire,
    euler_from_quaternion,
    rotate_inverse,
    swap_enu_ned,
    swap_flu_frd,
)
from sitl_shim.mavlink import messages_motion as motion
from sitl_shim.mavlink import messages_status as status
from sitl_shim.mavlink.geodesy import global_position
from sitl_shim.mavlink.integers import int16, uint16
from sitl_shim.mavlink.packets import Packet
from sitl_shim.mavlink.wire import Message, dialect
from sitl_shim.simulation import Simulation

_CAPABILITIES = 64495
_FLIGHT_SW_VERSION = 0x04070000
_CUSTOM_VERSION = b"2598e9d4"
_UID2 = b"6d1219c7c4c5404aa".ljust(18, b"\0")
_MULTICOPTER = 3
"""MAV_VTOL_STATE_MC: ArduPilot fills it for a plain copter, too."""
_NO_FIX_EPH = 65535
_GRAVITY_M_S2 = 9.80665
_NAN = math.nan
_EKF_VARIANCES = (0.0016, 0.00015, 0.00008, 0.0297)
"""Of velocity, horizontal and vertical position, compass: typical, at rest."""


def mission_current(sim: Simulation) -> Message:
    """MISSION_CURRENT (42): home, the first item, does not count."""
    return status.mission_current(sim, uncounted=1, total_of_none=0)


def autopilot_version(_: Simulation) -> Message:
    """AUTOPILOT_VERSION (148)."""
    return dialect.MAVLink_autopilot_version_message(
        _CAPABILITIES,
        _FLIGHT_SW_VERSION,
        0,
        0,
        0,
        _CUSTOM_VERSION,
        bytes(8),
        bytes(8),
        0,
        0,
        0,
        _UID2,
    )


def sys_status(sim: Simulation) -> Message:
    """SYS_STATUS (1)."""
    sensors = sim.autopilot.sensor_health
    turning = sum(sim.autopilot.rotor_commands) > 0.5
    return dialect.MAVLink_sys_status_message(
        sensors.present,
        sensors.enabled,
        sensors.health,
        0,
        round(sim.battery.voltage_v * 1000.0),
        2810 if turning else 0,  # cA
        max(0, min(100, round(sim.battery.remaining * 100.0))),
        0,
        0,
        0,
        0,
        0,
        0,
    )


def extended_sys_state(sim: Simulation) -> Message:
    """EXTENDED_SYS_STATE (245)."""
    return dialect.MAVLink_extended_sys_state_message(_MULTICOPTER, sim.autopilot.landed_state)


def ekf_status_report(sim: Simulation) -> Message:
    """EKF_STATUS_REPORT (193)."""
    estimator = sim.autopilot.estimator
    variances = _EKF_VARIANCES if estimator.position_known else (0.0, 0.0004, 0.002, 0.02)
    return dialect.MAVLink_ekf_status_report_message(estimator.flags, *variances, 0.0, 0.0)


def local_position_ned(sim: Simulation) -> Packet | None:
    """LOCAL_POSITION_NED (32); None until the estimator has a position."""
    return motion.local_position_ned(sim) if sim.autopilot.estimator.position_known else None


def gps_raw_int(sim: Simulation) -> Message:
    """GPS_RAW_INT (24)."""
    fix = sim.autopilot.estimator.gps_fix
    if fix < 2:
        satellites = 3 if fix else 0
        return dialect.MAVLink_gps_raw_int_message(
            0, fix, 0, 0, 0, _NO_FIX_EPH, _NO_FIX_EPH, 0, 0, satellites
        )
    latitude, longitude, altitude_mm = global_position(sim.origin, sim.estimate.position_enu_m)
    east, north, _ = sim.estimate.velocity_enu_m_s
    course = round(math.degrees(math.atan2(east, north)) * 100.0) % 36000
    return dialect.MAVLink_gps_raw_int_message(
        sim.stamp_us,
        fix,
        latitude,
        longitude,
        altitude_mm,
        121,
        200,
        uint16(math.hypot(east, north) * 100.0),
        course,
        10,
        altitude_mm,
        300,
        300,
    )


def home_position(sim: Simulation) -> Message | None:
    """HOME_POSITION (242); None until home is known."""
    home = sim.autopilot.home_enu_m
    if home is None:
        return None
    x, y, z = swap_enu_ned(home)
    return dialect.MAVLink_home_position_message(
        *global_position(sim.origin, home), x, y, z, [_NAN] * 4, 0.0, 0.0, 0.0, sim.stamp_us
    )


def gps_global_origin(sim: Simulation) -> Message | None:
    """GPS_GLOBAL_ORIGIN (49); None until the origin is set."""
    if not sim.autopilot.estimator.origin_known:
        return None
    return dialect.MAVLink_gps_global_origin_message(
        *global_position(sim.origin, (0.0, 0.0, 0.0)), sim.stamp_us
    )


def highres_imu(sim: Simulation) -> Packet:
    """HIGHRES_IMU (105): the magnetometer's field is a million times what it should be."""
    return motion.imu_packet(sim, 1e6, 8191)


def raw_imu(sim: Simulation) -> Message:
    """RAW_IMU (27): mg, mrad/s and mgauss."""
    ax, ay, az, p, q, r, mx, my, mz = motion.imu_readings(sim)
    return dialect.MAVLink_raw_imu_message(
        sim.stamp_us,
        *(int16(value / _GRAVITY_M_S2 * 1e3) for value in (ax, ay)),
        int16(az / _GRAVITY_M_S2 * 1e3),
        *(int16(value * 1e3) for value in (p, q, r)),
        *(int16(value * 1e3) for value in (mx, my, mz)),
        0,
        2803,
    )


def servo_output_raw(sim: Simulation) -> Message:
    """SERVO_OUTPUT_RAW (36): 1000 disarmed, to 2000; outputs without a function are 0."""
    rotors = [round(1000.0 + 1000.0 * signal) for signal in sim.autopilot.rotor_commands]
    stamp_us = sim.stamp_us & 0xFFFFFFFF  # has no more bits
    return dialect.MAVLink_servo_output_raw_message(stamp_us, 0, *rotors, *([0] * 12))


def vfr_hud(sim: Simulation) -> Packet:
    """VFR_HUD (74): ArduPilot gives a ground speed in place of the airspeed it has not."""
    return motion.hud_packet(sim, airspeed_m_s=None)


def simstate(sim: Simulation) -> Message:
    """SIMSTATE (164): the simulator's truth, without altitude and velocity."""
    state = sim.state
    frd_to_ned = attitude_to_wire(state.attitude_flu_to_enu)
    ax, ay, az = swap_enu_ned(state.acceleration_enu_m_s2)
    force = rotate_inverse(frd_to_ned, (ax, ay, az - _GRAVITY_M_S2))
    latitude, longitude, _ = global_position(sim.origin, state.position_enu_m)
    return dialect.MAVLink_simstate_message(
        *euler_from_quaternion(frd_to_ned),
        *force,
        *swap_flu_frd(state.rate_flu_rad_s),
        latitude,
        longitude,
    )


def sim_state(sim: Simulation) -> Message:
    """SIM_STATE (108): the simulator's truth, without time."""
    state = sim.state
    frd_to_ned = attitude_to_wire(state.attitude_flu_to_enu)
    ax, ay, az = swap_enu_ned(state.acceleration_enu_m_s2)
    force = rotate_inverse(frd_to_ned, (ax, ay, az - _GRAVITY_M_S2))
    latitude, longitude, altitude_mm = global_position(sim.origin, state.position_enu_m)
    return dialect.MAVLink_sim_state_message(
        *frd_to_ned,
        *euler_from_quaternion(frd_to_ned),
        *force,
        *swap_flu_frd(state.rate_flu_rad_s),
        latitude * 1e-7,
        longitude * 1e-7,
        altitude_mm * 1e-3,
        0.0,
        0.0,
        *swap_enu_ned(state.velocity_enu_m_s),
        latitude,
        longitude,
    )
