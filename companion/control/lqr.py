"""Gains of the LQR-L1 baseline: an infinite-horizon LQR with integral action on r2.

The plant is the discretised D(s) of the L1 controller below, with the state (y2 - y2*, y1, ∫(y2* -
y2)) and the input r2 - y2*: D(s) has a steady-state gain of 1, so that a constant y2* rests at r2 =
y2*.  No future and no derivative of y2* enters.  The law that results has the shape of a PID with
the derivative of the measurement, and is flown as one.
"""

from dataclasses import dataclass

import numpy as np

from companion.control.pid import PidGains
from companion.control.reference_model import PositionModel, discretise_position_model


@dataclass(frozen=True, slots=True)
class LqrWeights:
    """Weights per axis of ``Σ q_p (y2 - y2*)² + q_v y1² + q_i (∫)² + r (r2 - y2*)²``."""

    position: tuple[float, ...]
    velocity: tuple[float, ...]
    integral: tuple[float, ...]
    reference: tuple[float, ...]


def lqr_gains(
    model: PositionModel,
    weights: LqrWeights,
    period_s: float,
    integral_limit: tuple[float, ...],
) -> PidGains:
    """Gains of the law that minimises the cost.

    Args:
        model: D(s) of the L1 controller below.
        weights: of the cost.
        period_s: sampling time.
        integral_limit: (axes,) bound of the integral's part of r2, m.

    Raises:
        ValueError: the Riccati equation has no stabilising solution.
    """
    from scipy.linalg import solve_discrete_are

    a, b = discretise_position_model(np.array(model.m), np.array(model.gain_k), period_s)
    rows = []
    for i in range(len(model.m)):
        full_a = np.zeros((3, 3))
        full_a[:2, :2] = a[i]
        full_a[2] = [-period_s, 0.0, 1.0]
        full_b = np.append(b[i], 0.0)[:, None]
        q = np.diag([weights.position[i], weights.velocity[i], weights.integral[i]])
        r = np.array([[weights.reference[i]]])
        try:
            cost = solve_discrete_are(full_a, full_b, q, r)
        except np.linalg.LinAlgError as error:
            raise ValueError(_no_solution(i)) from error
        gain = np.linalg.solve(r + full_b.T @ cost @ full_b, full_b.T @ cost @ full_a)[0]
        if np.abs(np.linalg.eigvals(full_a - full_b * gain)).max() > 1.0 - 1e-9:
            raise ValueError(_no_solution(i))
        rows.append((float(gain[0]), float(-gain[2]), float(gain[1])))
    kp, ki, kd = zip(*rows, strict=True)
    return PidGains(kp, ki, kd, integral_limit)


def _no_solution(axis: int) -> str:
    return (
        f"the LQR of axis {axis} has no stabilising solution that can be reckoned: give weights on "
        "position and integral above zero, and not so many orders of magnitude apart"
    )
