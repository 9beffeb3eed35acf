"""Attitude control: from an attitude or rates asked for to body-rate setpoints.

ArduPilot's AC_AttitudeControl: a target that moves with limited acceleration towards what is
asked for, its rate fed forward, and a proportional law on what separates the vehicle from it,
tilt and heading apart.  The law is the same in any pair of frames; here body FLU, world ENU.
"""

import math

from sitl_shim.autopilot.ardupilot import laws
from sitl_shim.autopilot.ardupilot.laws import AttitudeGains, Shape
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.compiled import BOOLEAN, compiled
from sitl_shim.frames import Quaternion, Vector3, quaternion_multiply

_RP_CORRECTION_RAD_S2 = (math.radians(40.0), math.radians(720.0))
_YAW_CORRECTION_RAD_S2 = (math.radians(10.0), math.radians(120.0))


class AttitudeControl:
    """The attitude target and the law that follows it."""

    __slots__ = (
        "_follow_attitude",
        "_follow_rates",
        "_gains",
        "_shape",
        "_shapes",
        "rates",
        "target",
        "target_rate",
    )

    def __init__(self, parameters: ParameterStore) -> None:
        self.target: Quaternion = (1.0, 0.0, 0.0, 0.0)
        """FLU to ENU."""
        self.target_rate: Vector3 = (0.0, 0.0, 0.0)
        """Of the target, in its own axes, rad/s."""
        self.rates: Vector3 = (0.0, 0.0, 0.0)
        """Body-rate setpoints, FLU, rad/s."""
        self._follow_attitude = compiled(
            laws.follow_attitude, *(6, 7, 4, 3, 4, 4, 3, BOOLEAN), parts=laws.ATTITUDE_PARTS
        )
        self._follow_rates = compiled(
            laws.follow_rates, *(6, 7, 4, 3, 4, 3, BOOLEAN), parts=laws.ATTITUDE_PARTS
        )
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains and limits anew."""
        p = parameters
        centi = math.radians(0.01)
        roll, pitch, yaw = (centi * p[f"ATC_ACCEL_{axis}_MAX"] for axis in "RPY")
        low, high = _RP_CORRECTION_RAD_S2
        yaw_low, yaw_high = _YAW_CORRECTION_RAD_S2
        self._gains: AttitudeGains = (
            p["ATC_ANG_RLL_P"],
            p["ATC_ANG_PIT_P"],
            p["ATC_ANG_YAW_P"],
            max(low, min(high, 0.5 * roll)) if roll > 0.0 else 0.0,
            max(low, min(high, 0.5 * pitch)) if pitch > 0.0 else 0.0,
            max(yaw_low, min(yaw_high, 0.5 * yaw)) if yaw > 0.0 else 0.0,
        )
        x, y, z = (math.radians(p[f"ATC_RATE_{axis}_MAX"]) for axis in "RPY")
        self._shape: Shape = (roll, pitch, yaw, x, y, z, p["ATC_INPUT_TC"])
        self._shapes = p["ATC_RATE_FF_ENAB"] == 1.0

    def reset(self, attitude: Quaternion) -> None:
        """Begin where the vehicle is, at rest."""
        self.target = attitude
        self.target_rate = self.rates = (0.0, 0.0, 0.0)

    def turn(self, correction: Quaternion) -> None:
        """The estimator's heading jumped: turn the target along, so that nothing is felt.

        Args:
            correction: rotation about up that the estimate made.
        """
        self.target = quaternion_multiply(correction, self.target)

    def follow_attitude(
        self, attitude: Quaternion, wanted: Quaternion, rate: Vector3 = (0.0, 0.0, 0.0)
    ) -> None:
        """One period towards an attitude.

        Args:
            attitude: where the vehicle is, unit norm.
            wanted: where it should be, unit norm.
            rate: body rates to have there, in the axes of ``wanted``.
        """
        self.target, self.target_rate, self.rates = self._follow_attitude(
            self._gains,
            self._shape,
            self.target,
            self.target_rate,
            attitude,
            wanted,
            rate,
            self._shapes,
        )

    def follow_rates(self, attitude: Quaternion, rates: Vector3) -> None:
        """One period of turning at body rates (FLU, rad/s)."""
        self.target, self.target_rate, self.rates = self._follow_rates(
            self._gains,
            self._shape,
            self.target,
            self.target_rate,
            attitude,
            rates,
            self._shapes,
        )
