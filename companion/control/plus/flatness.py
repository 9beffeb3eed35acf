"""From the desired trajectory to the states and inputs with which the nominal plant follows it.

The plant is differentially flat in its position: position and four derivatives give the state and
the input.  They come from the preview's samples, by central differences.
"""

import math
from functools import lru_cache
from typing import TypeVar

import numpy as np

from companion.control.plus.nominal_plant import Actuation, NominalPlant
from companion.control.reference_model import Array
from companion.frames import Vector3

_Value = TypeVar("_Value", float, Array)

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


@lru_cache(maxsize=8)
def _differences(step_s: float) -> Array:
    """(5, 5) from five samples to position and derivatives at the middle one."""
    h = step_s
    scaled: Array = _CENTRAL / np.array([1.0, h, h**2, h**3, h**4])[:, None]
    return scaled


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
    n = len(preview_m) - 2 * AROUND
    around = preview_m[np.arange(n)[:, None] + np.arange(2 * AROUND + 1)]
    here, *derivatives = (_differences(step_s) @ around).transpose(1, 0, 2)
    velocity = derivatives[0]
    states = np.empty((n, 3, 4))
    inputs = np.empty((n, 3))
    states[:, :, 0], states[:, :, 1] = here, velocity
    speed = np.sqrt((velocity * velocity).sum(axis=1))[:, None]
    for axes, actuation in ((slice(0, 2), plant.tilt), (slice(2, 3), plant.vertical)):
        drag = plant.linear_drag_1_s + quadratic_drag_1_m * speed
        states[:, axes, 2], states[:, axes, 3], inputs[:, axes] = _steered(
            actuation, plant.linear_drag_1_s, drag, sigma[axes], [d[:, axes] for d in derivatives]
        )
    return states, inputs


def flat_at(
    plant: NominalPlant,
    around_m: Array,
    step_s: float,
    sigma: Array,
    quadratic_drag_1_m: float,
) -> tuple[Array, Vector3]:
    """State (3, 4) and input at one time: `flat` for the five samples (5, 3) about it.

    In plain floats, which for one time are several times quicker.
    """
    here, *derivatives = (_differences(step_s) @ around_m).tolist()
    vx, vy, vz = derivatives[0]
    drag = plant.linear_drag_1_s + quadratic_drag_1_m * math.sqrt(vx * vx + vy * vy + vz * vz)
    state, inputs = [], []
    for i, (actuation, push) in enumerate(zip(plant.axes, sigma.tolist(), strict=True)):
        own = [d[i] for d in derivatives]
        a, rate, u = _steered(actuation, plant.linear_drag_1_s, drag, push, own)
        state.append((here[i], own[0], a, rate))
        inputs.append(u)
    ux, uy, uz = inputs
    return np.array(state), (ux, uy, uz)


def _steered(
    actuation: Actuation, linear_drag_1_s: float, drag_1_s: _Value, sigma: _Value, of: list[_Value]
) -> tuple[_Value, _Value, _Value]:
    """Acceleration, its rate and the input of axes whose position has four derivatives.

    Args:
        actuation: of the axes.
        linear_drag_1_s: of the plant.
        drag_1_s: with the quadratic part.
        sigma: to be cancelled.
        of: velocity, acceleration, jerk and snap.
    """
    v, v1, v2, v3 = of
    omega, lag_s = actuation.natural_frequency_rad_s, actuation.lag_s
    if actuation.interface == "acceleration":
        a = v1 + drag_1_s * v - sigma
        rate = v2 + linear_drag_1_s * v1
        return a, rate, a + lag_s * rate + (v3 + linear_drag_1_s * v2) / omega**2
    a = v1 - sigma
    return a, 0.0 * v, v + lag_s * a + v2 / omega**2
