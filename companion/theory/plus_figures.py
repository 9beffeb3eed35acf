"""Figures of MPC-L1+'s sampled loop: margins, responses to disturbances, what noise makes."""

import math
from dataclasses import dataclass

import numpy as np

from companion.control.plus import predictor
from companion.control.plus.predictor import PredictorMemory, PredictorNoise
from companion.control.reference_model import Array
from companion.theory.margins import first_unstable
from companion.theory.plant import ComplexArray
from companion.theory.plus_family import gain, late, slow
from companion.theory.plus_law import AXES, PlusLaw
from companion.theory.plus_loop import (
    DISTURBANCE,
    NOISE,
    ClosedLoop,
    PlusAxisPlant,
    broken_at_u,
    closed_loop,
    law_response,
    radii,
)

_LARGEST_FACTOR = 20.0
_LONGEST_DELAY_S = 0.5
_FREQUENCIES = 1500
_LOWEST_RAD_S = 0.02
_FADED = 28.0
_LONGEST = 200_000
_DOUBLINGS = 40


@dataclass(frozen=True, slots=True)
class PlusMargins:
    """Of one axis, at the vehicle's input; not a number where the loop itself is unstable."""

    gain_up: float
    """Infinite where none up to 20 makes it unstable."""
    gain_down: float
    """0 where none down to 1/20 does."""
    delay_s: float
    """That the law is not told; infinite where none up to 0.5 s makes it unstable."""
    phase_rad: float
    """Lag at the nearest crossing of |L| = 1."""
    modulus: float
    """min |1 + L|: the inverse of the sensitivity's peak."""
    modulus_rad_s: float
    """Where that is."""
    crossover_rad_s: float
    """Where |L| falls below 1 for the last time."""


def frequencies(sample_s: float) -> Array:
    """(k,) rad/s up to half the sampling frequency."""
    found: Array = np.geomspace(_LOWEST_RAD_S, math.pi / sample_s, _FREQUENCIES)
    return found


def margins(law: PlusLaw, plants: tuple[PlusAxisPlant, ...]) -> tuple[PlusMargins, ...]:
    """Of all axes; gain and delay by trial, in steps of 5 % and 2 ms on the way out."""

    def with_gain(factors: Array) -> Array:
        changed = [gain(float(f))(p) for f, p in zip(factors, plants, strict=True)]
        return radii(law, tuple(changed))

    def with_delay(delays_s: Array) -> Array:
        changed = [late(float(s))(p) for s, p in zip(delays_s, plants, strict=True)]
        return radii(law, tuple(changed))

    growing = 1.05 ** np.arange(0.0, np.log(_LARGEST_FACTOR) / np.log(1.05))
    up = first_unstable(with_gain, growing, AXES, np.inf)
    down = first_unstable(with_gain, 1.0 / growing, AXES, 0.0)
    delay = first_unstable(with_delay, np.arange(0.0, _LONGEST_DELAY_S, 0.002), AXES, np.inf)
    stable = radii(law, plants) < 1.0
    return tuple(
        _margins(law, i, plants[i], float(up[i]), float(down[i]), float(delay[i]))
        if stable[i]
        else PlusMargins(*(math.nan,) * 7)
        for i in range(AXES)
    )


def modulus(loop: ComplexArray) -> float:
    """Min |1 + L| over the frequencies of a loop that is stable."""
    return float(np.abs(1.0 + loop).min())


def _margins(
    law: PlusLaw, axis: int, plant: PlusAxisPlant, up: float, down: float, delay_s: float
) -> PlusMargins:
    h, omega = law.sample_s, frequencies(law.sample_s)
    loop = broken_at_u(law_response(law, axis, omega), plant, omega, h)
    size = np.log(np.abs(loop))
    cross = np.flatnonzero(size[1:] * size[:-1] < 0.0)
    share = size[cross] / (size[cross] - size[cross + 1])
    at = omega[cross] * (omega[cross + 1] / omega[cross]) ** share
    there = broken_at_u(law_response(law, axis, at), plant, at, h)
    phase = (np.angle(there) + np.pi) % (2.0 * np.pi)
    distance = np.abs(1.0 + loop)
    return PlusMargins(
        gain_up=up,
        gain_down=down,
        delay_s=delay_s,
        phase_rad=float(phase.min()) if len(phase) else math.inf,
        modulus=float(distance.min()),
        modulus_rad_s=float(omega[distance.argmin()]),
        crossover_rad_s=float(at[-1]) if len(at) else 0.0,
    )


@dataclass(frozen=True, slots=True)
class Noises:
    """White noise of an axis, one sigma."""

    position_m: float
    velocity_m_s: float
    acceleration_m_s2: float
    """Of the one by the measured tilt."""
    unexplained_m_s2_sqrt_hz: float
    """Density of acceleration that nothing explains."""


def deviation(loop: ClosedLoop, output: int, noises: Noises) -> float:
    """Standard deviation of an output under white noise; NaN for an unstable loop."""
    if loop.radius >= 1.0:
        return math.nan
    size = np.zeros(loop.b.shape[1])
    size[DISTURBANCE] = noises.unexplained_m_s2_sqrt_hz / math.sqrt(loop.sample_s)
    size[NOISE] = (noises.position_m, noises.velocity_m_s, noises.acceleration_m_s2, 0.0)
    b, d = loop.b * size, loop.d[output] * size
    covariance = _covariance(loop.a, b @ b.T)
    c = loop.c[output]
    return float(np.sqrt(c @ covariance @ c + d @ d))


