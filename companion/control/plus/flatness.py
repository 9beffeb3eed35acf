"""From the desired trajectory to the states and inputs with which the nominal plant follows it.

The plant is differentially flat in its position: position and four derivatives give the state and
the input.  They come from the preview's samples, by central differences.
"""

import numpy as np

from companion.control.plus.nominal_plant import NominalPlant
from companion.control.reference_model import Array

AROUND = 2
"""Samples that are needed on either side."""


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
    p = preview_m
    h = step_s
    minus2, minus1, here, plus1, plus2 = p[:-4], p[1:-3], p[2:-2], p[3:-1], p[4:]
    velocity = (minus2 - 8.0 * minus1 + 8.0 * plus1 - plus2) / (12.0 * h)
    acceleration = (-minus2 + 16.0 * minus1 - 30.0 * here + 16.0 * plus1 - plus2) / (12.0 * h * h)
    jerk = (plus2 - 2.0 * plus1 + 2.0 * minus1 - minus2) / (2.0 * h**3)
    snap = (plus2 - 4.0 * plus1 + 6.0 * here - 4.0 * minus1 + minus2) / h**4
    states = np.empty((len(here), 3, 4))
    inputs = np.empty((len(here), 3))
    speed = np.sqrt((velocity * velocity).sum(axis=1))
    for i, actuation in enumerate(plant.axes):
        omega, zeta = actuation.natural_frequency_rad_s, actuation.damping
        states[:, i, 0], states[:, i, 1] = here[:, i], velocity[:, i]
        if actuation.interface == "acceleration":
            drag = plant.linear_drag_1_s
            a = acceleration[:, i] + drag * velocity[:, i] - sigma[i]
            a += quadratic_drag_1_m * speed * velocity[:, i]
            rate = jerk[:, i] + drag * acceleration[:, i]
            second = snap[:, i] + drag * jerk[:, i]
            states[:, i, 2], states[:, i, 3] = a, rate
            inputs[:, i] = a + 2.0 * zeta / omega * rate + second / omega**2
        else:
            a = acceleration[:, i] - sigma[i]
            states[:, i, 2], states[:, i, 3] = a, 0.0
            inputs[:, i] = velocity[:, i] + 2.0 * zeta / omega * a + jerk[:, i] / omega**2
    return states, inputs
