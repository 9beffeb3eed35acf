"""Gusts of the Dryden model at low altitude (MIL-F-8785C, section 3.7.3.4).

Longitudinal shaping filter 1/(1 + T s); lateral and vertical (1 + sqrt 3 T s)/(1 + T s)^2,
with T the scale length over the speed at which the frozen turbulence passes.
"""

from math import exp, hypot, sqrt

import numpy as np

from sitl_shim.frames import Vector3
from sitl_shim.wind.turbulence import GRID_S

_FEET_PER_M = 1.0 / 0.3048
_LOWEST_FT = 10.0
_BLOCK = 1024


def low_altitude_scales(altitude_m: float) -> tuple[float, float, float]:
    """Scale lengths of the specification between 10 and 1000 ft.

    Args:
        altitude_m: above ground; below 10 ft it counts as 10 ft, where the formulas end.

    Returns:
        Horizontal scale length (m), vertical one (m), vertical over horizontal intensity.
    """
    height_ft = max(altitude_m * _FEET_PER_M, _LOWEST_FT)
    base = 0.177 + 0.000823 * height_ft
    return (height_ft / base**1.2 / _FEET_PER_M, height_ft / _FEET_PER_M, float(base**0.4))


class DrydenGusts:
    """Gusts about a mean wind, felt by a vehicle that stays about where it is."""

    __slots__ = (
        "_east",
        "_filters",
        "_generator",
        "_index",
        "_last",
        "_next",
        "_noise",
        "_north",
        "_states",
        "_time_next_s",
    )

    def __init__(
        self,
        *,
        intensity_m_s: float,
        altitude_m: float,
        passing_speed_m_s: float,
        direction_enu: Vector3,
        generator: np.random.Generator,
    ) -> None:
        """Set up the filters, already in their stationary state.

        Args:
            intensity_m_s: standard deviation of the horizontal components.
            altitude_m: above ground.
            passing_speed_m_s: speed of the air relative to the vehicle.
            direction_enu: of the mean wind; its vertical part is left out.
            generator: draws the gusts.
        """
        horizontal_m, vertical_m, ratio = low_altitude_scales(altitude_m)
        length = hypot(direction_enu[0], direction_enu[1])
        self._east, self._north = direction_enu[0] / length, direction_enu[1] / length
        slow, fast = horizontal_m / passing_speed_m_s, vertical_m / passing_speed_m_s
        decay = exp(-GRID_S / slow)
        self._filters = (
            (decay, intensity_m_s * sqrt(1.0 - decay * decay)),
            _second_order(slow, intensity_m_s),
            _second_order(fast, intensity_m_s * ratio),
        )
        self._generator = generator
        self._noise: list[list[float]] = []
        self._index = 0
        u, a, b, c, d = self._draw()
        # Stationary: unit variance of the first state, correlation 1/sqrt 2 with the second.
        half = sqrt(0.5)
        self._states = (intensity_m_s * u, a, half * (half * a + half * b), c,
                        half * (half * c + half * d))  # fmt: skip
        self._next = self._output()
        self._last = self._next
        self._time_next_s = 0.0
        self._advance()

    def velocity_enu_m_s(self, time_s: float, position_enu_m: Vector3) -> Vector3:
        """The gust (without the mean wind); times may not go back.

        Raises:
            ValueError: time ran back past what is still known.
        """
        while time_s > self._time_next_s:
            self._advance()
        share = 1.0 - (self._time_next_s - time_s) / GRID_S
        if share < -1e-6:
            raise ValueError(f"gusts cannot go back to {time_s} s")
        (a, b, c), (d, e, f) = self._last, self._next
        u, v, w = a + share * (d - a), b + share * (e - b), c + share * (f - c)
        return (self._east * u - self._north * v, self._north * u + self._east * v, w)

    def _advance(self) -> None:
        u, v1, v2, w1, w2 = self._states
        n0, n1, n2, n3, n4 = self._draw()
        (decay, kick), lateral, vertical = self._filters
        f, g, k11, k21, k22, _, _ = lateral
        h, i, m11, m21, m22, _, _ = vertical
        self._states = (
            decay * u + kick * n0,
            f * v1 + k11 * n1,
            g * v1 + f * v2 + k21 * n1 + k22 * n2,
            h * w1 + m11 * n3,
            i * w1 + h * w2 + m21 * n3 + m22 * n4,
        )
        self._last = self._next
        self._next = self._output()
        self._time_next_s += GRID_S

    def _output(self) -> Vector3:
        u, v1, v2, w1, w2 = self._states
        _, lateral, vertical = self._filters
        return (u, lateral[5] * v1 + lateral[6] * v2, vertical[5] * w1 + vertical[6] * w2)

    def _draw(self) -> list[float]:
        if self._index >= len(self._noise):
            self._noise = self._generator.standard_normal((_BLOCK, 5)).tolist()
            self._index = 0
        self._index += 1
        return self._noise[self._index - 1]


def _second_order(
    time_s: float, intensity_m_s: float
) -> tuple[float, float, float, float, float, float, float]:
    """Exact grid step of (1 + sqrt 3 T s)/(1 + T s)^2 driven by white noise.

    States: y1 = n/(1 + T s), scaled to unit variance, and y2 = y1/(1 + T s), whose stationary
    variance and covariance with y1 are then both 1/2.  The transition over h is
    e^(-h/T) [[1, 0], [h/T, 1]] and the noise's covariance is P - F P F', in Cholesky factors.

    Returns:
        Diagonal and lower-left of the transition, the three entries of the noise's factor,
        and the two weights of the output sqrt 3 y1 + (1 - sqrt 3) y2, scaled to the intensity.
    """
    step = GRID_S / time_s
    diagonal = exp(-step)
    lower = step * diagonal
    var1 = 1.0 - diagonal * diagonal
    cov = 0.5 - diagonal * (lower + 0.5 * diagonal)
    var2 = 0.5 - (lower * lower + 2.0 * 0.5 * lower * diagonal + 0.5 * diagonal * diagonal)
    k11 = sqrt(var1)
    k21 = cov / k11
    k22 = sqrt(max(0.0, var2 - k21 * k21))
    # Var(sqrt 3 y1 + (1 - sqrt 3) y2) = 3 + (1 - sqrt 3)^2/2 + sqrt 3 (1 - sqrt 3) = 2
    root3 = sqrt(3.0)
    scale = intensity_m_s / sqrt(2.0)
    return (diagonal, lower, k11, k21, k22, scale * root3, scale * (1.0 - root3))
