"""The transfer functions of the L1 norm condition and of the whole loop, in continuous time.

With ``F = 1 - C + C A / M`` the paper's functions are

* ``H = A M / (C A + (1 - C) M) = A / F``, so that ``y1 = H (C r1 + (1 - C) d)``,
* ``G = H (1 - C)``, and ``C H / M = C A / (M F)``,

which is the loop of Γ → ∞: A(s) under ``u = C/(1-C) r1 - C/(M (1-C)) y1``, for the paper's M and C
an I-P velocity loop.  H is stable exactly if F has no zero in the right half plane (Hovakimyan &
Cao, L1 Adaptive Control Theory, 2010, section 4.1 has H, G and the norm condition).

At a finite Γ the estimate is ``σ̂ = Q (y1/M - u)`` with ``Q = Γ M / (s + Γ M)`` from predictor and
adaptation law, which gives the loop transfer function, broken at the plant's input u, of the whole
L1 controller with its position loop K.
"""

from dataclasses import dataclass

import numpy as np

from companion.control.transfer_function import TransferFunction
from companion.theory.nyquist import OfS, unstable_zeros
from companion.theory.plant import AxisPlant, ComplexArray, evaluate

PADE_ORDER = 5
_NO_DELAY_S = 1e-6
"""Below it the approximation's fast poles are only a burden to the arithmetic."""


@dataclass(frozen=True, slots=True)
class AxisLoop:
    """One axis: the plant and the gains of its L1 controller."""

    plant: AxisPlant
    model: TransferFunction
    """M(s)."""
    low_pass: TransferFunction
    """C(s)."""
    gain_k: float
    gamma: float

    def f(self, s: ComplexArray) -> ComplexArray:
        """``1 - C + C A / M``."""
        c = evaluate(self.low_pass, s)
        return 1.0 - c + c * self.plant.at(s) / evaluate(self.model, s)

    def h(self, s: ComplexArray) -> ComplexArray:
        """H, from ``C r1 + (1 - C) d`` to y1."""
        return self.plant.at(s) / self.f(s)

    def g(self, s: ComplexArray) -> ComplexArray:
        """``G = H (1 - C)``, from d to y1."""
        return self.plant.at(s) * self.sensitivity(s)

    def sensitivity(self, s: ComplexArray) -> ComplexArray:
        """``(1 - C) / F``: what is left of a disturbance at y1."""
        return (1.0 - evaluate(self.low_pass, s)) / self.f(s)

    def ch_over_m(self, s: ComplexArray) -> ComplexArray:
        """``C H / M``, from r1 to y1 over M: how the estimation error comes to y1."""
        return evaluate(self.low_pass, s) * self.h(s) / evaluate(self.model, s)

    def broken_at_u(self, s: ComplexArray) -> ComplexArray:
        """Loop transfer function of the L1 controller and its position loop, sign of 1 + L."""
        a, numerator, denominator = self._parts(s)
        return numerator * a / denominator

    def return_difference(self, s: ComplexArray) -> ComplexArray:
        """``1 + L`` times what makes it analytic in the right half plane, tending to 1."""
        a, numerator, denominator = self._parts(s)
        analytic: ComplexArray = (denominator + numerator * a) * (s / (s + 1.0))
        return analytic * (s / (s + 1.0)) ** self.plant.integrators

    def _parts(self, s: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """A, ``C (K/s + Q/M)`` and ``1 - C Q``."""
        c, m = evaluate(self.low_pass, s), evaluate(self.model, s)
        q_over_m = self.gamma / (s + self.gamma * m)
        return self.plant.at(s), c * (self.gain_k / s + q_over_m), 1.0 - c * q_over_m * m


def h_is_stable(loop: AxisLoop) -> bool:
    """Whether H is stable, with the exact delay."""
    return unstable_zeros(_without_integrator(loop.plant, loop.f)) == 0


def whole_loop_is_stable(loop: AxisLoop) -> bool:
    """Whether predictor, adaptation law, C(s) and K around A(s) are stable, in continuous time."""
    return unstable_zeros(loop.return_difference) == 0


def poles_of_h(loop: AxisLoop, pade_order: int = PADE_ORDER) -> ComplexArray:
    """Poles of H with a Padé approximation of the delay, the slowest first.

    Good for the slow poles, |s| τ well below the order; `h_is_stable` needs no approximation.
    """
    delay_numerator, delay_denominator = pade(loop.plant.delay_s, pade_order)
    a, m, c = loop.plant.rational, loop.model, loop.low_pass
    rest = np.polysub(c.denominator, c.numerator)
    free = _product(rest, a.denominator, m.numerator, delay_denominator)
    fed_back = _product(c.numerator, a.numerator, m.denominator, delay_numerator)
    roots: ComplexArray = np.roots(np.polyadd(free, fed_back)).astype(np.complex128)
    return roots[np.argsort(-roots.real)]


def pade(delay_s: float, order: int) -> tuple[list[float], list[float]]:
    """Numerator and denominator of the diagonal Padé approximation of ``e^{-s delay}``."""
    if delay_s < _NO_DELAY_S:
        return [1.0], [1.0]
    coefficient = 1.0
    ascending = [coefficient]
    for k in range(1, order + 1):
        coefficient *= (order - k + 1) / ((2 * order - k + 1) * k) * delay_s
        ascending.append(coefficient)
    signed = [value * (-1.0) ** k for k, value in enumerate(ascending)]
    return signed[::-1], ascending[::-1]


def _product(*polynomials: object) -> np.ndarray:
    product = np.array([1.0])
    for polynomial in polynomials:
        product = np.polymul(product, np.atleast_1d(np.asarray(polynomial, dtype=np.float64)))
    return product


def _without_integrator(plant: AxisPlant, f: OfS) -> OfS:
    """F with the pole that an integrator in A(s) gives it moved into the left half plane."""

    def moved(s: ComplexArray) -> ComplexArray:
        value: ComplexArray = f(s) * (s / (s + 1.0)) ** plant.integrators
        return value

    return moved
