"""The PX4 parameters that act here, with PX4's names, defaults and meanings.

Source: PX4's parameter reference (docs.px4.io/main/en/advanced_config/parameter_reference.html).
"""

import csv
from collections.abc import Iterator, Mapping
from pathlib import Path

from sitl_shim.autopilot.parameters import (
    ParameterDefinition,
    ParameterStore,
    ParameterType,
)
from sitl_shim.sensors.aiding import Aiding

_EXTERNAL_HEIGHT = 3
"""EKF2_HGT_REF: vision."""
_REAL = ParameterType.REAL32
_INT = ParameterType.INT32

_TABLE: tuple[tuple[str, ParameterType, float, float, float, str], ...] = (
    # name, type, default, minimum, maximum, meaning
    ("BAT_CRIT_THR", _REAL, 0.07, 0.0, 0.9, "the battery is critical below this share"),
    ("BAT_EMERGEN_THR", _REAL, 0.05, 0.0, 0.9, "the battery is an emergency below this share"),
    ("BAT_LOW_THR", _REAL, 0.15, 0.0, 0.9, "the battery is low below this share"),
    ("COM_DISARM_LAND", _REAL, 2.0, -1.0, 60.0, "disarm this long after landing, s; < 0 never"),
    ("COM_DISARM_PRFLT", _REAL, 10.0, -1.0, 600.0, "disarm unless taken off, s; < 0 never"),
    ("COM_FAIL_ACT_T", _REAL, 5.0, 0.0, 25.0, "hold this long before a failsafe acts, s"),
    (
        "COM_LOW_BAT_ACT",
        _INT,
        3,
        0,
        3,
        "low battery: 0 warn, 1 return, 2 land, 3 return, then land",
    ),
    ("COM_OBL_RC_ACT", _INT, 0, 0, 7, "loss of the offboard stream, see after_offboard_loss"),
    ("COM_OF_LOSS_T", _REAL, 1.0, 0.0, 60.0, "the offboard stream is lost after this, s"),
    ("COM_SPOOLUP_TIME", _REAL, 1.0, 0.0, 30.0, "motors idle at least this before take-off, s"),
    ("EKF2_EVA_NOISE", _REAL, 0.1, 0.05, 1000.0, "least noise of an external yaw, rad"),
    ("EKF2_EVP_NOISE", _REAL, 0.1, 0.01, 1000.0, "least noise of an external position, m"),
    ("EKF2_EV_CTRL", _INT, 0, 0, 15, "fuse external: 1 x y, 2 height, 4 velocity, 8 yaw"),
    ("EKF2_EV_DELAY", _REAL, 0.0, 0.0, 300.0, "external poses are older than they say by, ms"),
    ("EKF2_EV_NOISE_MD", _INT, 0, 0, 1, "0: covariance of the message counts if larger"),
    ("EKF2_EV_QMIN", _INT, 0, 0, 100, "least quality of an external pose; 0 takes all"),
    ("EKF2_GPS_CTRL", _INT, 7, 0, 15, "satellites: 1 position, 2 height, 4 velocity, 8 yaw"),
    ("EKF2_HGT_REF", _INT, 1, 0, 3, "height: 0 barometer, 1 satellites, 2 range, 3 external"),
    ("EKF2_NOAID_TOUT", _INT, 5000000, 500000, 10000000, "position lost without aid after, us"),
    ("EKF2_PREDICT_US", _INT, 10000, 1000, 20000, "prediction period, us, read at start"),
    ("GF_ACTION", _INT, 2, 0, 5, "beyond the fence: 1 warn, 2 hold, 3 return, 4 terminate, 5 land"),
    ("GF_MAX_HOR_DIST", _REAL, 0.0, 0.0, 10000.0, "fence about home, m; 0 none"),
    ("GF_MAX_VER_DIST", _REAL, 0.0, 0.0, 10000.0, "fence above home, m; 0 none"),
    ("IMU_DGYRO_CUTOFF", _REAL, 20.0, 0.0, 1000.0, "low-pass of the angular acceleration, Hz"),
    ("IMU_GYRO_CUTOFF", _REAL, 40.0, 0.0, 1000.0, "low-pass of the body rates, Hz; 0 off"),
    ("LNDMC_ROT_MAX", _REAL, 20.0, 0.0, 1000.0, "landed only below this body rate, deg/s"),
    ("LNDMC_TRIG_TIME", _REAL, 1.0, 0.1, 10.0, "all conditions of landing hold for this, s"),
    ("LNDMC_XY_VEL_MAX", _REAL, 1.5, 0.0, 10.0, "landed only below this speed, m/s"),
    ("LNDMC_Z_VEL_MAX", _REAL, 0.25, 0.0, 10.0, "landed only below this vertical speed, m/s"),
    ("MAV_SYS_ID", _INT, 1, 1, 250, "MAVLink system id; a change is kept, without effect here"),
    ("MC_AIRMODE", _INT, 0, 0, 1, "1: thrust may rise to keep roll and pitch"),
    ("MC_PITCHRATE_D", _REAL, 0.003, 0.0, 1.0, "pitch rate D"),
    ("MC_PITCHRATE_FF", _REAL, 0.0, 0.0, 1.0, "pitch rate feed-forward"),
    ("MC_PITCHRATE_I", _REAL, 0.2, 0.0, 10.0, "pitch rate I"),
    ("MC_PITCHRATE_K", _REAL, 1.0, 0.01, 5.0, "pitch rate gain over P, I and D"),
    ("MC_PITCHRATE_MAX", _REAL, 220.0, 0.0, 1800.0, "pitch rate limit, deg/s"),
    ("MC_PITCHRATE_P", _REAL, 0.15, 0.0, 5.0, "pitch rate P"),
    ("MC_PITCH_P", _REAL, 4.0, 0.0, 30.0, "pitch P, 1/s"),
    ("MC_PR_INT_LIM", _REAL, 0.30, 0.0, 1.0, "pitch rate integrator limit"),
    ("MC_ROLLRATE_D", _REAL, 0.003, 0.0, 1.0, "roll rate D"),
    ("MC_ROLLRATE_FF", _REAL, 0.0, 0.0, 1.0, "roll rate feed-forward"),
    ("MC_ROLLRATE_I", _REAL, 0.2, 0.0, 10.0, "roll rate I"),
    ("MC_ROLLRATE_K", _REAL, 1.0, 0.01, 5.0, "roll rate gain over P, I and D"),
    ("MC_ROLLRATE_MAX", _REAL, 220.0, 0.0, 1800.0, "roll rate limit, deg/s"),
    ("MC_ROLLRATE_P", _REAL, 0.15, 0.0, 5.0, "roll rate P"),
    ("MC_ROLL_P", _REAL, 4.0, 0.0, 30.0, "roll P, 1/s"),
    ("MC_RR_INT_LIM", _REAL, 0.30, 0.0, 1.0, "roll rate integrator limit"),
    ("MC_YAWRATE_D", _REAL, 0.0, 0.0, 1.0, "yaw rate D"),
    ("MC_YAWRATE_FF", _REAL, 0.0, 0.0, 1.0, "yaw rate feed-forward"),
    ("MC_YAWRATE_I", _REAL, 0.1, 0.0, 10.0, "yaw rate I"),
    ("MC_YAWRATE_K", _REAL, 1.0, 0.01, 5.0, "yaw rate gain over P, I and D"),
    ("MC_YAWRATE_MAX", _REAL, 200.0, 0.0, 1800.0, "yaw rate limit, deg/s"),
    ("MC_YAWRATE_P", _REAL, 0.2, 0.0, 5.0, "yaw rate P"),
    ("MC_YAW_P", _REAL, 2.8, 0.0, 30.0, "yaw P, 1/s"),
    ("MC_YAW_WEIGHT", _REAL, 0.4, 0.0, 1.0, "yaw's share beside roll and pitch"),
    ("MC_YR_INT_LIM", _REAL, 0.30, 0.0, 1.0, "yaw rate integrator limit"),
    ("MIS_TAKEOFF_ALT", _REAL, 2.5, 0.0, 80.0, "take-off altitude above home, m"),
    ("MPC_ACC_DOWN_MAX", _REAL, 3.0, 0.5, 15.0, "vertical acceleration limit downwards, m/s2"),
    ("MPC_ACC_HOR", _REAL, 3.0, 0.5, 15.0, "horizontal acceleration of setpoints, m/s2"),
    ("MPC_ACC_UP_MAX", _REAL, 4.0, 0.5, 15.0, "vertical acceleration limit upwards, m/s2"),
    ("MPC_LAND_ALT1", _REAL, 10.0, 0.0, 100.0, "slow the descent from this altitude on, m"),
    ("MPC_LAND_ALT2", _REAL, 5.0, 0.0, 100.0, "sink at MPC_LAND_SPEED below this altitude, m"),
    ("MPC_LAND_SPEED", _REAL, 0.7, 0.1, 5.0, "landing speed, m/s"),
    ("MPC_MANTHR_MIN", _REAL, 0.08, 0.0, 1.0, "least thrust of manual modes: land detection"),
    ("MPC_THR_HOVER", _REAL, 0.5, 0.1, 0.8, "hover thrust"),
    ("MPC_THR_MAX", _REAL, 1.0, 0.0, 1.0, "thrust limit of position control"),
    ("MPC_THR_MIN", _REAL, 0.12, 0.05, 0.5, "least thrust of position control"),
    ("MPC_TILTMAX_AIR", _REAL, 45.0, 5.0, 89.0, "tilt limit of position control, deg"),
    ("MPC_TILTMAX_LND", _REAL, 12.0, 5.0, 89.0, "tilt limit during the take-off ramp, deg"),
    ("MPC_TKO_RAMP_T", _REAL, 3.0, 0.0, 10.0, "take-off ramp, s"),
    ("MPC_TKO_SPEED", _REAL, 1.5, 0.5, 5.0, "take-off climb rate, m/s"),
    ("MPC_XY_CRUISE", _REAL, 5.0, 0.5, 20.0, "speed of autonomous modes, m/s"),
    ("MPC_XY_P", _REAL, 0.95, 0.0, 2.0, "horizontal position P, 1/s"),
    ("MPC_XY_VEL_D_ACC", _REAL, 0.2, 0.0, 2.0, "horizontal velocity D"),
    ("MPC_XY_VEL_I_ACC", _REAL, 0.4, 0.0, 60.0, "horizontal velocity I, 1/s2"),
    ("MPC_XY_VEL_MAX", _REAL, 12.0, 0.0, 20.0, "horizontal speed limit, m/s"),
    ("MPC_XY_VEL_P_ACC", _REAL, 1.8, 0.0, 15.0, "horizontal velocity P, 1/s"),
    ("MPC_Z_P", _REAL, 1.0, 0.0, 1.5, "vertical position P, 1/s"),
    ("MPC_Z_VEL_D_ACC", _REAL, 0.0, 0.0, 2.0, "vertical velocity D"),
    ("MPC_Z_VEL_I_ACC", _REAL, 2.0, 0.0, 15.0, "vertical velocity I, 1/s2"),
    ("MPC_Z_VEL_MAX_DN", _REAL, 1.5, 0.5, 4.0, "sink rate limit, m/s"),
    ("MPC_Z_VEL_MAX_UP", _REAL, 3.0, 0.5, 8.0, "climb rate limit, m/s"),
    ("MPC_Z_VEL_P_ACC", _REAL, 4.0, 0.0, 15.0, "vertical velocity P, 1/s"),
    ("MPC_YAWRAUTO_MAX", _REAL, 60.0, 5.0, 360.0, "yaw rate limit of autonomous modes, deg/s"),
    ("NAV_ACC_RAD", _REAL, 2.0, 0.05, 200.0, "horizontal acceptance radius, m"),
    ("NAV_MC_ALT_RAD", _REAL, 0.8, 0.05, 200.0, "vertical acceptance radius, m"),
    ("RTL_CONE_ANG", _INT, 45, 0, 90, "half angle of the cone of return altitudes, deg"),
    ("RTL_MIN_DIST", _REAL, 10.0, 0.5, 100.0, "the cone applies within this distance, m"),
    ("RTL_RETURN_ALT", _REAL, 30.0, 0.0, 1000.0, "return altitude above home, m"),
    ("THR_MDL_FAC", _REAL, 0.0, 0.0, 1.0, "rotor thrust = f u^2 + (1 - f) u"),
)

