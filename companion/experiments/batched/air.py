"""The air of many vehicles: steady winds, Dryden gusts and fans' jets, as scenarios say them.

The same formulas as the simulator's (MIL-F-8785C at low altitude; a Gaussian jet with first-order
turbulence, cut), with draws of their own: of one seed the gusts differ, their statistics do not.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from companion.control.reference_model import Array
from companion.experiments.batched.draws import Draws

_FEET_PER_M = 1.0 / 0.3048
_LOWEST_FT = 10.0
_CUT = 2.5
_STREAM = 2


class Air:
    """Velocities of the air at the vehicles, step by step."""

    def __init__(
        self, winds: Sequence[Sequence[dict[str, Any]]], seeds: Sequence[int], step_s: float
    ) -> None:
        """Set up.

        Args:
            winds: of each vehicle's scenario.
            seeds: of each vehicle.
            step_s: between two looks.
        """
        self._steady = np.zeros((3, len(seeds)))
        for k, said in enumerate(winds):
            for wind in said:
                if wind["kind"] == "steady":
                    self._steady[:, k] += wind["velocity_enu_m_s"]
        self._parts: list[_Gusts | _Jets] = []
        for kind, part in (("dryden", _Gusts), ("jet", _Jets)):
            with_it = [
                (k, wind) for k, said in enumerate(winds) for wind in said if wind["kind"] == kind
            ]
            if with_it:
                where = np.array([k for k, _ in with_it])
                own = [seeds[k] for k in where]
                self._parts.append(part(where, [wind for _, wind in with_it], own, step_s))
        self.still = not self._parts and not self._steady.any()

    def velocity(self, position_m: Array) -> Array:
        """Of the air, ENU (3, vehicles), at the next step."""
        if not self._parts:
            return self._steady
        velocity: Array = self._steady.copy()
        for part in self._parts:
            velocity[:, part.where] += part.velocity(position_m[:, part.where])
        return velocity


class _Gusts:
    """Dryden gusts: 1/(1 + T s) along, (1 + √3 T s)/(1 + T s)² across and vertically.

    First-order stages in a row, each exact for an input held over a step.
    """

    def __init__(
        self, where: Array, winds: Sequence[dict[str, Any]], seeds: Sequence[int], step_s: float
    ) -> None:
        self.where = where
        scales = np.array([_scales(wind["altitude_m"]) for wind in winds])
        passing = np.array([wind["passing_speed_m_s"] for wind in winds])
        intensity = np.array([wind["intensity_m_s"] for wind in winds])
        towards = np.array([wind["direction_enu"][:2] for wind in winds], dtype=float)
        self._east, self._north = (towards / np.linalg.norm(towards, axis=1)[:, None]).T
        along, vertical = scales[:, 0] / passing, scales[:, 1] / passing
        self._decay = np.exp(-step_s / np.stack([along, along, vertical]))
        self._kick = np.sqrt(1.0 - self._decay**2)
        self._size = np.stack([intensity, intensity, intensity * scales[:, 2]])
        self._draws = Draws(seeds, _STREAM, 3)
        # About where it will be: unit variance, and a correlation of 1/2 between the two stages.
        first = Draws(seeds, _STREAM + 1, 6).next().astype(float)
        self._first = first[:3]
        self._second = 0.5 * first[:3] + 0.5 * first[3:]

    def velocity(self, position_m: Array) -> Array:
        before = self._first
        self._first = self._decay * before + self._kick * self._draws.next()
        middle = 0.5 * (before + self._first)
        self._second = self._decay * self._second + (1.0 - self._decay) * middle
        across = (math.sqrt(3.0) * self._first + (1.0 - math.sqrt(3.0)) * self._second) / math.sqrt(
            2.0
        )
        u, v, w = self._size * np.stack([self._first[0], across[1], across[2]])
        return np.stack([self._east * u - self._north * v, self._north * u + self._east * v, w])


class _Jets:
    """Straight streams with a Gaussian profile, turbulent, from the fan onwards."""

    def __init__(
        self, where: Array, winds: Sequence[dict[str, Any]], seeds: Sequence[int], step_s: float
    ) -> None:
        self.where = where
        direction = np.array([wind["direction_enu"] for wind in winds], dtype=float)
        self._direction = (direction / np.linalg.norm(direction, axis=1)[:, None]).T
        self._origin = np.array([wind["crossing_enu_m"] for wind in winds], dtype=float).T
        self._reach = -np.array([wind["fan_distance_m"] for wind in winds])
        self._peak = np.array([wind["peak_m_s"] for wind in winds])
        self._width = np.array([wind["width_m"] for wind in winds])
        self._swing = np.array([wind["turbulence"] for wind in winds]) / math.sqrt(3.0)
        self._decay = np.exp(-step_s / np.array([wind["correlation_time_s"] for wind in winds]))
        self._kick = np.sqrt(1.0 - self._decay**2)
        self._draws = Draws(seeds, _STREAM, 3)
        self._noise: Array = self._draws.next().astype(float)

    def velocity(self, position_m: Array) -> Array:
        self._noise = self._decay * self._noise + self._kick * self._draws.next()
        away = position_m - self._origin
        along = (away * self._direction).sum(axis=0)
        across2 = ((away * away).sum(axis=0) - along * along) / self._width**2
        mean = np.where(along < self._reach, 0.0, self._peak * np.exp(-0.5 * across2))
        swing = self._swing * np.clip(self._noise, -_CUT, _CUT)
        jet: Array = mean * (self._direction + swing)
        return jet


def _scales(altitude_m: float) -> tuple[float, float, float]:
    """Horizontal and vertical scale length, m, and the vertical's share of the intensity."""
    height_ft = max(altitude_m * _FEET_PER_M, _LOWEST_FT)
    base = 0.177 + 0.000823 * height_ft
    return height_ft / base**1.2 / _FEET_PER_M, height_ft / _FEET_PER_M, float(base**0.4)
