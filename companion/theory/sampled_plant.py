"""A(s) with its position, discretised exactly under a held input, the delay as held samples."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from companion.control.matrix_exponential import matrix_exponential
from companion.control.reference_model import Array
from companion.control.transfer_function import TransferFunction
from companion.theory.plant import AxisPlant


@dataclass(frozen=True, slots=True)
class HeldPlant:
    """One axis over one sample: ``x+ = Φ x + late u(k-d-1) + early u(k-d)``, x with position."""

    phi: Array
    late: Array
    early: Array
    whole: int
    """d: whole samples of delay."""


def hold(plant: AxisPlant, sample_s: float, gain: float, more_delay_s: float) -> HeldPlant:
    """Discretise one axis.

    Args:
        plant: A(s).
        sample_s: period of the samples.
        gain: factor on its input.
        more_delay_s: on top of its own.
    """
    total = plant.delay_s + more_delay_s
    whole = math.floor(total / sample_s + 1e-9)
    phi, late, early = _held(plant.rational, sample_s, max(0.0, round(total - whole * sample_s, 9)))
    return HeldPlant(phi, gain * late, gain * early, whole)


@lru_cache(maxsize=1024)
def _held(rational: TransferFunction, h: float, rest: float) -> tuple[Array, Array, Array]:
    """Φ and the inputs' columns of a step h within which the input changes after `rest`."""
    a, b, _ = rational.state_space()
    n = len(b)
    system = np.zeros((n + 2, n + 2))  # velocity ..., position, input
    system[:n, :n], system[:n, n + 1] = a, b
    system[n, 0] = 1.0
    first, second = matrix_exponential(system * rest), matrix_exponential(system * (h - rest))
    keep = n + 1
    late = second[:keep, :keep] @ first[:keep, -1]
    return (second @ first)[:keep, :keep], late, second[:keep, -1]