_LIST = Path(__file__).with_name("parameter_list.csv")
"""All parameters that PX4 v1.17 lists for its simulated quadrotor, with their values."""
_TYPES = {"int32": _INT, "float": _REAL}
_LIMITS = {_INT: (-(2.0**31), 2.0**31 - 1.0), _REAL: (-3.4e38, 3.4e38)}


def _definitions() -> Iterator[ParameterDefinition]:
    """What acts here, and what clients expect to find, keep and read back all the same."""
    for row in _TABLE:
        yield ParameterDefinition(*row)
    acting = {row[0] for row in _TABLE}
    with _LIST.open(newline="", encoding="ascii") as file:
        for entry in csv.DictReader(file):
            if entry["name"] not in acting:
                kind = _TYPES[entry["type"]]
                minimum, maximum = _LIMITS[kind]
                value = float(entry["value"])
                yield ParameterDefinition(
                    entry["name"], kind, value, minimum, maximum, "kept, without effect here"
                )


DEFINITIONS: tuple[ParameterDefinition, ...] = tuple(_definitions())


def make_parameters(overrides: Mapping[str, float]) -> ParameterStore:
    """PX4's parameters with an airframe's values in place of the defaults.

    Raises:
        ParameterError: an override that does not exist here or is out of range.
    """
    return ParameterStore(DEFINITIONS, overrides)


