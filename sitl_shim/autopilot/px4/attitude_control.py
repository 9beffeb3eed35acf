"""Attitude control: from an attitude setpoint to body-rate setpoints.

PX4's quaternion attitude controller (src/modules/mc_att_control/AttitudeControl), after
D. Brescianini, M. Hehn, R. D'Andrea, "Nonlinear Quadrocopter Attitude Control", ETH Zurich 2013.
"""

import math

from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.laws import AttitudeGains, attitude_rates
from sitl_shim.compiled import FLOAT, compiled
from sitl_shim.frames import Quaternion, Vector3


class AttitudeControl:
    """Proportional control of the attitude; tilt first, yaw by its weight.

    The law is the same in any pair of frames; here it is body FLU, world ENU.
    """

    __slots__ = ("_gains", "_law")

    def __init__(self, parameters: ParameterStore) -> None:
        self._law = compiled(attitude_rates, 7, 4, 4, FLOAT)
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains and limits anew."""
        weight = parameters["MC_YAW_WEIGHT"]
        yaw_gain = parameters["MC_YAW_P"]
        if weight > 1e-4:
            yaw_gain /= weight
        self._gains: AttitudeGains = (
            weight,
            parameters["MC_ROLL_P"],
            parameters["MC_PITCH_P"],
            yaw_gain,
            math.radians(parameters["MC_ROLLRATE_MAX"]),
            math.radians(parameters["MC_PITCHRATE_MAX"]),
            math.radians(parameters["MC_YAWRATE_MAX"]),
        )

    def update(
        self, attitude: Quaternion, setpoint: Quaternion, yaw_rate_feedforward_rad_s: float
    ) -> Vector3:
        """Body rates (FLU, rad/s) that turn ``attitude`` into ``setpoint`` (FLU to ENU).

        Args:
            attitude: where the vehicle is, unit norm.
            setpoint: where it should be, of any norm but zero; NaN gives NaN rates.
            yaw_rate_feedforward_rad_s: about the world's z axis (up), added to the law's.
        """
        return self._law(self._gains, attitude, setpoint, yaw_rate_feedforward_rad_s)
