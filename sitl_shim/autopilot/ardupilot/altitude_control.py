"""Vertical control: a shaped target, then position P, velocity P and acceleration PI.

ArduPilot's AC_PosControl, vertical axis, in metres and up.
"""

from sitl_shim.autopilot.ardupilot.laws import sqrt_controller
from sitl_shim.autopilot.ardupilot.shaping import shape_position, shape_velocity
from sitl_shim.autopilot.filters import first_order_gain
from sitl_shim.autopilot.interface import TICK_RATE_HZ, TICK_S, EstimateStep, Motion
from sitl_shim.autopilot.parameters import ParameterStore

THROTTLE_FILTER_HZ = 2.0
"""Of the throttle that comes from here."""


class AltitudeControl:
    """The vertical target and the cascade that follows it."""

    __slots__ = (
        "_acc_filter",
        "_acc_i",
        "_acc_limit",
        "_acc_p",
        "_acceleration_error",
        "_integral",
        "_jerk",
        "_pos_p",
        "_vel_filter",
        "_vel_p",
        "_velocity_error",
        "acceleration",
        "acceleration_max",
        "active",
        "position",
        "speed_down",
        "speed_up",
        "velocity",
    )

    def __init__(self, parameters: ParameterStore) -> None:
        self.active = False
        """Whether it was in charge in the last period."""
        self.position = self.velocity = self.acceleration = 0.0
        """Of the target, up."""
        self._integral = 0.0
        self._velocity_error = self._acceleration_error = 0.0
        self.configure(parameters)
        self.set_limits(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains anew."""
        p = parameters
        self._pos_p, self._vel_p = p["PSC_D_POS_P"], p["PSC_D_VEL_P"]
        self._acc_p, self._acc_i = p["PSC_D_ACC_P"], p["PSC_D_ACC_I"]
        self._acc_limit = p["PSC_D_ACC_IMAX"]
        self._vel_filter = first_order_gain(TICK_RATE_HZ, p["PSC_D_VEL_FLTE"])
        self._acc_filter = first_order_gain(TICK_RATE_HZ, p["PSC_D_ACC_FLTE"])
        self._jerk = p["PSC_JERK_D"]

    def set_limits(self, parameters: ParameterStore) -> None:
        """Speeds and acceleration of autonomous modes and GUIDED."""
        self.speed_up = parameters["WPNAV_SPEED_UP"] * 0.01
        self.speed_down = parameters["WPNAV_SPEED_DN"] * 0.01
        self.acceleration_max = parameters["WPNAV_ACCEL_Z"] * 0.01

    def start(self, motion: Motion, throttle: float, hover: float) -> None:
        """Take over without a bump from whoever gave this throttle."""
        self.active = True
        self.position = motion.position_enu_m[2]
        self.velocity = motion.velocity_enu_m_s[2]
        limit = self.acceleration_max
        self.acceleration = max(-limit, min(limit, motion.acceleration_enu_m_s2[2]))
        self._velocity_error = 0.0
        self._acceleration_error = 0.0
        self._integral = throttle - hover

    def note_reset(self, step: EstimateStep) -> None:
        """The estimate was set anew: the target goes along."""
        self.position += step.position_enu_m[2]
        self.velocity += step.velocity_enu_m_s[2]

    def climb(self, rate_m_s: float, *, limited: int = 0, position_error: float = 0.0) -> None:
        """Move the target one period on, towards a climb rate.

        Args:
            rate_m_s: wanted.
            limited: -1 throttle at the bottom, +1 at the top.
            position_error: of the vehicle against the target.
        """
        self._move(limited, position_error)
        self.acceleration = shape_velocity(
            rate_m_s,
            0.0,
            self.velocity,
            self.acceleration,
            acceleration_max=self.acceleration_max,
            jerk_max=self._jerk,
        )

    def approach(self, goal_m: float, velocity_m_s: float = 0.0) -> None:
        """Move the target one period on, towards a height and the velocity there."""
        self._move(0, 0.0)
        self.acceleration = shape_position(
            (goal_m, velocity_m_s),
            (self.position, self.velocity, self.acceleration),
            velocity_down=self.speed_down,
            velocity_up=self.speed_up,
            acceleration_max=self.acceleration_max,
            jerk_max=self._jerk,
        )

    def _move(self, limited: int, position_error: float) -> None:
        step = self.velocity * TICK_S + 0.5 * self.acceleration * TICK_S * TICK_S
        if not (step * limited > 0.0 and position_error * limited > 0.0):
            self.position += step
        change = self.acceleration * TICK_S
        if not (change * limited > 0.0 and self._velocity_error * limited > 0.0):
            self.velocity += change

    def update(self, motion: Motion, hover: float, *, at_bottom: bool, at_top: bool) -> float:
        """Throttle of this period, before angle boost and filter."""
        self.active = True
        z, climb = motion.position_enu_m[2], motion.velocity_enu_m_s[2]
        error = self.position - z
        low, high = -self.speed_down / self._pos_p * 2.0, self.speed_up / self._pos_p * 2.0
        if error < low or error > high:
            error = max(low, min(high, error))
            self.position = z + error
        velocity = self.velocity + sqrt_controller(error, self._pos_p, self.acceleration_max)
        self._velocity_error += self._vel_filter * (velocity - climb - self._velocity_error)
        wanted = self.acceleration + self._vel_p * self._velocity_error
        raw = wanted - motion.acceleration_enu_m_s2[2]
        self._acceleration_error += self._acc_filter * (raw - self._acceleration_error)
        error = self._acceleration_error
        if not ((at_bottom and error < 0.0) or (at_top and error > 0.0)):
            limit = max(self._acc_limit, hover)
            integral = self._integral + self._acc_i * error * TICK_S
            self._integral = max(-limit, min(limit, integral))
        return hover + self._acc_p * error + self._integral
