"""The inner controllers over many vehicles; axes first: (3, vehicles).

The L1 law is linear where its projection does nothing, so its matrix is read off the flight's own
`l1_adaptive.step`, by unit vectors, and then multiplied with all vehicles at once.  Vehicles near
the projection's bound go through the flight's law itself, one by one.  The PID takes arrays of any
shape as it is.
"""

import math
from typing import Protocol

import numpy as np

from companion.control import l1_adaptive, pid
from companion.control.inner import L1Controller, PidController
from companion.control.interfaces import InnerController
from companion.control.l1_adaptive import L1Gains, L1Memory
from companion.control.reference_model import Array

_AXES = 3
_UNIT = 2.0**-10
"""So small that the projection does nothing, and exact to divide by."""


class InnerLaw(Protocol):
    """From r2 to u; it keeps its memory itself."""

    def step(self, r2_m: Array, position_m: Array, velocity_m_s: Array, dt_s: float) -> Array:
        """The new u (3, vehicles)."""

    def take(self, applied_u: Array) -> None:
        """Learn what the limits left of u."""


def make_inner(controller: InnerController, vehicles: int) -> InnerLaw:
    """The law of a stack, beginning at rest."""
    if isinstance(controller, L1Controller):
        return L1Law(controller.gains, vehicles)
    assert isinstance(controller, PidController)
    return _PidLaw(controller, vehicles)


class L1Law:
    """`companion.control.l1_adaptive` over many vehicles."""

    def __init__(self, gains: L1Gains, vehicles: int) -> None:
        """Begin at rest."""
        nothing = np.zeros(_AXES)
        rest = l1_adaptive.start(gains, nothing, nothing)
        self._gains = gains
        self._p, self._c = rest.predictor.shape[1], rest.low_pass.shape[1]
        # Predictor, σ̂, u in effect, y1 before, y1, state of C(s), r2, y2.
        self.inputs = np.zeros((_AXES, self._p + self._c + 6, vehicles))
        near = math.sqrt(1.0 + gains.projection_margin)
        self._near = np.array(gains.sigma_bound)[:, None] / near
        ones = np.ones(_AXES)
        self._resting = l1_adaptive.with_applied(gains, rest, ones).low_pass[:, :, None]
        self._matrices: dict[float, Array] = {}
        self.projected = 0
        """Steps of a vehicle that went through the flight's law one by one."""

    def step(self, r2_m: Array, position_m: Array, velocity_m_s: Array, dt_s: float) -> Array:
        """See `InnerLaw`."""
        p, c, inputs = self._p, self._c, self.inputs
        inputs[:, p + 3] = velocity_m_s
        inputs[:, -2] = r2_m
        inputs[:, -1] = position_m
        after = self._matrix(dt_s) @ inputs
        near = (np.abs(after[:, p]) > self._near).any(axis=0)
        for k in np.flatnonzero(near):
            self.projected += 1
            after[:, :, k] = self._one(inputs[:, :, k], dt_s)
        inputs[:, : p + 1] = after[:, : p + 1]
        inputs[:, p + 2] = velocity_m_s
        inputs[:, p + 4 : p + c + 4] = after[:, p + 1 :]
        u: Array = after[:, p + 1].copy()
        inputs[:, p + 1] = u
        return u

    def take(self, applied_u: Array) -> None:
        """See `InnerLaw`."""
        p, c = self._p, self._c
        low_pass = self.inputs[:, p + 4 : p + c + 4]
        cut = (low_pass[:, 0] != applied_u)[:, None]
        np.copyto(low_pass, self._resting * applied_u[:, None], where=cut)
        self.inputs[:, p + 1] = applied_u

    def _matrix(self, dt_s: float) -> Array:
        matrix = self._matrices.get(dt_s)
        if matrix is None:
            units = _UNIT * np.eye(self.inputs.shape[1])
            columns = [self._one(np.tile(unit, (_AXES, 1)), dt_s) for unit in units]
            matrix = np.stack(columns, axis=2) / _UNIT
            self._matrices[dt_s] = matrix
        return matrix

    def _one(self, inputs: Array, dt_s: float) -> Array:
        """The flight's law on a vehicle: (3, inputs) to (3, predictor, σ̂ and state of C(s))."""
        p, c = self._p, self._c
        memory = L1Memory(
            predictor=inputs[:, :p].copy(),
            sigma_hat=inputs[:, p].copy(),
            low_pass=inputs[:, p + 4 : p + c + 4].copy(),
            applied_u=inputs[:, p + 1].copy(),
            last_velocity_m_s=inputs[:, p + 2].copy(),
        )
        r2, position, velocity = inputs[:, -2], inputs[:, -1], inputs[:, p + 3]
        memory, _ = l1_adaptive.step(self._gains, memory, r2, position, velocity, dt_s)
        return np.hstack([memory.predictor, memory.sigma_hat[:, None], memory.low_pass])


class _PidLaw:
    """`companion.control.pid` as the inner law."""

    def __init__(self, controller: PidController, vehicles: int) -> None:
        self._controller = controller
        self._memory = pid.start(np.zeros((vehicles, _AXES)))

    def step(self, r2_m: Array, position_m: Array, velocity_m_s: Array, dt_s: float) -> Array:
        self._memory, record = self._controller.step(
            self._memory, r2_m.T, position_m.T, velocity_m_s.T, dt_s
        )
        return record.u.T

    def take(self, applied_u: Array) -> None:
        self._memory = pid.with_applied(self._memory, applied_u.T)