def aiding_of(parameters: ParameterStore) -> Aiding:
    """What EKF2's parameters tell the estimator to lean on.

    Height is the pose's where it is the reference; where it is not, PX4 fuses it less an offset
    that it estimates, which changes nothing for long.  So it is with the horizontal position and
    the yaw beside satellites.
    """
    control, gnss = parameters.integer("EKF2_EV_CTRL"), parameters.integer("EKF2_GPS_CTRL")
    return Aiding(
        gnss=bool(gnss & 1),
        pose_horizontal=bool(control & 1),
        pose_height=bool(control & 2) and parameters.integer("EKF2_HGT_REF") == _EXTERNAL_HEIGHT,
        pose_yaw=bool(control & 8),
        pose_delay_s=parameters["EKF2_EV_DELAY"] * 1e-3,
        least_position_noise_m=parameters["EKF2_EVP_NOISE"],
        least_yaw_noise_rad=parameters["EKF2_EVA_NOISE"],
        noise_of_message=parameters.integer("EKF2_EV_NOISE_MD") == 0,
        least_quality=parameters.integer("EKF2_EV_QMIN"),
        lost_after_s=parameters["EKF2_NOAID_TOUT"] * 1e-6,
    )


def scale_timeouts(overrides: Mapping[str, float], speed: float) -> dict[str, float]:
    """Overrides with COM_OF_LOSS_T stretched by the simulation's speed.

    PX4 does so itself at start when its simulation runs faster than the clock of its clients.
    """
    scaled = dict(overrides)
    if speed > 1.0:
        longest_s = next(row.maximum for row in DEFINITIONS if row.name == "COM_OF_LOSS_T")
        scaled["COM_OF_LOSS_T"] = min(longest_s, scaled.get("COM_OF_LOSS_T", 1.0) * speed)
    return scaled
