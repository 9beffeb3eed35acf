"""The optimum of the preview MPC where no constraint is active, as a feedback.

The cost is on the deviation from the flat states and inputs, ``w = u - u*``:

    ∫ (p - p*)² + ρ w² + ρ τ² w'² dt

over an infinite horizon.  Along the flat solution it is zero, and the optimal rate of w is linear
in the deviation of the state and in w, whatever the preview holds: no horizon cuts anything off.

ρ is given as a bandwidth: a double integrator would get poles at that frequency, with a damping of
0.7; what the attitude's lag and the time τ make of that, the Riccati equation sees to.  τ is what
keeps the noise of the measurements out of the tilt command.
"""

from dataclasses import dataclass

import numpy as np

from companion.control.plus.nominal_plant import STATES, NominalPlant, discrete
from companion.control.reference_model import Array

AUGMENTED = STATES + 1
"""The deviation of the state, and w."""


@dataclass(frozen=True, slots=True)
class FeedbackSettings:
    """Weights, by axis."""

    bandwidth_rad_s: tuple[float, float, float]
    rate_time_s: tuple[float, float, float]
    """τ."""
    step_s: float = 0.01
    """Time between two samples for which the gains are reckoned."""


@dataclass(frozen=True, slots=True)
class Riccati:
    """The discrete problem of an axis in (deviation of the state, w), with the input Δw."""

    a: Array
    """(5, 5)."""
    b: Array
    """(5,)."""
    stage: Array
    """(6, 6) cost of (state, w, Δw) over a step."""
    cost: Array
    """(5, 5) cost-to-go of the optimum."""
    gain: Array
    """(5,): ``Δw = -gain (state, w)``."""


def riccati(settings: FeedbackSettings, plant: NominalPlant, axis: int) -> Riccati:
    """Solve the Riccati equation of an axis for the step of the settings.

    Raises:
        ValueError: it has no stabilising solution.
    """
    from scipy.linalg import solve_discrete_are

    h = settings.step_s
    a, b = discrete(plant, round(h * 1e6))
    order = 4 if plant.axes[axis].interface == "acceleration" else 2
    rho = float(settings.bandwidth_rad_s[axis] ** -order)
    tau = settings.rate_time_s[axis]
    full_a = np.eye(AUGMENTED)
    full_a[:STATES, :STATES], full_a[:STATES, STATES] = a[axis], b[axis, :, 0]
    full_b = np.append(b[axis, :, 0], 1.0)
    stage = np.zeros((AUGMENTED + 1, AUGMENTED + 1))
    stage[0, 0] = h
    stage[STATES:, STATES:] = h * rho  # of (w + Δw)²
    stage[AUGMENTED, AUGMENTED] += rho * tau**2 / h
    q, r = stage[:AUGMENTED, :AUGMENTED], stage[AUGMENTED:, AUGMENTED:]
    cross = stage[:AUGMENTED, AUGMENTED:]
    try:
        p = solve_discrete_are(full_a, full_b[:, None], q, r, s=cross)
    except np.linalg.LinAlgError as error:
        raise ValueError(
            f"no feedback can be reckoned for axis {'xyz'[axis]}: take a bandwidth between 0.5 "
            "and 20 rad/s, and the dynamics that were identified of the vehicle"
        ) from error
    gain = (full_b @ p @ full_a + cross[:, 0]) / (r[0, 0] + full_b @ p @ full_b)
    return Riccati(full_a, full_b, stage, p, gain)


def feedback(settings: FeedbackSettings, plant: NominalPlant) -> Array:
    """Gains (3, 5) of ``w' = -gain (x - x*, w)``, w' constant over a step, by axis.

    Raises:
        ValueError: the Riccati equation has no stabilising solution.
    """
    return np.stack([riccati(settings, plant, i).gain / settings.step_s for i in range(3)])
