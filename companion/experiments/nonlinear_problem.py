"""The nonlinear MPC's optimisation problem: direct multiple shooting, one RK4 step a period.

The applied input is carried as a state, so that the cost on differences is local to a stage: HPIPM
wants that, and IPOPT loses nothing by it.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from companion.control.reference_model import Array
from companion.experiments.point_mass import HOVER, INPUTS, STATES, PointMass

CARRIED = STATES + INPUTS
"""A stage's state with the input applied before it."""
STAGE = CARRIED + INPUTS

_ANGLE_BOUND_RAD = 1.2
_RATE_BOUND_RAD_S = 20.0


@dataclass(frozen=True, slots=True)
class NonlinearSettings:
    """Task, bounds and cost; the horizon is counted as the linear MPC counts it."""

    period_s: float
    horizon: int
    """N_h: inputs at k̄ … k̄+N_h, outputs at k̄+1 … k̄+N_h+1."""
    tilt_limit_rad: float
    """Of the setpoint: roll² + pitch² stays below its square."""
    thrust_low_m_s2: float
    thrust_high_m_s2: float
    velocity_limit_m_s: tuple[float, float, float]
    """Hard bound of |v| per axis from k̄+1 on, where the linear MPC's is soft."""
    box_low_m: tuple[float, float, float]
    """Hard, likewise."""
    box_high_m: tuple[float, float, float]
    q: float
    """On the squared position error, as in the paper."""
    deviation: tuple[float, float, float] = (0.3, 0.3, 0.003)
    """On the squared input less the one of hover: 1/rad², 1/rad², 1/(m/s²)²."""
    difference: tuple[float, float, float] = (0.3, 0.3, 0.003)
    """On the squared change of the input from period to period."""
    model: PointMass = field(default_factory=PointMass)


def problem(casadi: Any, settings: NonlinearSettings) -> tuple[dict[str, Any], Any]:  # noqa: ANN401
    """The nonlinear program and its Gauss-Newton Hessian.

    Variables are (state, applied input, input) stage after stage, then the last state; parameters
    the state at k̄, the input applied before, and y*.
    """
    count = settings.horizon + 1
    state, inputs = casadi.SX.sym("x", CARRIED), casadi.SX.sym("u", INPUTS)
    onward = settings.model.rk4(casadi, state, inputs, settings.period_s)
    step = casadi.Function("step", [state, inputs], [casadi.vertcat(*onward, inputs)])
    start = casadi.SX.sym("start", CARRIED)
    desired = casadi.SX.sym("desired", 3, count + 1)
    states = [casadi.SX.sym(f"x{k}", CARRIED) for k in range(count + 1)]
    plan = [casadi.SX.sym(f"u{k}", INPUTS) for k in range(count)]
    residuals: list[Any] = []
    constraints: list[Any] = []
    variables: list[Any] = []
    for k in range(count):
        deviation, difference = plan[k] - casadi.DM(HOVER), plan[k] - states[k][STATES:]
        residuals += [
            casadi.DM(np.sqrt(settings.deviation)) * deviation,
            casadi.DM(np.sqrt(settings.difference)) * difference,
            math.sqrt(settings.q) * (states[k + 1][:3] - desired[:, k + 1]),
        ]
        constraints.append(states[k + 1] - step(states[k], plan[k]))
        if k == 0:
            constraints.append(states[0] - start)
        constraints.append(casadi.sumsqr(plan[k][:2]))
        variables += [states[k], plan[k]]
    x = casadi.vertcat(*variables, states[count])
    parameters = casadi.vertcat(start, casadi.vec(desired))
    residual = casadi.vertcat(*residuals)
    g = casadi.vertcat(*constraints)
    jacobian = casadi.jacobian(residual, x)
    factor, multipliers = casadi.SX.sym("factor"), casadi.SX.sym("multipliers", g.shape)
    hessian = casadi.Function(
        "gauss_newton",
        [x, parameters, factor, multipliers],
        [2.0 * factor * casadi.mtimes(jacobian.T, jacobian)],
    )
    return {"x": x, "p": parameters, "f": casadi.sumsqr(residual), "g": g}, hessian


def bounds(settings: NonlinearSettings) -> dict[str, Array]:
    """Bounds of variables and constraints; the state at k̄ is given, so it has none."""
    count = settings.horizon + 1
    tilt = settings.tilt_limit_rad
    speed = settings.velocity_limit_m_s
    attitude = (_ANGLE_BOUND_RAD,) * 2 + (_RATE_BOUND_RAD_S,) * 2
    free = (math.inf,) * INPUTS
    high = (*settings.box_high_m, *speed, *attitude, *free)
    low = (*settings.box_low_m, *(-v for v in speed), *(-a for a in attitude), *(-f for f in free))
    input_low = (-tilt, -tilt, settings.thrust_low_m_s2)
    input_high = (tilt, tilt, settings.thrust_high_m_s2)
    unbounded = np.full(CARRIED, math.inf)
    lower = np.concatenate([-unbounded, np.tile((*input_low, *low), count)])
    upper = np.concatenate([unbounded, np.tile((*input_high, *high), count)])
    exact = np.zeros(CARRIED)
    return {
        "lbx": lower,
        "ubx": upper,
        "lbg": np.concatenate([exact, np.tile((*exact, -math.inf), count)]),
        "ubg": np.concatenate([exact, np.tile((*exact, tilt * tilt), count)]),
    }
