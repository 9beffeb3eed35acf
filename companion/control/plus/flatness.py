"""From the desired trajectory to the states and inputs with which the nominal plant follows it.

The plant is differentially flat in its position: position and four derivatives give the state and
the input.  They come from the preview's samples, by central differences.
"""

import numpy as np

from companion.control.plus.nominal_plant import NominalPlant
from companion.control.reference_model import Array

AROUND = 2
"""Samples that are needed on either side."""
_CENTRAL = np.array(
    [
        [0.0, 0.0, 1.0, 0.0, 0.0],
        [1.0 / 12.0, -8.0 / 12.0, 0.0, 8.0 / 12.0, -1.0 / 12.0],
        [-1.0 / 12.0, 16.0 / 12.0, -30.0 / 12.0, 16.0 / 12.0, -1.0 / 12.0],
        [-0.5, 1.0, 0.0, -1.0, 0.5],
        [1.0, -4.0, 6.0, -4.0, 1.0],
    ]
)
"""Position and its derivatives times the step's powers, of five samples about it."""


def flat(
    plant: NominalPlant,
    preview_m: Array,
    step_s: float,
    sigma: Array,
    quadratic_drag_1_m: float,
) -> tuple[Array, Array]:
    """States (n, 3, 4) and inputs (n, 3) along a preview.

    Args:
        plant: to be steered.
        preview_m: (n + 4, 3) desired positions, `AROUND` of them before the first and after
            the last one that is wanted.
        step_s: between samples.
        sigma: (3,) acceleration that is to be cancelled.
        quadratic_drag_1_m: of the drag's quadratic part, on axes whose input is an acceleration.
    """
    h = step_s
    n = len(preview_m) - 2 * AROUND
    around = preview_m[np.arange(n)[:, None] + np.arange(2 * AROUND + 1)]
    scale = np.array([1.0, h, h**2, h**3, h**4])
    here, velocity, acceleration, jerk, snap = ((_CENTRAL / scale[:, None]) @ around).transpose(
        1, 0, 2
    )
    states = np.empty((n, 3, 4))
    inputs = np.empty((n, 3))
    states[:, :, 0], states[:, :, 1] = here, velocity
    speed = np.sqrt((velocity * velocity).sum(axis=1))[:, None]
    for axes, actuation in ((slice(0, 2), plant.tilt), (slice(2, 3), plant.vertical)):
        omega, lag_s = actuation.natural_frequency_rad_s, actuation.lag_s
        v, v1, v2, v3 = velocity[:, axes], acceleration[:, axes], jerk[:, axes], snap[:, axes]
        if actuation.interface == "acceleration":
            drag = plant.linear_drag_1_s
            a = v1 + (drag + quadratic_drag_1_m * speed) * v - sigma[axes]
            rate = v2 + drag * v1
            states[:, axes, 2], states[:, axes, 3] = a, rate
            inputs[:, axes] = a + lag_s * rate + (v3 + drag * v2) / omega**2
        else:
            a = v1 - sigma[axes]
            states[:, axes, 2], states[:, axes, 3] = a, 0.0
            inputs[:, axes] = v + lag_s * a + v2 / omega**2
    return states, inputs
