"""Rate control: from body-rate setpoints to normalised torques (ArduPilot's AC_PID)."""

from sitl_shim.autopilot.filters import SecondOrderLowPass, first_order_gain
from sitl_shim.autopilot.interface import TICK_RATE_HZ, TICK_S
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Vector3


class _Axis:
    """PID of one axis, with its gyro filter."""

    __slots__ = (
        "_d",
        "_derivative",
        "_error",
        "_feedforward",
        "_filter",
        "_filter_d",
        "_filter_e",
        "_filter_t",
        "_i",
        "_limit",
        "_p",
        "_target",
        "integral",
    )

    def __init__(self) -> None:
        self.integral = 0.0
        self._target: float | None = None
        self._error = self._derivative = 0.0

    def configure(self, parameters: ParameterStore, name: str) -> None:
        prefix = f"ATC_RAT_{name}_"
        p = parameters
        self._p, self._i, self._d = p[prefix + "P"], p[prefix + "I"], p[prefix + "D"]
        self._feedforward, self._limit = p[prefix + "FF"], p[prefix + "IMAX"]
        self._filter = SecondOrderLowPass(TICK_RATE_HZ, p["INS_GYRO_FILTER"])
        self._filter_t = first_order_gain(TICK_RATE_HZ, p[prefix + "FLTT"])
        self._filter_e = first_order_gain(TICK_RATE_HZ, p[prefix + "FLTE"])
        self._filter_d = first_order_gain(TICK_RATE_HZ, p[prefix + "FLTD"])

    def reset(self) -> None:
        self.integral = 0.0
        self._target = None

    def step(self, measured: float, setpoint: float, *, limited: bool) -> float:
        """One period: torque, -1 to 1.

        Args:
            measured: body rate, rad/s.
            setpoint: body rate, rad/s.
            limited: the motors could not give what was asked for last time.
        """
        rate = self._filter.step(measured)
        if self._target is None:
            self._target = setpoint
            self._error = setpoint - rate
            self._derivative = 0.0
        else:
            self._target += self._filter_t * (setpoint - self._target)
            last = self._error
            self._error += self._filter_e * (self._target - rate - last)
            raw = (self._error - last) / TICK_S
            self._derivative += self._filter_d * (raw - self._derivative)
        error = self._error
        if not limited or self.integral * error < 0.0:
            integral = self.integral + self._i * error * TICK_S
            limit = self._limit
            self.integral = -limit if integral < -limit else limit if integral > limit else integral
        torque = (
            self._p * error
            + self.integral
            + self._d * self._derivative
            + self._feedforward * self._target
        )
        return -1.0 if torque < -1.0 else 1.0 if torque > 1.0 else torque


class RateControl:
    """PID of the three body rates (FLU)."""

    __slots__ = ("_pitch", "_roll", "_yaw")

    def __init__(self, parameters: ParameterStore) -> None:
        self._roll, self._pitch, self._yaw = _Axis(), _Axis(), _Axis()
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains and filters anew; the integrators stay."""
        self._roll.configure(parameters, "RLL")
        self._pitch.configure(parameters, "PIT")
        self._yaw.configure(parameters, "YAW")

    def reset(self) -> None:
        """Forget the past: the motors did not obey."""
        self._roll.reset()
        self._pitch.reset()
        self._yaw.reset()

    def update(
        self, rate_flu_rad_s: Vector3, setpoint_flu_rad_s: Vector3, limits: tuple[bool, bool]
    ) -> Vector3:
        """Normalised torques about the body axes (FLU), each within -1 to 1.

        Args:
            rate_flu_rad_s: measured.
            setpoint_flu_rad_s: wanted.
            limits: whether roll and pitch, and yaw, were cut by the motors.
        """
        tilt, yaw = limits
        return (
            self._roll.step(rate_flu_rad_s[0], setpoint_flu_rad_s[0], limited=tilt),
            self._pitch.step(rate_flu_rad_s[1], setpoint_flu_rad_s[1], limited=tilt),
            self._yaw.step(rate_flu_rad_s[2], setpoint_flu_rad_s[2], limited=yaw),
        )
