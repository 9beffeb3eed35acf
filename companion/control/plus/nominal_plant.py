"""The nominal plant of MPC-L1+: what was identified of a vehicle, axis by axis.

Each world axis has the state (position, velocity, acceleration, its rate) and one input u:

* ``acceleration`` (horizontal axes by tilt, the vertical one by thrust): u is the acceleration
  that is asked for; ``p' = v``, ``v' = a - k v + σ``, ``a'' = ωn² (u - a) - 2 ζ ωn a'``;
* ``climb_rate`` (the vertical axis where the autopilot flies the climb rate): u is that rate;
  ``p' = v``, ``v' = a + σ``, ``a' = ωn² (u - v) - 2 ζ ωn a``.

σ is the acceleration that the model does not explain: wind, trim, a load.  The dead time of each
response lies before u.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from companion.control.matrix_exponential import matrix_exponential
from companion.control.reference_model import Array

STATES = 4
"""Position m, velocity m/s, acceleration m/s², its rate m/s³."""

AxisState = tuple[float, float, float, float]

Interface = Literal["acceleration", "climb_rate"]

_IDLE_1_S = 10.0
"""Decay of the state that a climb-rate axis does not have."""


@dataclass(frozen=True, slots=True)
class Actuation:
    """How an axis answers its input: of second order behind a dead time, gain 1."""

    natural_frequency_rad_s: float
    damping: float
    delay_s: float
    interface: Interface = "acceleration"

    def lagging(self, scale: float) -> "Actuation":
        """The same response slowed down by a factor on its time constants."""
        omega = self.natural_frequency_rad_s / scale
        return Actuation(omega, self.damping, self.delay_s, self.interface)

    @property
    def lag_s(self) -> float:
        """Delay of a slow signal through the response, beside its dead time: 2 ζ / ωn."""
        return 2.0 * self.damping / self.natural_frequency_rad_s


@dataclass(frozen=True, slots=True)
class NominalPlant:
    """A vehicle as identified."""

    tilt: Actuation
    """Of both horizontal axes."""
    vertical: Actuation
    linear_drag_1_s: float
    """Of all axes whose interface is an acceleration."""
    tilt_gain: float = 1.0
    """Horizontal acceleration over the vertical force per mass times the tilt's tangent."""

    @property
    def axes(self) -> tuple[Actuation, Actuation, Actuation]:
        """Of x, y, z."""
        return self.tilt, self.tilt, self.vertical

    def lagging(self, scale: float) -> "NominalPlant":
        """The same vehicle with a slower attitude."""
        return NominalPlant(
            self.tilt.lagging(scale), self.vertical, self.linear_drag_1_s, self.tilt_gain
        )


def continuous(actuation: Actuation, drag_1_s: float) -> tuple[Array, Array]:
    """A (4, 4) and B (4, 2) of an axis, its inputs u and σ."""
    omega, zeta = actuation.natural_frequency_rad_s, actuation.damping
    stiffness, friction = omega * omega, 2.0 * zeta * omega
    a, b = np.zeros((STATES, STATES)), np.zeros((STATES, 2))
    a[0, 1] = 1.0
    a[1, 2] = 1.0
    b[1, 1] = 1.0
    if actuation.interface == "acceleration":
        a[1, 1] = -drag_1_s
        a[2, 3] = 1.0
        a[3, 2], a[3, 3] = -stiffness, -friction
        b[3, 0] = stiffness
    else:
        a[2, 1], a[2, 2] = -stiffness, -friction
        a[3, 3] = -_IDLE_1_S
        b[2, 0] = stiffness
    return a, b


@lru_cache(maxsize=2048)
def discrete(plant: NominalPlant, time_us: int) -> tuple[Array, Array]:
    """Zero-order hold over a time in microseconds: A (3, 4, 4) and B (3, 4, 2)."""
    a_all, b_all = np.empty((3, STATES, STATES)), np.empty((3, STATES, 2))
    for i, actuation in enumerate(plant.axes):
        a, b = continuous(actuation, plant.linear_drag_1_s)
        system = np.zeros((STATES + 2, STATES + 2))
        system[:STATES, :STATES], system[:STATES, STATES:] = a, b
        step = matrix_exponential(system * (time_us * 1e-6))
        a_all[i], b_all[i] = step[:STATES, :STATES], step[:STATES, STATES:]
    return a_all, b_all


class _Steps:
    """`discrete` of one plant as plain floats, which for four numbers are several times quicker.

    Rows of (A, B), without A's first column, which is (1, 0, 0, 0).
    """

    def __init__(self, plant: NominalPlant) -> None:
        self._plant = plant
        self._known: dict[int, list[list[tuple[float, ...]]]] = {}

    def of(self, time_us: int) -> list[list[tuple[float, ...]]]:
        """By axis, by row."""
        known = self._known.get(time_us)
        if known is None:
            both = np.concatenate(discrete(self._plant, time_us), axis=2)
            known = [[tuple(row[1:]) for row in axis] for axis in both.tolist()]
            self._known[time_us] = known
        return known


_steps = lru_cache(maxsize=256)(_Steps)


@dataclass(frozen=True, slots=True)
class Acting:
    """An input (3,) and the times (3,) from which on it acts, by axis, s."""

    from_s: tuple[float, float, float]
    u: tuple[float, float, float]


def carry(
    plant: NominalPlant,
    state: Array,
    sigma: Array,
    from_s: float,
    until_s: tuple[float, float, float],
    acting: tuple[Acting, ...],
) -> Array:
    """The state (3, 4) at a time by axis, from one time for all, under the inputs meanwhile.

    Args:
        plant: whose model it is.
        state: (3, 4) at `from_s`.
        sigma: (3,) taken as constant.
        from_s: time of the state.
        until_s: by axis; where it is not later than `from_s`, the state stays.
        acting: inputs in order of time; before the first one, that one acts.
    """
    return np.array(carried(plant, state.tolist(), sigma.tolist(), from_s, until_s, acting))


def carried(
    plant: NominalPlant,
    state: Sequence[Sequence[float]],
    sigma: Sequence[float],
    from_s: float,
    until_s: tuple[float, float, float],
    acting: tuple[Acting, ...],
) -> list[AxisState]:
    """`carry` in plain floats."""
    steps = _steps(plant)
    found = []
    for i, (p, v, a, rate) in enumerate(state):
        now_s, end_s, push = from_s, until_s[i], sigma[i]
        for k, input_ in enumerate(acting):
            until = acting[k + 1].from_s[i] if k + 1 < len(acting) else math.inf
            span_us = 500 * round((min(until, end_s) - now_s) * 2e3)
            if span_us <= 0:
                continue
            u = input_.u[i]
            (
                (p1, p2, p3, p4, p5),
                (v1, v2, v3, v4, v5),
                (a1, a2, a3, a4, a5),
                (r1, r2, r3, r4, r5),
            ) = steps.of(span_us)[i]
            p, v, a, rate = (
                p + p1 * v + p2 * a + p3 * rate + p4 * u + p5 * push,
                v1 * v + v2 * a + v3 * rate + v4 * u + v5 * push,
                a1 * v + a2 * a + a3 * rate + a4 * u + a5 * push,
                r1 * v + r2 * a + r3 * rate + r4 * u + r5 * push,
            )
            now_s += span_us * 1e-6
        found.append((p, v, a, rate))
    return found
