"""When the vehicle may be armed, and what SYS_STATUS says of it, as recorded."""

from sitl_shim.autopilot.ardupilot.modes import Mode
from sitl_shim.autopilot.interface import EstimatorState, SensorHealth

_PREARM_CHECK = 0x10000000
_LOGGING = 0x01000000
_AHRS = 0x00200000
_XY_CONTROL, _Z_CONTROL = 0x4000, 0x2000
_GPS = 0x20
_PRESENT, _ENABLED, _HEALTH = 0x5371FC0F, 0x52419C0F, 0x47519C0F


def refusals(
    mode: Mode,
    estimator: EstimatorState,
    *,
    ready: bool,
    gyros_consistent: bool,
    forced: bool,
) -> list[str]:
    """What stands against arming; forcing gets past all but what is mandatory."""
    if not ready:
        return ["System not initialised"]
    reasons = []
    if not (gyros_consistent or forced):
        reasons.append("Gyros inconsistent")
    if not (estimator.origin_known or forced):
        reasons.append("AHRS: waiting for home")
    elif mode.needs_position and not estimator.position_known:
        reasons.append("Need Position Estimate")
    return reasons


def sensor_health(
    estimator: EstimatorState,
    *,
    ahrs_healthy: bool,
    checks_pass: bool,
    logging: bool,
    xy_controlled: bool,
    z_controlled: bool,
) -> SensorHealth:
    """SYS_STATUS: the bits of what is controlled are set while it is."""
    varying = _GPS if estimator.gps_fix else 0
    controlled = (_XY_CONTROL if xy_controlled else 0) | (_Z_CONTROL if z_controlled else 0)
    healthy = varying | controlled | (_AHRS if ahrs_healthy else 0)
    return SensorHealth(
        _PRESENT | varying,
        _ENABLED | healthy | (_LOGGING if logging else 0),
        _HEALTH | healthy | (_PREARM_CHECK if checks_pass else 0),
    )
