"""MPC-L1+ as it is flown, as one linear sampled system per axis.

Nothing is linearised by hand: `companion.control.plus.stack.PlusStack.step` itself is applied to
small memories and measurements, one axis and one entry at a time, about a hover on the desired
trajectory.  What comes out are the columns of

    ξ(k+1) = A ξ(k) + B y(k),   u(k) = C ξ(k) + D y(k),

with the measurement y = (position, velocity, acceleration by the measured tilt, its rate) and the
input u that is commanded.  ξ holds the predictor at its steady gain, C(s) σ̂, the modelled
actuation, the feedback's own state w, and the inputs over which the state is carried.

Taken as they are at rest: nothing is learnt of lag, drag, gain and heading; no limit acts; the
hover thrust stands still.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from companion.control.frameworks import Tick
from companion.control.plus import predictor
from companion.control.plus.nominal_plant import Acting
from companion.control.plus.planner import PlannerMemory
from companion.control.plus.predictor import PredictorMemory
from companion.control.plus.stack import PlusMemory, PlusStack
from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2
from companion.frames import Quaternion, Vector3
from companion.vehicle_state import VehicleState

AXES = 3
MEASURED = 4
"""Position m, velocity m/s, acceleration by the measured tilt m/s², its rate m/s³."""
_SMALL = 1e-4
"""Of the basis vectors: far from every limit of the law."""
_ESTIMATE, _LOW_PASSED, _ACTUATION, _MODELLED = slice(0, 3), 3, slice(4, 6), slice(6, 8)
DEVIATION, _INPUTS = 8, 9
_NOW_S = 10.0
_SETTLED = 1e-12
_LONGEST_SETTLING = 20_000


@dataclass(frozen=True, slots=True)
class PlusLaw:
    """The law of all axes; each array begins with the axis."""

    a: Array
    """(3, n, n)."""
    b: Array
    """(3, n, 4)."""
    c: Array
    """(3, n)."""
    d: Array
    """(3, 4)."""
    sample_s: float
    covariance: Array
    """(3, 3, 3) of the predictor at rest."""
    y_tilde_deviation_m_s: Array
    """(3,) standard deviation of ṽ by that covariance."""


def law_of(stack: PlusStack, loop_delay_s: float, sample_s: float) -> PlusLaw:
    """Apply the stack to basis vectors, about rest: quadratic drag has no part there.

    Args:
        stack: of the law.
        loop_delay_s: of transport, as the stack is told it in flight.
        sample_s: between two samples of the state.

    Raises:
        ValueError: the predictor's covariance does not settle.
    """
    settings = replace(stack.settings, lag=None, mismatch=None, quadratic_drag_1_m=0.0)
    stack = replace(stack, settings=settings)
    covariance, deviation = _settled(stack, sample_s)
    delays = [loop_delay_s + axis.delay_s for axis in settings.plant.axes]
    inputs = 2 + math.floor(max(delays) / sample_s + 1e-9)
    probe = _Probe(stack, covariance, loop_delay_s, sample_s, tuple(delays), inputs)
    n = _INPUTS + inputs
    a, b = np.empty((AXES, n, n)), np.empty((AXES, n, MEASURED))
    c, d = np.empty((AXES, n)), np.empty((AXES, MEASURED))
    for axis in range(AXES):
        for j in range(n):
            xi = np.zeros(n)
            xi[j] = _SMALL
            a[axis, :, j], c[axis, j] = probe.step(axis, xi, np.zeros(MEASURED))
        for j in range(MEASURED):
            y = np.zeros(MEASURED)
            y[j] = _SMALL
            b[axis, :, j], d[axis, j] = probe.step(axis, np.zeros(n), y)
    scale = 1.0 / _SMALL
    return PlusLaw(a * scale, b * scale, c * scale, d * scale, sample_s, covariance, deviation)


@dataclass(frozen=True, slots=True)
class _Probe:
    """One step of the stack from any memory of one axis, the others at rest."""

    stack: PlusStack
    covariance: Array
    loop_delay_s: float
    sample_s: float
    delays_s: tuple[float, ...]
    inputs: int

    def step(self, axis: int, xi: Array, y: Array) -> tuple[Array, float]:
        memory, state = self._memory(axis, xi), self._state(axis, y)
        tick = Tick(state, self.loop_delay_s, 0.0)
        after, _, _ = self.stack.step(memory, tick, lambda at_s: np.zeros((len(at_s), 3)))
        sensed, u = after.sensed, after.acting[-1].u[axis]
        assert after.deviation is not None
        advanced = np.empty_like(xi)
        advanced[_ESTIMATE] = sensed.predictor.estimate[axis]
        advanced[_LOW_PASSED] = sensed.sigma_low_passed[axis]
        advanced[_ACTUATION] = sensed.actuation[axis]
        advanced[_MODELLED] = sensed.modelled[axis]
        advanced[DEVIATION] = after.deviation[axis]
        advanced[_INPUTS] = u
        advanced[_INPUTS + 1 :] = xi[_INPUTS:-1]
        return advanced, u

    def _memory(self, axis: int, xi: Array) -> PlusMemory:
        at_rest = self.stack.start(self._state(axis, np.zeros(MEASURED)))

        def of_axis(values: Any, shape: tuple[int, ...]) -> Array:  # noqa: ANN401
            filled = np.zeros((AXES, *shape))
            filled[axis] = values
            return filled

        acting = []
        for k in range(self.inputs, 0, -1):  # the oldest first
            sent_s = _NOW_S - k * self.sample_s
            x, y, z = (sent_s + delay_s for delay_s in self.delays_s)
            acting.append(Acting((x, y, z), _vector(axis, float(xi[_INPUTS + k - 1]))))
        a, rate = xi[_ACTUATION].tolist()
        actuation = list(zip(_vector(axis, a), _vector(axis, rate), strict=True))
        sensed = replace(
            at_rest.sensed,
            predictor=PredictorMemory(of_axis(xi[_ESTIMATE], (3,)), self.covariance),
            sigma_low_passed=_vector(axis, float(xi[_LOW_PASSED])),
            actuation=(actuation[0], actuation[1], actuation[2]),
            modelled=of_axis(xi[_MODELLED], (2,)),
        )
        return replace(
            at_rest,
            sample_s=_NOW_S - self.sample_s,
            sensed=sensed,
            deviation=_vector(axis, float(xi[DEVIATION])),
            acting=tuple(acting),
            planner=PlannerMemory(math.inf, (math.nan,) * 3),  # the horizon is not looked at
        )

    def _state(self, axis: int, y: Array) -> VehicleState:
        attitude, rate = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if axis < 2:
            force = GRAVITY_M_S2 * self.stack.settings.plant.tilt_gain
            attitude, rate = tilted(axis, float(y[2]), float(y[3]), force)
        position, velocity = _vector(axis, float(y[0])), _vector(axis, float(y[1]))
        return VehicleState(_NOW_S, position, velocity, attitude, rate)


def tilted(
    axis: int, acceleration_m_s2: float, rate_m_s3: float, force_m_s2: float
) -> tuple[Quaternion, Vector3]:
    """Attitude and body rates (FLU) that push along x or y with an acceleration and its rate.

    Args:
        axis: 0 or 1.
        acceleration_m_s2: force times the tilt's tangent.
        rate_m_s3: its rate.
        force_m_s2: vertical thrust per mass, times the tilt gain.
    """
    tangent = acceleration_m_s2 / force_m_s2
    half = 0.5 * math.atan(tangent)
    turn = rate_m_s3 / (force_m_s2 * (1.0 + tangent * tangent))
    if axis == 0:
        return (math.cos(half), 0.0, math.sin(half), 0.0), (0.0, turn, 0.0)
    return (math.cos(half), -math.sin(half), 0.0, 0.0), (-turn, 0.0, 0.0)


def _settled(stack: PlusStack, sample_s: float) -> tuple[Array, Array]:
    """The predictor's covariance (3, 3, 3) after many samples, and the deviation (3,) of ṽ."""
    s, still = stack.settings, np.zeros(AXES)
    drag = [s.plant.linear_drag_1_s if a.interface == "acceleration" else 0.0 for a in s.plant.axes]
    memory = predictor.start(s.noise, still, still, still, np.ones(AXES))
    bound = np.array(s.sigma_bound_m_s2)
    for _ in range(_LONGEST_SETTLING):
        before = memory.covariance
        memory, record = predictor.step(
            s.noise, memory, np.array(drag), bound, still, still, still, sample_s
        )
        if (np.abs(memory.covariance - before) <= _SETTLED * np.abs(before)).all():
            return memory.covariance, record.y_tilde_deviation_m_s
    raise ValueError("the predictor's covariance does not settle for the stated noise")


def _vector(axis: int, value: float) -> Vector3:
    x, y, z = (value if i == axis else 0.0 for i in range(AXES))
    return x, y, z
