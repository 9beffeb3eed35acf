"""Horizontal control: a shaped target, then position P and velocity PID, then a lean.

ArduPilot's AC_PosControl, horizontal axes, in metres, east and north.
"""

import math

from sitl_shim.autopilot.ardupilot.laws import sqrt_controller
from sitl_shim.autopilot.ardupilot.shaping import (
    Pair,
    limit_length,
    shape_position_xy,
    shape_velocity_xy,
)
from sitl_shim.autopilot.filters import first_order_gain
from sitl_shim.autopilot.interface import TICK_RATE_HZ, TICK_S, EstimateStep, Motion
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Quaternion, Vector3

_GRAVITY_M_S2 = 9.80665
_NOTHING: Pair = (0.0, 0.0)


class PositionControl:
    """The horizontal target and the cascade that follows it."""

    __slots__ = (
        "_d",
        "_derivative",
        "_error",
        "_filter_d",
        "_filter_e",
        "_i",
        "_integral",
        "_integral_max",
        "_jerk",
        "_lean_max",
        "_p",
        "_pos_p",
        "_wanted",
        "acceleration",
        "acceleration_max",
        "active",
        "position",
        "speed_max",
        "velocity",
    )

    def __init__(self, parameters: ParameterStore) -> None:
        self.active = False
        """Whether it was in charge in the last period."""
        self.position = self.velocity = self.acceleration = _NOTHING
        """Of the target."""
        self._integral = self._error = self._derivative = self._wanted = _NOTHING
        self.configure(parameters)
        self.set_limits(parameters["WPNAV_SPEED"] * 0.01, parameters["WPNAV_ACCEL"] * 0.01)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains and limits anew."""
        p = parameters
        self._pos_p = p["PSC_NE_POS_P"]
        self._p, self._i, self._d = p["PSC_NE_VEL_P"], p["PSC_NE_VEL_I"], p["PSC_NE_VEL_D"]
        self._integral_max = p["PSC_NE_VEL_IMAX"]
        self._filter_e = first_order_gain(TICK_RATE_HZ, p["PSC_NE_VEL_FLTE"])
        self._filter_d = first_order_gain(TICK_RATE_HZ, p["PSC_NE_VEL_FLTD"])
        self._jerk = p["PSC_JERK_NE"]
        self._lean_max = _GRAVITY_M_S2 * math.tan(math.radians(0.01 * p["ANGLE_MAX"]))

    def set_limits(self, speed_m_s: float, acceleration_m_s2: float) -> None:
        """Limits of the target's motion."""
        self.speed_max, self.acceleration_max = speed_m_s, acceleration_m_s2

    def start(self, motion: Motion, attitude: Quaternion) -> None:
        """Take over without a bump from whoever leaned the vehicle this far."""
        self.active = True
        x, y, _ = motion.position_enu_m
        vx, vy, _ = motion.velocity_enu_m_s
        ax, ay, _ = motion.acceleration_enu_m_s2
        self.position, self.velocity = (x, y), (vx, vy)
        self.acceleration = limit_length((ax, ay), self.acceleration_max)
        leans = limit_length(_lean(attitude), self._lean_max)
        self._integral = (leans[0] - self.acceleration[0], leans[1] - self.acceleration[1])
        self._error = self._derivative = _NOTHING

    def settle(self, motion: Motion) -> None:
        """Hold the target where the vehicle is: it stands on the ground."""
        self.start(motion, (1.0, 0.0, 0.0, 0.0))
        self.velocity = self.acceleration = self._integral = _NOTHING

    def note_reset(self, step: EstimateStep) -> None:
        """The estimate was set anew: the target goes along."""
        (x, y), (vx, vy) = self.position, self.velocity
        self.position = (x + step.position_enu_m[0], y + step.position_enu_m[1])
        self.velocity = (vx + step.velocity_enu_m_s[0], vy + step.velocity_enu_m_s[1])

    def follow_velocity(self, velocity: Pair, acceleration: Pair = _NOTHING) -> None:
        """Move the target one period on, towards a velocity."""
        self._move()
        self.acceleration = shape_velocity_xy(
            velocity,
            acceleration,
            self.velocity,
            self.acceleration,
            acceleration_max=self.acceleration_max,
            jerk_max=self._jerk,
        )

    def follow_position(
        self, position: Pair, velocity: Pair = _NOTHING, acceleration: Pair = _NOTHING
    ) -> None:
        """Move the target one period on, towards a position and the motion there."""
        self._move()
        self.acceleration = shape_position_xy(
            (position, velocity, acceleration),
            (self.position, self.velocity, self.acceleration),
            speed_max=self.speed_max,
            acceleration_max=self.acceleration_max,
            jerk_max=self._jerk,
        )

    def _move(self) -> None:
        (x, y), (vx, vy), (ax, ay) = self.position, self.velocity, self.acceleration
        half = 0.5 * TICK_S * TICK_S
        self.position = (x + vx * TICK_S + ax * half, y + vy * TICK_S + ay * half)
        self.velocity = (vx + ax * TICK_S, vy + ay * TICK_S)

    def update(self, motion: Motion) -> Vector3:
        """The body's z axis that is wanted, ENU, unit norm."""
        self.active = True
        x, y, _ = motion.position_enu_m
        vx, vy, _ = motion.velocity_enu_m_s
        ex, ey = self.position[0] - x, self.position[1] - y
        distance = math.hypot(ex, ey)
        wx, wy = self.velocity
        if distance > 1e-9:
            rate = sqrt_controller(distance, self._pos_p, self.acceleration_max) / distance
            wx, wy = wx + rate * ex, wy + rate * ey
        filtered_x, filtered_y = self._error
        gain = self._filter_e
        new_x = filtered_x + gain * (wx - vx - filtered_x)
        new_y = filtered_y + gain * (wy - vy - filtered_y)
        dx, dy = self._derivative
        gain = self._filter_d
        dx += gain * ((new_x - filtered_x) / TICK_S - dx)
        dy += gain * ((new_y - filtered_y) / TICK_S - dy)
        self._error, self._derivative = (new_x, new_y), (dx, dy)
        ix, iy = self._integral
        ax = self.acceleration[0] + self._p * new_x + self._d * dx + ix
        ay = self.acceleration[1] + self._p * new_y + self._d * dy + iy
        limited = limit_length((ax, ay), self._lean_max)
        if limited == (ax, ay) or new_x * ix + new_y * iy < 0.0:
            step = self._i * TICK_S
            total = (ix + step * new_x, iy + step * new_y)
            self._integral = limit_length(total, self._integral_max)
        self._wanted = limited
        ax, ay = limited
        norm = math.sqrt(ax * ax + ay * ay + _GRAVITY_M_S2 * _GRAVITY_M_S2)
        return (ax / norm, ay / norm, _GRAVITY_M_S2 / norm)


def _lean(attitude: Quaternion) -> Pair:
    """Horizontal acceleration that an attitude gives in hover, m/s2."""
    w, x, y, z = attitude
    up = max(0.3, 1.0 - 2.0 * (x * x + y * y))
    scale = _GRAVITY_M_S2 / up
    return (2.0 * (x * z + w * y) * scale, 2.0 * (y * z - w * x) * scale)
