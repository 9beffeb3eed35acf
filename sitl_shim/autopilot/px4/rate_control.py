"""Rate control: from body-rate setpoints to normalised torques.

PX4's rate controller (src/lib/rate_control) behind its gyro filters
(src/modules/sensors/vehicle_angular_velocity).
"""

import math

from sitl_shim.autopilot.filters import SecondOrderLowPass, first_order_gain
from sitl_shim.autopilot.interface import TICK_RATE_HZ, TICK_S
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Vector3

_FULL_ERROR_RAD_S = math.radians(400.0)
"""The integrator slows down towards this error, so that it does not wind up in a flip."""


class _Axis:
    """PID of one axis, with its gyro filter and its filtered derivative."""

    __slots__ = (
        "_acceleration",
        "_d",
        "_d_gain",
        "_feedforward",
        "_filter",
        "_i",
        "_limit",
        "_p",
        "_rate",
        "integral",
    )

    def __init__(self) -> None:
        self.integral = 0.0
        self._rate = 0.0
        self._acceleration = 0.0

    def configure(self, parameters: ParameterStore, name: str, limit_name: str) -> None:
        gain = parameters[f"MC_{name}RATE_K"]
        self._p = gain * parameters[f"MC_{name}RATE_P"]
        self._i = gain * parameters[f"MC_{name}RATE_I"]
        self._d = gain * parameters[f"MC_{name}RATE_D"]
        self._feedforward = parameters[f"MC_{name}RATE_FF"]
        self._limit = parameters[limit_name]
        self._filter = SecondOrderLowPass(TICK_RATE_HZ, parameters["IMU_GYRO_CUTOFF"])
        self._d_gain = first_order_gain(TICK_RATE_HZ, parameters["IMU_DGYRO_CUTOFF"])

    def step(self, measured: float, setpoint: float, held: bool, saturated: int) -> float:
        """One period.

        Args:
            measured: body rate, rad/s.
            setpoint: body rate, rad/s; NaN gives no torque and leaves the integrator alone.
            held: on the ground, where nothing is to be learned.
            saturated: sign of the torque that could not be given whole last time, else 0.
        """
        rate = self._filter.step(measured)
        self._acceleration += self._d_gain * ((rate - self._rate) / TICK_S - self._acceleration)
        self._rate = rate
        error = setpoint - rate
        torque = (
            self._p * error
            + self.integral
            - self._d * self._acceleration
            + self._feedforward * setpoint
        )
        if torque != torque:  # NaN
            return 0.0
        if held:
            self.integral = 0.0
        elif saturated == 0 or saturated * error < 0.0:
            share = error / _FULL_ERROR_RAD_S
            share = 1.0 - share * share
            if share > 0.0:
                integral = self.integral + share * self._i * error * TICK_S
                limit = self._limit
                self.integral = min(limit, max(-limit, integral))
        return -1.0 if torque < -1.0 else 1.0 if torque > 1.0 else torque


class RateControl:
    """PID of the three body rates (FLU)."""

    __slots__ = ("_pitch", "_roll", "_yaw")

    def __init__(self, parameters: ParameterStore) -> None:
        self._roll, self._pitch, self._yaw = _Axis(), _Axis(), _Axis()
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains and filters anew; the integrators stay."""
        self._roll.configure(parameters, "ROLL", "MC_RR_INT_LIM")
        self._pitch.configure(parameters, "PITCH", "MC_PR_INT_LIM")
        self._yaw.configure(parameters, "YAW", "MC_YR_INT_LIM")

    def update(
        self,
        rate_flu_rad_s: Vector3,
        setpoint_flu_rad_s: Vector3,
        *,
        held: bool,
        saturated: tuple[int, int, int],
    ) -> Vector3:
        """Normalised torques about the body axes (FLU), each within -1 to 1."""
        return (
            self._roll.step(rate_flu_rad_s[0], setpoint_flu_rad_s[0], held, saturated[0]),
            self._pitch.step(rate_flu_rad_s[1], setpoint_flu_rad_s[1], held, saturated[1]),
            self._yaw.step(rate_flu_rad_s[2], setpoint_flu_rad_s[2], held, saturated[2]),
        )
