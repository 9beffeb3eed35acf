"""A trajectory from a function of time, started and stopped without a jolt."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from companion.trajectories.smooth_time import RAMP_S, ramped, ramped_time, ramped_time_at
from companion.trajectories.trajectory import Array, Motion

_STEP_S = 1e-3
"""Of the differences that stand for derivatives: 1e-9 m of rounding is 1 mm/s² at most."""
_AGREES_WITHIN = 0.02
"""Formulas of derivatives and differences may differ by this share of the largest one."""
_LOOKED_AT = 200


class Triple(Protocol):
    """Three numbers: a tuple, a list or an array."""

    def __len__(self) -> int:
        """Three."""

    def __getitem__(self, index: int, /) -> float:
        """The component of an axis."""


Along = Callable[[float], Triple]
"""Three components (x, y, z) at a time, s."""


@dataclass(frozen=True, slots=True)
class FunctionTrajectory:
    """A function of the path time s, which runs like time but for two ramps.

    s starts smoothly over the first 2 s (1 s of the path), then runs with the time; after
    `scored_s` it stops over 2 s, at ``s = scored_s``.  The function is asked for s from 0 to
    `scored_s` only.
    """

    name: str
    """For people."""
    function: Along
    """Position, ENU m, at s."""
    scored_s: float
    """Length of the scored part, s."""
    velocity: Along | None = None
    """Its derivative by s, m/s; None: by differences."""
    acceleration: Along | None = None
    """The derivative of that, m/s²; None: by differences."""

    @property
    def end_s(self) -> float:
        """Time at which it has come to rest, s."""
        return self.scored_s + RAMP_S

    def position(self, times_s: Array) -> Array:
        """Desired positions (samples, 3) in metres, ENU."""
        return self._along(self.function, ramped_time(times_s, self.scored_s))

    def position_at(self, time_s: float) -> tuple[float, float, float]:
        """Desired position at one time, ENU m."""
        return _triple(self.function(self._inside(ramped_time_at(time_s, self.scored_s))))

    def motion(self, times_s: Array) -> Motion:
        """Desired positions, velocities and accelerations (samples, 3), ENU."""
        s, rate, curvature = ramped(times_s, self.scored_s)
        along, bend = self._derivatives(s)
        return Motion(
            self.position(times_s),
            along * rate[:, None],
            bend * (rate**2)[:, None] + along * curvature[:, None],
        )

    def _inside(self, s: float) -> float:
        return max(0.0, min(self.scored_s, s))

    def _along(self, function: Along, s: Array) -> Array:
        return np.array([_triple(function(self._inside(v))) for v in s.tolist()]).reshape(-1, 3)

    def _derivatives(self, s: Array) -> tuple[Array, Array]:
        """First and second derivative by s; by differences where there is no formula.

        At the ends the differences are those of the nearest place that has both neighbours.
        """
        middle = np.clip(s, _STEP_S, self.scored_s - _STEP_S)
        before, after = middle - _STEP_S, middle + _STEP_S
        if self.velocity is not None:
            first = self._along(self.velocity, s)
            if self.acceleration is not None:
                return first, self._along(self.acceleration, s)
            slopes = self._along(self.velocity, after) - self._along(self.velocity, before)
            return first, slopes / (2.0 * _STEP_S)
        low, high = self._along(self.function, before), self._along(self.function, after)
        second = (high - 2.0 * self._along(self.function, middle) + low) / _STEP_S**2
        return (high - low) / (2.0 * _STEP_S) + (s - middle)[:, None] * second, second


def trajectory_from_function(
    function: Along,
    duration_s: float,
    *,
    name: str,
    velocity: Along | None,
    acceleration: Along | None,
) -> FunctionTrajectory:
    """A trajectory from a function, looked at all along.

    Args:
        function: position (x, y, z), ENU m, at the path time s from 0 to the duration, s.
        duration_s: of its scored part; at least 4 s, so that there is a part between the ramps.
        name: for people.
        velocity: its derivative by s, m/s; None: by differences.
        acceleration: the derivative of that, m/s²; None: by differences.

    Raises:
        ValueError: it gives no three finite numbers, the duration is too short or beyond an hour,
            or a formula is not the derivative of what it should be.
    """
    if not 2.0 * RAMP_S <= duration_s <= 3600.0:
        raise ValueError(
            f"a trajectory takes {2.0 * RAMP_S:g} to 3600 s, not {duration_s:g} s; its first "
            f"{RAMP_S:g} s are the start"
        )
    if acceleration is not None and velocity is None:
        raise ValueError("an acceleration needs the velocity that it is the derivative of")
    made = FunctionTrajectory(name, function, float(duration_s), velocity, acceleration)
    s = np.linspace(0.0, made.scored_s, _LOOKED_AT)
    for what, function_of_s in (
        ("position", function),
        ("velocity", velocity),
        ("acceleration", acceleration),
    ):
        if function_of_s is not None and not np.isfinite(made._along(function_of_s, s)).all():
            raise ValueError(f"the {what} of '{name}' is not finite somewhere from 0 to duration_s")
    plain = FunctionTrajectory(name, function, made.scored_s)
    for what, given, found in zip(
        ("velocity", "acceleration"), made._derivatives(s), plain._derivatives(s), strict=True
    ):
        off = np.linalg.norm(given - found, axis=1)
        worst = int(off.argmax())
        if off[worst] > _AGREES_WITHIN * (1.0 + np.linalg.norm(found, axis=1).max()):
            raise ValueError(
                f"the {what} of '{name}' is not what its positions say: at s = {s[worst]:.2f} s "
                f"{np.round(given[worst], 3).tolist()}, by differences "
                f"{np.round(found[worst], 3).tolist()}; mend the formula or leave it out"
            )
    return made


def _triple(values: Triple) -> tuple[float, float, float]:
    """Three plain numbers.

    Raises:
        ValueError: they are not three.
    """
    if len(values) != 3:
        raise ValueError(f"a function of time gives (x, y, z), not {values!r}")
    return float(values[0]), float(values[1]), float(values[2])
