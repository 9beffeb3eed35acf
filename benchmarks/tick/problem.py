"""The problem that is timed: three decoupled axes, D(s) at 50 ms, second difference of r bounded.

The cost and its weights are the paper's; m and K are those of the first robust set that was found
for the `bebop2`.  Nothing but the second difference is bounded, on both sides.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.tick.inputs import Recording
from companion.control.mpc import MpcSettings
from companion.control.qp.condensed import AxisProblem, Weights, condense
from companion.control.reference_model import Array, PositionModel, discretise_position_model

PERIOD_S = 0.05
MODEL = PositionModel(m=(0.54, 0.54, 3.75), gain_k=(0.68, 0.68, 0.55))
WEIGHTS = Weights(q=17.0, r=0.08, s=0.02)
AXES = 3
_FAR = 1e3
"""Of the bounds on velocity and position, which this problem does not have."""


@dataclass(frozen=True, slots=True)
class Problem:
    """The constant matrices, the same for every solver."""

    horizon: int
    second_limit_m: float
    """Bound of |r(k) - 2 r(k-1) + r(k-2)|."""
    a: Array
    """(axes, 2, 2) D(s), state (position, velocity)."""
    b: Array
    """(axes, 2)."""
    axes: tuple[AxisProblem, ...]
    gradient: Array
    """(axes, n, 3 + 2 n), of `Vectors.data`."""
    gain: Array
    """(axes, n, 3 + 2 n): the closed form."""


@dataclass(frozen=True, slots=True)
class TickInput:
    """What a controller is given at one tick: ENU m and m/s."""

    number: int
    """Among the recorded ticks."""
    position_m: Array
    velocity_m_s: Array
    previous_m: Array
    """Reference that was applied last."""
    before_m: Array
    """The one before."""
    preview_m: Array
    """(N_h + 2, axes)."""


def make_problem(horizon: int, r_max_m_s2: float) -> Problem:
    """Condense the problem of each axis."""
    a, b = discretise_position_model(np.array(MODEL.m), np.array(MODEL.gain_k), PERIOD_S)
    axes = tuple(condense(a[i], b[i], horizon, WEIGHTS) for i in range(AXES))
    return Problem(
        horizon,
        r_max_m_s2 * PERIOD_S**2,
        a,
        b,
        axes,
        np.stack([axis.gradient for axis in axes]),
        np.stack([axis.gain for axis in axes]),
    )


def mpc_settings(horizon: int, r_max_m_s2: float) -> MpcSettings:
    """The same problem for the controller that flies."""
    return MpcSettings(
        model=MODEL,
        period_s=PERIOD_S,
        horizon=horizon,
        weights=WEIGHTS,
        r_max_m_s2=r_max_m_s2,
        velocity_limit_m_s=(_FAR,) * AXES,
        box_low_m=(-_FAR,) * AXES,
        box_high_m=(_FAR,) * AXES,
    )


def tick_inputs(recording: Recording, horizon: int) -> list[TickInput]:
    """The recorded inputs with a preview of this horizon."""
    return [
        TickInput(
            int(recording.number[k]),
            recording.position_m[k],
            recording.velocity_m_s[k],
            recording.previous_m[k],
            recording.before_m[k],
            recording.path_m[recording.index[k] : recording.index[k] + horizon + 2],
        )
        for k in range(len(recording.index))
    ]


def data_of(problem: Problem, tick: TickInput) -> Array:
    """What gradient and closed form are linear in, (axes, 3 + 2 n), about the desired position."""
    n = problem.horizon + 1
    centre = tick.preview_m[0]
    desired = (tick.preview_m - centre).T
    data = np.empty((AXES, 3 + 2 * n))
    data[:, 0] = tick.position_m - centre
    data[:, 1] = tick.velocity_m_s
    data[:, 2] = tick.previous_m - centre
    data[:, 3 : 3 + n] = desired[:, 1:]
    data[:, 3 + n :] = desired[:, :n]
    return data


def vectors_of(problem: Problem, tick: TickInput) -> tuple[Array, Array, Array]:
    """Gradient, lower and upper bound of the second difference, each (axes, n)."""
    gradient = (problem.gradient @ data_of(problem, tick)[:, :, None])[:, :, 0]
    previous = tick.previous_m - tick.preview_m[0]
    before = tick.before_m - tick.preview_m[0]
    lower = np.full(gradient.shape, -problem.second_limit_m)
    upper = np.full(gradient.shape, problem.second_limit_m)
    past = 2.0 * previous - before
    lower[:, 0] += past
    upper[:, 0] += past
    lower[:, 1] -= previous
    upper[:, 1] -= previous
    return gradient, lower, upper


def closed_form_plan(problem: Problem, tick: TickInput) -> Array:
    """The optimum without constraints, (axes, n), about the desired position."""
    plan: Array = (problem.gain @ data_of(problem, tick)[:, :, None])[:, :, 0]
    return plan


def constrained(problem: Problem, tick: TickInput, tolerance_m: float = 1e-9) -> Array:
    """(axes,) whether the closed form violates a bound: then one is active at the optimum."""
    plan = closed_form_plan(problem, tick)
    _, lower, upper = vectors_of(problem, tick)
    second = plan @ problem.axes[0].second_difference.T
    outside = (second < lower - tolerance_m) | (second > upper + tolerance_m)
    found: Array = outside.any(axis=1)
    return found
