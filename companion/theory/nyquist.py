"""Counting zeros in the right half plane by the argument principle, with exact delays.

For an f(s) that is analytic in the closed right half plane and tends to 1 at infinity, the number
of its zeros there is the number of clockwise turns of f(jω) about 0 as ω goes from -∞ to ∞
(Desoer & Vidyasagar, Feedback Systems: Input-Output Properties, 1975, ch. IV).  A delay needs no
approximation for it: only values on the imaginary axis are used.
"""

from collections.abc import Callable

import numpy as np

from companion.theory.plant import ComplexArray, imaginary

OfS = Callable[[ComplexArray], ComplexArray]

_LOWEST_RAD_S = 1e-5
_LARGEST_TURN_RAD = 0.3
_REFINEMENTS = 40


def unstable_zeros(f: OfS) -> int | None:
    """Number of zeros of f in the open right half plane; None with one (nearly) on its edge.

    Args:
        f: analytic for Re s ≥ 0, real on the real axis, and tending to 1 at infinity.

    Raises:
        ValueError: f does not come to 1 within a frequency of 1e7 rad/s.
    """
    highest = 1e3
    while True:
        beyond = f(imaginary(np.geomspace(highest, 30.0 * highest, 400)))
        if np.abs(beyond - 1.0).max() < 0.2:
            break
        highest *= 3.0
        if highest > 1e7:
            raise ValueError("the loop does not roll off: is A(s) strictly proper?")
    omega = np.geomspace(_LOWEST_RAD_S, highest, 4000)
    values = f(imaginary(omega))
    for _ in range(_REFINEMENTS):
        turns = np.angle(values[1:] / values[:-1])
        coarse = np.flatnonzero(np.abs(turns) > _LARGEST_TURN_RAD)
        if not len(coarse):
            break
        between = np.sqrt(omega[coarse] * omega[coarse + 1])
        omega = np.insert(omega, coarse + 1, between)
        values = np.insert(values, coarse + 1, f(imaginary(between)))
    else:
        return None  # f goes through 0: no refinement makes its turn there a small one
    # f is real at 0 and 1 at infinity, so that the half axis turns by a whole number of π.
    total = float(np.angle(values[1:] / values[:-1]).sum()) - float(np.angle(values[-1]))
    return round(-total / np.pi)
