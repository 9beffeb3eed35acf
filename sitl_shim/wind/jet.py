"""A fan's jet: a straight stream with a Gaussian profile, turbulent, fixed in the room."""

from math import exp, hypot, sqrt

import numpy as np

from sitl_shim.frames import Vector3
from sitl_shim.wind.turbulence import FirstOrderNoise

_CUT = 2.5


class FanJet:
    """Air that streams along an axis, fastest on it, from the fan onwards.

    Turbulence is a fraction of the local mean speed, alike in the three directions.  The jet
    neither widens nor slows with distance, as a fan's does not within a few of its diameters.
    Fluctuations are cut at 2.5 standard deviations (which takes 1 % off their size): a fan has no
    gusts without bound, and a flight's peak push should not hang on one rare draw.
    """

    __slots__ = (
        "_direction",
        "_noise",
        "_origin",
        "_peak_m_s",
        "_reach_m",
        "_swing",
        "_width_m",
    )

    def __init__(
        self,
        *,
        crossing_enu_m: Vector3,
        direction_enu: Vector3,
        fan_distance_m: float,
        peak_m_s: float,
        width_m: float,
        turbulence: float,
        correlation_time_s: float,
        generator: np.random.Generator,
    ) -> None:
        """Place the jet.

        Args:
            crossing_enu_m: a point of the axis.
            direction_enu: where it blows to; any length but zero.
            fan_distance_m: the fan stands this far upstream of that point; behind it is calm.
            peak_m_s: mean speed on the axis.
            width_m: standard deviation of the profile across the axis.
            turbulence: rms of the fluctuation, as a vector, over the local mean speed.
            correlation_time_s: of the turbulence.
            generator: draws the turbulence.
        """
        length = hypot(*direction_enu)
        x, y, z = direction_enu
        self._direction = (x / length, y / length, z / length)
        self._origin = crossing_enu_m
        self._reach_m = -fan_distance_m
        self._peak_m_s = peak_m_s
        self._width_m = width_m
        self._swing = turbulence / sqrt(3.0)
        self._noise = FirstOrderNoise(correlation_time_s, generator)

    def velocity_enu_m_s(self, time_s: float, position_enu_m: Vector3) -> Vector3:
        """Velocity of the air; times may not go back."""
        dx, dy, dz = self._direction
        ox, oy, oz = self._origin
        rx, ry, rz = position_enu_m[0] - ox, position_enu_m[1] - oy, position_enu_m[2] - oz
        along = rx * dx + ry * dy + rz * dz
        if along < self._reach_m:
            return (0.0, 0.0, 0.0)
        across2 = (rx * rx + ry * ry + rz * rz - along * along) / (self._width_m * self._width_m)
        if across2 > 50.0:
            return (0.0, 0.0, 0.0)
        mean = self._peak_m_s * exp(-0.5 * across2)
        a, b, c = self._noise.at(time_s)
        nx = _CUT if a > _CUT else -_CUT if a < -_CUT else a
        ny = _CUT if b > _CUT else -_CUT if b < -_CUT else b
        nz = _CUT if c > _CUT else -_CUT if c < -_CUT else c
        swing = self._swing * mean
        return (mean * dx + swing * nx, mean * dy + swing * ny, mean * dz + swing * nz)
