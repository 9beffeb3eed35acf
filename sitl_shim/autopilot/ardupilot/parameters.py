"""The ArduCopter parameters that act here, and some that clients ask for.

Names are those of the 4.7 development branch in which `PSC_*` and `MAV_*` were renamed and the
`WPNAV_*` were not yet.  Source: ArduPilot's parameter reference
(https://ardupilot.org/copter/docs/parameters.html).
"""

from collections.abc import Mapping

from sitl_shim.autopilot.parameters import (
    ParameterDefinition,
    ParameterStore,
    ParameterType,
)

_REAL = ParameterType.REAL32
_INT = ParameterType.INT32

_TABLE: tuple[tuple[str, ParameterType, float, float, float, str], ...] = (
    # name, type, default, minimum, maximum, meaning
    ("ANGLE_MAX", _INT, 3000, 1000, 8000, "lean limit of position control, cdeg"),
    ("ATC_ACCEL_P_MAX", _REAL, 110000, 0, 180000, "pitch acceleration limit, cdeg/s2; 0 none"),
    ("ATC_ACCEL_R_MAX", _REAL, 110000, 0, 180000, "roll acceleration limit, cdeg/s2; 0 none"),
    ("ATC_ACCEL_Y_MAX", _REAL, 27000, 0, 72000, "yaw acceleration limit, cdeg/s2; 0 none"),
    ("ATC_ANGLE_BOOST", _INT, 1, 0, 1, "throttle is divided by the cosine of the tilt"),
    ("ATC_ANG_PIT_P", _REAL, 4.5, 0.0, 12.0, "pitch angle P, 1/s"),
    ("ATC_ANG_RLL_P", _REAL, 4.5, 0.0, 12.0, "roll angle P, 1/s"),
    ("ATC_ANG_YAW_P", _REAL, 4.5, 0.0, 12.0, "yaw angle P, 1/s"),
    ("ATC_INPUT_TC", _REAL, 0.15, 0.0, 1.0, "time constant of the attitude input, s"),
    ("ATC_RATE_FF_ENAB", _INT, 1, 0, 1, "shape the attitude input and feed its rate forward"),
    ("ATC_RATE_P_MAX", _REAL, 0.0, 0.0, 1080.0, "pitch rate limit, deg/s; 0 none"),
    ("ATC_RATE_R_MAX", _REAL, 0.0, 0.0, 1080.0, "roll rate limit, deg/s; 0 none"),
    ("ATC_RATE_Y_MAX", _REAL, 0.0, 0.0, 1080.0, "yaw rate limit, deg/s; 0 none"),
    ("ATC_RAT_PIT_D", _REAL, 0.0036, 0.0, 0.05, "pitch rate D"),
    ("ATC_RAT_PIT_FF", _REAL, 0.0, 0.0, 0.5, "pitch rate feed-forward"),
    ("ATC_RAT_PIT_FLTD", _REAL, 20.0, 0.0, 250.0, "pitch rate: filter of the derivative, Hz"),
    ("ATC_RAT_PIT_FLTE", _REAL, 0.0, 0.0, 250.0, "pitch rate: filter of the error, Hz; 0 off"),
    ("ATC_RAT_PIT_FLTT", _REAL, 20.0, 0.0, 250.0, "pitch rate: filter of the target, Hz; 0 off"),
    ("ATC_RAT_PIT_I", _REAL, 0.135, 0.0, 2.0, "pitch rate I"),
    ("ATC_RAT_PIT_IMAX", _REAL, 0.5, 0.0, 1.0, "pitch rate integrator limit"),
    ("ATC_RAT_PIT_P", _REAL, 0.135, 0.0, 0.6, "pitch rate P"),
    ("ATC_RAT_RLL_D", _REAL, 0.0036, 0.0, 0.05, "roll rate D"),
    ("ATC_RAT_RLL_FF", _REAL, 0.0, 0.0, 0.5, "roll rate feed-forward"),
    ("ATC_RAT_RLL_FLTD", _REAL, 20.0, 0.0, 250.0, "roll rate: filter of the derivative, Hz"),
    ("ATC_RAT_RLL_FLTE", _REAL, 0.0, 0.0, 250.0, "roll rate: filter of the error, Hz; 0 off"),
    ("ATC_RAT_RLL_FLTT", _REAL, 20.0, 0.0, 250.0, "roll rate: filter of the target, Hz; 0 off"),
    ("ATC_RAT_RLL_I", _REAL, 0.135, 0.0, 2.0, "roll rate I"),
    ("ATC_RAT_RLL_IMAX", _REAL, 0.5, 0.0, 1.0, "roll rate integrator limit"),
    ("ATC_RAT_RLL_P", _REAL, 0.135, 0.0, 0.6, "roll rate P"),
    ("ATC_RAT_YAW_D", _REAL, 0.0, 0.0, 0.05, "yaw rate D"),
    ("ATC_RAT_YAW_FF", _REAL, 0.0, 0.0, 0.5, "yaw rate feed-forward"),
    ("ATC_RAT_YAW_FLTD", _REAL, 0.0, 0.0, 250.0, "yaw rate: filter of the derivative, Hz"),
    ("ATC_RAT_YAW_FLTE", _REAL, 2.5, 0.0, 250.0, "yaw rate: filter of the error, Hz; 0 off"),
    ("ATC_RAT_YAW_FLTT", _REAL, 20.0, 0.0, 250.0, "yaw rate: filter of the target, Hz; 0 off"),
    ("ATC_RAT_YAW_I", _REAL, 0.018, 0.0, 2.0, "yaw rate I"),
    ("ATC_RAT_YAW_IMAX", _REAL, 0.5, 0.0, 1.0, "yaw rate integrator limit"),
    ("ATC_RAT_YAW_P", _REAL, 0.18, 0.0, 2.5, "yaw rate P"),
    ("ATC_SLEW_YAW", _REAL, 6000, 500, 18000, "yaw slew of autonomous modes, cdeg/s"),
    ("BATT_CAPACITY", _INT, 3300, 0, 1000000, "charge of a full battery, mAh"),
    ("BATT_CRT_MAH", _REAL, 0.0, 0.0, 1000000.0, "critical below this charge, mAh; 0 never"),
    ("BATT_CRT_VOLT", _REAL, 0.0, 0.0, 120.0, "critical below this voltage, V; 0 never"),
    ("BATT_FS_CRT_ACT", _INT, 0, 0, 7, "critical: 0 warn, 1 land, 2 return, 5 stop, 7 brake"),
    ("BATT_FS_LOW_ACT", _INT, 0, 0, 7, "low: 0 warn, 1 land, 2 return, 5 stop, 7 brake"),
    ("BATT_LOW_MAH", _REAL, 0.0, 0.0, 1000000.0, "low below this charge, mAh; 0 never"),
    ("BATT_LOW_TIMER", _INT, 10, 0, 120, "a voltage is too low for this long, s"),
    ("BATT_LOW_VOLT", _REAL, 10.5, 0.0, 120.0, "low below this voltage, V; 0 never"),
    ("DISARM_DELAY", _INT, 10, 0, 127, "disarm when idle on the ground for this long, s; 0 never"),
    ("FENCE_ACTION", _INT, 1, 0, 5, "0 report, 1 return or land, 2 land, 4 brake or land"),
    ("FENCE_ALT_MAX", _REAL, 100.0, 0.0, 1000.0, "fence above home, m"),
    ("FENCE_ENABLE", _INT, 0, 0, 1, "whether the fences are up"),
    ("FENCE_RADIUS", _REAL, 300.0, 0.0, 10000.0, "fence about home, m"),
    ("FENCE_TYPE", _INT, 7, 0, 15, "bits: 1 height, 2 circle; others are not looked at"),
    ("FS_EKF_ACTION", _INT, 1, 0, 3, "estimator fails: 0 report, 1 land, 2 hold height, 3 land"),
    ("FS_GCS_ENABLE", _INT, 0, 0, 7, "ground station lost: 0 nothing, 5 land, 7 brake, else RTL"),
    ("FS_GCS_TIMEOUT", _REAL, 5.0, 2.0, 120.0, "the ground station is lost after this, s"),
    ("GUID_OPTIONS", _INT, 0, 0, 255, "bit 3: thrust is throttle, not a climb rate"),
    ("GUID_TIMEOUT", _REAL, 3.0, 0.1, 5.0, "a target holds this long in GUIDED, s"),
    ("INS_GYRO_FILTER", _INT, 20, 0, 256, "low-pass of the body rates, Hz; 0 off"),
    ("LAND_ALT_LOW", _REAL, 1000, 100, 10000, "sink at LAND_SPEED below this height, cm"),
    ("LAND_SPEED", _INT, 50, 30, 200, "landing speed, cm/s"),
    ("LAND_SPEED_HIGH", _INT, 0, 0, 500, "sink rate above LAND_ALT_LOW, cm/s; 0: WPNAV_SPEED_DN"),
    ("MAV_GCS_SYSID", _INT, 255, 1, 255, "system id of the ground station that must be heard"),
    ("MAV_SYSID", _INT, 1, 1, 255, "MAVLink system id; a change is kept, without effect here"),
    ("MIS_TOTAL", _INT, 1, 0, 32766, "items of the mission, home included; told, not obeyed"),
    ("MOT_HOVER_LEARN", _INT, 2, 0, 2, "0: MOT_THST_HOVER stays, 1: learned, 2: and saved"),
    ("MOT_SPIN_ARM", _REAL, 0.1, 0.0, 0.3, "signal of a motor that idles"),
    ("MOT_SPOOL_TIME", _REAL, 0.5, 0.05, 2.0, "from idle to full range, s"),
    ("MOT_THST_EXPO", _REAL, 0.65, -1.0, 1.0, "rotor thrust = e u^2 + (1 - e) u"),
    ("MOT_THST_HOVER", _REAL, 0.35, 0.125, 0.6875, "hover throttle"),
    ("MOT_YAW_HEADROOM", _INT, 200, 0, 500, "yaw that is kept at full throttle, per mille"),
    ("PILOT_SPEED_DN", _INT, 0, 0, 500, "sink rate of the stick, cm/s; 0: PILOT_SPEED_UP"),
    ("PILOT_SPEED_UP", _INT, 250, 10, 500, "climb rate of the stick, cm/s"),
    ("PILOT_THR_FILT", _REAL, 0.0, 0.0, 10.0, "filter of a throttle that is given, Hz; 0 off"),
    ("PSC_D_ACC_FLTE", _REAL, 20.0, 0.0, 100.0, "vertical acceleration: filter of the error, Hz"),
    ("PSC_D_ACC_I", _REAL, 0.1, 0.0, 0.3, "vertical acceleration I"),
    ("PSC_D_ACC_IMAX", _REAL, 0.8, 0.0, 1.0, "vertical acceleration integrator limit, throttle"),
    ("PSC_D_ACC_P", _REAL, 0.05, 0.01, 0.15, "vertical acceleration P, throttle per m/s2"),
    ("PSC_D_POS_P", _REAL, 1.0, 0.5, 4.0, "vertical position P, 1/s"),
    ("PSC_D_VEL_FLTE", _REAL, 5.0, 0.0, 100.0, "vertical velocity: filter of the error, Hz"),
    ("PSC_D_VEL_P", _REAL, 5.0, 1.0, 10.0, "vertical velocity P, 1/s"),
    ("PSC_JERK_D", _REAL, 5.0, 1.0, 50.0, "vertical jerk, m/s3"),
    ("PSC_JERK_NE", _REAL, 5.0, 1.0, 20.0, "horizontal jerk, m/s3"),
    ("PSC_NE_POS_P", _REAL, 1.0, 0.1, 4.0, "horizontal position P, 1/s"),
    ("PSC_NE_VEL_D", _REAL, 0.25, 0.0, 2.0, "horizontal velocity D"),
    ("PSC_NE_VEL_FLTD", _REAL, 5.0, 0.0, 100.0, "horizontal velocity: filter of D, Hz"),
    ("PSC_NE_VEL_FLTE", _REAL, 5.0, 0.0, 100.0, "horizontal velocity: filter of the error, Hz"),
    ("PSC_NE_VEL_I", _REAL, 1.0, 0.0, 2.0, "horizontal velocity I, 1/s2"),
    ("PSC_NE_VEL_IMAX", _REAL, 10.0, 0.0, 45.0, "horizontal velocity integrator limit, m/s2"),
    ("PSC_NE_VEL_P", _REAL, 2.0, 0.1, 6.0, "horizontal velocity P, 1/s"),
    ("RTL_ALT", _INT, 1500, 30, 300000, "return altitude above home, cm"),
    ("RTL_ALT_FINAL", _INT, 0, 0, 1000, "0: land at home; else stay this high, cm"),
    ("RTL_LOIT_TIME", _INT, 5000, 0, 60000, "wait above home, ms"),
    ("SIM_SPEEDUP", _REAL, 1.0, 0.0, 100.0, "speed of time; a change is kept, without effect here"),
    ("TKOFF_SLEW_TIME", _REAL, 2.0, 0.25, 5.0, "throttle ramp of a take-off, s"),
    ("WPNAV_ACCEL", _REAL, 250, 50, 500, "horizontal acceleration of autonomous modes, cm/s2"),
    ("WPNAV_ACCEL_Z", _REAL, 100, 50, 500, "vertical acceleration of autonomous modes, cm/s2"),
    ("WPNAV_RADIUS", _REAL, 200, 5, 1000, "a waypoint is reached within this, cm"),
    ("WPNAV_SPEED", _REAL, 1000, 10, 2000, "speed of autonomous modes, cm/s"),
    ("WPNAV_SPEED_DN", _REAL, 150, 10, 500, "sink rate of autonomous modes and GUIDED, cm/s"),
    ("WPNAV_SPEED_UP", _REAL, 250, 10, 1000, "climb rate of autonomous modes and GUIDED, cm/s"),
)

