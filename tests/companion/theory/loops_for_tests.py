"""Plants and loops that the tests of the theory share."""

import numpy as np

from companion.control.thrust import GRAVITY_M_S2
from companion.control.transfer_function import TransferFunction, first_order
from companion.theory.loops import AxisLoop
from companion.theory.plant import AxisPlant


def horizontal(omega=12.0, zeta=0.81, drag=0.15, delay_s=0.04) -> AxisPlant:
    """Gravity over attitude and drag; omega of None for an attitude without lag."""
    if omega is None:
        return AxisPlant(TransferFunction((GRAVITY_M_S2,), (1.0, drag)), delay_s)
    attitude = (1.0, 2.0 * zeta * omega, omega**2)
    denominator = tuple(np.polymul(attitude, (1.0, drag)).tolist())
    return AxisPlant(TransferFunction((GRAVITY_M_S2 * omega**2,), denominator), delay_s)


def loop_of(plant, m=0.5, omega=0.215, gain_k=0.75, gamma=300.0) -> AxisLoop:
    return AxisLoop(plant, first_order(m), first_order(omega), gain_k, gamma)
