"""An estimate whose heading is off, until the estimator aligns itself."""

from dataclasses import replace
from math import cos, sin

from sitl_shim.frames import quaternion_multiply
from sitl_shim.sensors.estimator import Estimate


def turned(estimate: Estimate, error_rad: float) -> Estimate:
    """The estimate with its attitude turned about up by an error."""
    half = 0.5 * error_rad
    attitude = quaternion_multiply((cos(half), 0.0, 0.0, sin(half)), estimate.attitude_flu_to_enu)
    return replace(estimate, attitude_flu_to_enu=attitude)