_KEPT: tuple[tuple[str, ParameterType, float, float, float], ...] = (
    # name, type, default, minimum, maximum: clients ask for these
    ("ARMING_CHECK", _INT, 1, 0, 2097151),
    ("BATT_MONITOR", _INT, 4, 0, 30),
    ("FENCE_MARGIN", _REAL, 2.0, 1.0, 10.0),
    ("FLTMODE_CH", _INT, 5, 0, 16),
    ("FORMAT_VERSION", _INT, 120, 0, 255),
    ("FRAME_CLASS", _INT, 1, 0, 17),
    ("FRAME_TYPE", _INT, 1, 0, 19),
    ("FS_CRASH_CHECK", _INT, 1, 0, 1),
    ("FS_OPTIONS", _INT, 16, 0, 63),
    ("FS_THR_ENABLE", _INT, 1, 0, 7),
    ("MAV1_EXTRA1", _INT, 0, 0, 50),
    ("MAV1_EXTRA2", _INT, 0, 0, 50),
    ("MAV1_EXTRA3", _INT, 0, 0, 50),
    ("MAV1_EXT_STAT", _INT, 0, 0, 50),
    ("MAV1_POSITION", _INT, 0, 0, 50),
    ("MAV1_RAW_SENS", _INT, 0, 0, 50),
    ("MAV1_RC_CHAN", _INT, 0, 0, 50),
    ("PSC_D_ACC_D", _REAL, 0.0, 0.0, 0.02),
    ("RC7_OPTION", _INT, 7, 0, 1000),
    ("STAT_RUNTIME", _INT, 0, 0, 2147483647),
    ("SYSID_ENFORCE", _INT, 0, 0, 1),
)

DEFINITIONS: tuple[ParameterDefinition, ...] = (
    *(ParameterDefinition(*row) for row in _TABLE),
    *(ParameterDefinition(*row, "kept, without effect here") for row in _KEPT),
)


def make_parameters(overrides: Mapping[str, float]) -> ParameterStore:
    """ArduCopter's parameters with a vehicle's values in place of the defaults.

    Raises:
        ParameterError: an override that does not exist here or is out of range.
    """
    return ParameterStore(DEFINITIONS, overrides)
