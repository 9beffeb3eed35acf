"""Transfer functions of one axis, as the L1 controller's M(s) and C(s) are given."""

from dataclasses import dataclass

import numpy as np

from companion.control.reference_model import Array


@dataclass(frozen=True, slots=True)
class TransferFunction:
    """A strictly proper transfer function; coefficients in descending powers of s."""

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse what is not strictly proper.

        Raises:
            ValueError: not strictly proper, a leading zero, or a coefficient that is not finite.
        """
        numbers = (*self.numerator, *self.denominator)
        if not self.numerator or not np.isfinite(numbers).all() or self.denominator[0] == 0.0:
            raise ValueError("a transfer function needs finite coefficients, the leading one not 0")
        if len(self.numerator) >= len(self.denominator):
            raise ValueError("a transfer function must be strictly proper")

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.denominator) - 1

    @property
    def dc_gain(self) -> float:
        """Value at s = 0; infinite with an integrator."""
        if self.denominator[-1] == 0.0:
            return float("inf")
        return self.numerator[-1] / self.denominator[-1]

    @property
    def stable(self) -> bool:
        """All poles lie in the open left half plane."""
        return bool((np.roots(self.denominator).real < 0.0).all())

    @property
    def strictly_positive_real(self) -> bool:
        """Stable, of relative degree 1, and of positive real part on the imaginary axis.

        With N(s)/D(s): ``Re N(jω) D(-jω)`` is a polynomial in ω² that must have no root at ω² ≥ 0;
        at infinity ``ω² Re`` must stay positive (Khalil, Nonlinear Systems, lemma 6.1).
        """
        if not self.stable or len(self.numerator) != len(self.denominator) - 1:
            return False
        product = np.polymul(self.numerator, np.array(self.denominator) * _alternating(self.order))
        ascending = product[::-1]
        # Even powers of s = jω: s² = -ω².
        even = ascending[::2] * np.where(np.arange(len(ascending[::2])) % 2 == 0, 1.0, -1.0)
        if even[0] <= 0.0 or even[-1] <= 0.0 or len(even) < self.order:
            return False
        roots = np.roots(even[::-1])
        real = roots[np.abs(roots.imag) < 1e-9 * (1.0 + np.abs(roots))].real
        return not bool((real >= 0.0).any())

    def __str__(self) -> str:
        """Coefficients, for messages."""
        return f"{list(self.numerator)} / {list(self.denominator)}"

    def state_space(self) -> tuple[Array, Array, Array]:
        """Observer form (A (n, n), B (n,), C (n,)): the output is the first state."""
        n = self.order
        denominator = np.array(self.denominator) / self.denominator[0]
        numerator = np.zeros(n)
        numerator[n - len(self.numerator) :] = np.array(self.numerator) / self.denominator[0]
        a = np.eye(n, k=1)
        a[:, 0] = -denominator[1:]
        c = np.zeros(n)
        c[0] = 1.0
        return a, numerator, c


def _alternating(order: int) -> Array:
    """Signs that make p(-s) of p(s), for coefficients in descending powers."""
    signs: Array = np.where(np.arange(order, -1, -1) % 2 == 0, 1.0, -1.0)
    return signs


def first_order(bandwidth: float) -> TransferFunction:
    """``a / (s + a)``: the paper's M_i(s) with a = m_i, and its C_i(s) with a = ω_i."""
    return TransferFunction((bandwidth,), (1.0, bandwidth))
