"""L1 norms: the integral of the absolute impulse response, the gain from peak to peak.

``‖G‖ = |g_direct| + ∫|g(t)| dt`` is the induced norm from bounded inputs to bounded outputs
(Desoer & Vidyasagar, Feedback Systems: Input-Output Properties, 1975, section III.2).  With a delay
inside a loop there is no finite state: there the impulse response comes from the frequency response
with the exact delay, by the inverse Fourier transform.  Every norm is a numerical value, with the
change that a grid twice as fine and twice as long makes as its uncertainty.
"""

from dataclasses import dataclass

import numpy as np

from companion.control.matrix_exponential import matrix_exponential
from companion.control.reference_model import Array
from companion.theory.nyquist import OfS
from companion.theory.plant import imaginary

_FADED = 28.0
"""Time constants after which a response counts as over: e^-28 is below 1e-12."""
_FEWEST_S, _LONGEST_S = 20.0, 2000.0


@dataclass(frozen=True, slots=True)
class L1Norm:
    """A norm with the impulse response that it came from."""

    value: float
    uncertainty: float
    """Numerical: the change from a grid half as fine and half as long."""
    times_s: Array
    response: Array


def from_frequency_response(g: OfS, decay_1_s: float, step_s: float = 1e-3) -> L1Norm:
    """Norm of a stable g(s) that falls off at least as s⁻² at high frequencies.

    Args:
        g: value at complex frequencies.
        decay_1_s: decay rate of its slowest pole, 1/s.
        step_s: of the impulse response.

    Raises:
        ValueError: the decay rate is not positive.
    """
    if decay_1_s <= 0.0:
        raise ValueError("an unstable system has no L1 norm")
    length_s = min(_LONGEST_S, max(_FEWEST_S, _FADED / decay_1_s))
    times, response = _impulse_response(g, length_s, step_s)
    fine = float(np.abs(response).sum() * step_s)
    half_times, half = _impulse_response(g, 0.5 * length_s, 2.0 * step_s)
    coarse = float(np.abs(half).sum() * (half_times[1] - half_times[0]))
    return L1Norm(fine, abs(fine - coarse), times, response)


def _impulse_response(g: OfS, length_s: float, step_s: float) -> tuple[Array, Array]:
    count = 1 << int(np.ceil(np.log2(length_s / step_s)))
    omega: Array = np.asarray(2.0 * np.pi * np.fft.rfftfreq(count, step_s), dtype=np.float64)
    omega[0] = 1e-6 * omega[1]  # G may be 0/0 at 0
    response: Array = np.fft.irfft(g(imaginary(omega)), count) / step_s
    return np.arange(count, dtype=np.float64) * step_s, response


def of_rational(numerator: tuple[float, ...], denominator: tuple[float, ...]) -> float:
    """Norm of a stable, proper rational function; coefficients in descending powers of s.

    Raises:
        ValueError: not proper, or not stable.
    """
    if len(denominator) == 1:
        return abs(float(numerator[0] / denominator[0]))
    quotient, remainder = np.polydiv(numerator, denominator)
    poles = np.roots(denominator)
    if len(quotient) > 1 or (poles.real >= 0.0).any():
        raise ValueError("only a proper, stable function has an L1 norm")
    n = len(denominator) - 1
    a = np.eye(n, k=1)
    a[:, 0] = -np.asarray(denominator[1:]) / denominator[0]
    b = np.zeros(n)
    b[n - len(remainder) :] = remainder / denominator[0]
    step_s = 2e-3 / float(np.abs(poles).max())
    count = int(np.ceil(_FADED / float(-poles.real.max()) / step_s))
    states = b[:, None]
    advance = matrix_exponential(a * step_s)
    while states.shape[1] <= count:
        states = np.hstack([states, advance @ states])
        advance = advance @ advance
    return float(abs(quotient[0]) + np.trapezoid(np.abs(states[0]), dx=step_s))