def gust_deviation(loop: ClosedLoop, output: int, correlation_s: float) -> float:
    """Standard deviation of an output under disturbances of 1 m/s² that forget in a time.

    The disturbance is a first-order Gauss-Markov process; NaN for an unstable loop.
    """
    if loop.radius >= 1.0:
        return math.nan
    n = len(loop.a)
    keep = math.exp(-loop.sample_s / correlation_s)
    a, b = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
    a[:n, :n], a[:n, n], a[n, n] = loop.a, loop.b[:, DISTURBANCE], keep
    b[n] = math.sqrt(1.0 - keep * keep)
    covariance = _covariance(a, np.outer(b, b))
    c = np.append(loop.c[output], loop.d[output, DISTURBANCE])
    return float(np.sqrt(c @ covariance @ c))


def step_response(loop: ClosedLoop, output: int, seconds: float) -> Array:
    """(k,) an output at the samples after a disturbance of 1 m/s² has set in."""
    x = np.zeros(len(loop.a))
    found = np.empty(round(seconds / loop.sample_s) + 1)
    for k in range(len(found)):
        found[k] = loop.c[output] @ x + loop.d[output, DISTURBANCE]
        x = loop.a @ x + loop.b[:, DISTURBANCE]
    return found


def rest(loop: ClosedLoop, output: int) -> float:
    """What stays of an output under a lasting disturbance of 1 m/s²; NaN for an unstable loop."""
    if loop.radius >= 1.0:
        return math.nan
    x = np.linalg.solve(np.eye(len(loop.a)) - loop.a, loop.b[:, DISTURBANCE])
    return float(loop.c[output] @ x + loop.d[output, DISTURBANCE])


def peak_gain(loop: ClosedLoop, output: int) -> float:
    """Largest output, at the samples, under any disturbance of at most 1 m/s², held over samples.

    The discrete L1 norm: the sum of the absolute impulse response.  Infinite if unstable.
    """
    radius = loop.radius
    if radius >= 1.0:
        return math.inf
    return _absolute_sum(loop.a, loop.b[:, DISTURBANCE], loop.c[output], radius)


def _covariance(a: Array, q: Array) -> Array:
    """``P = A P Aᵀ + Q`` of a stable A, by doubling the number of terms of its sum."""
    total, power = q, a
    for _ in range(_DOUBLINGS):
        more = power @ total @ power.T
        total = total + more
        power = power @ power
        if np.abs(more).max() <= 1e-14 * np.abs(total).max():
            break
    return total


def _absolute_sum(a: Array, b: Array, c: Array, radius: float) -> float:
    count = min(_LONGEST, math.ceil(_FADED / -math.log(max(radius, 1e-3))))
    states, advance = b[:, None], a
    while states.shape[1] < count:
        states = np.hstack([states, advance @ states])
        advance = advance @ advance
    return float(np.abs(c @ states).sum())


@dataclass(frozen=True, slots=True)
class PredictorFigures:
    """Of the predictor by itself, at its steady gain; (3,) each."""

    radius: Array
    """Spectral radius of its error per sample."""
    y_tilde_s2: Array
    """Largest |ṽ| per bound of |σ'|, without noise, s²."""


def predictor_figures(
    noise: PredictorNoise, drag_1_s: Array, covariance: Array, sample_s: float
) -> PredictorFigures:
    """How the predictor's error dies away, and what a moving σ makes of ṽ.

    The acceleration by tilt and thrust is taken as known exactly.  With it the error does not
    depend on the loop around it.

    Args:
        noise: what its gains are made of.
        drag_1_s: (3,) k of each axis.
        covariance: (3, 3, 3) at rest.
        sample_s: between two samples.
    """
    h, still = sample_s, np.zeros(AXES)
    bound = np.full(AXES, np.inf)
    matrices, rows = np.empty((AXES, 3, 3)), np.empty((AXES, 3))
    for j in range(3):
        memory = PredictorMemory(np.tile(np.eye(3)[j], (AXES, 1)), covariance)
        after, record = predictor.step(noise, memory, drag_1_s, bound, still, still, still, h)
        matrices[:, :, j], rows[:, j] = after.estimate, record.y_tilde_m_s
    sizes, gains = np.empty(AXES), np.empty(AXES)
    for i in range(AXES):
        sizes[i] = np.abs(np.linalg.eigvals(matrices[i])).max()
        transition = np.array([[1.0, h, 0.5 * h * h], [0.0, 1.0 - drag_1_s[i] * h, h], [0, 0, 1.0]])
        moved = np.linalg.solve(transition, np.array([h**3 / 6.0, h * h / 2.0, h]))
        gains[i] = math.inf
        if sizes[i] < 1.0:
            gains[i] = _absolute_sum(matrices[i], moved, rows[i], float(sizes[i]))
    return PredictorFigures(sizes, gains)


def slow_and_late(
    law: PlusLaw, axis: int, plant: PlusAxisPlant, factors: Array, delays_s: Array
) -> Array:
    """(factors, delays) spectral radii where the response is slower and the dead time longer."""
    found = np.empty((len(factors), len(delays_s)))
    for k, factor in enumerate(factors):
        for m, delay_s in enumerate(delays_s):
            changed = late(float(delay_s))(slow(float(factor))(plant))
            found[k, m] = closed_loop(law, axis, changed).radius
    return found
