"""How far a loop is from instability: in gain, phase and delay at the plant's input.

In continuous time the margins are read off the loop transfer function L(jω), with the exact delay.
Of the sampled loop they are found by trial: the first factor, or the first delay, at which the
spectral radius of the period's matrix reaches 1.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from companion.control.reference_model import Array
from companion.theory.nyquist import OfS
from companion.theory.plant import imaginary
from companion.theory.sampled_data import SampledLoop, period_map

_LOWEST_RAD_S, _HIGHEST_RAD_S = 1e-3, 1e3
_POINTS = 60_000
_LARGEST_FACTOR = 20.0
_LONGEST_DELAY_S = 1.0
_BISECTIONS = 18


@dataclass(frozen=True, slots=True)
class Margins:
    """Of a stable loop; each is the nearest one where several crossings exist."""

    gain_up: float
    """Factor > 1 on the plant's gain at which it becomes unstable; infinite if none does."""
    gain_down: float
    """Factor < 1 at which it becomes unstable; 0 if none does."""
    phase_rad: float
    """Phase lag that it bears."""
    delay_s: float
    """Delay that it bears on top of what it has."""
    crossover_rad_s: float
    """Where |L| falls below 1 for the last time."""
    nearest: float
    """min |1 + L|: distance of the Nyquist curve from -1."""


def continuous_margins(open_loop: OfS) -> Margins:
    """Margins of a loop that is stable with L.

    Args:
        open_loop: L(s), with the sign of 1 + L.
    """
    omega = np.geomspace(_LOWEST_RAD_S, _HIGHEST_RAD_S, _POINTS)
    values = open_loop(imaginary(omega))
    magnitude = np.log(np.abs(values))
    # Where the curve crosses the negative real axis.
    crosses = np.flatnonzero((values.imag[1:] * values.imag[:-1] < 0.0) & (values.real[1:] < 0.0))
    share = values.imag[crosses] / (values.imag[crosses] - values.imag[crosses + 1])
    at_axis = np.exp(-(magnitude[crosses] + share * (magnitude[crosses + 1] - magnitude[crosses])))
    up, down = at_axis[at_axis > 1.0], at_axis[at_axis < 1.0]
    # Where it crosses the unit circle.
    unit = np.flatnonzero(magnitude[1:] * magnitude[:-1] < 0.0)
    part = magnitude[unit] / (magnitude[unit] - magnitude[unit + 1])
    at_unit = omega[unit] * (omega[unit + 1] / omega[unit]) ** part
    phase = (np.angle(open_loop(imaginary(at_unit))) + np.pi) % (2.0 * np.pi)
    return Margins(
        gain_up=float(up.min()) if len(up) else float("inf"),
        gain_down=float(down.max()) if len(down) else 0.0,
        phase_rad=float(phase.min()) if len(phase) else float("inf"),
        delay_s=float((phase / at_unit).min()) if len(phase) else float("inf"),
        crossover_rad_s=float(at_unit[-1]) if len(at_unit) else 0.0,
        nearest=float(np.abs(1.0 + values).min()),
    )


@dataclass(frozen=True, slots=True)
class SampledMargins:
    """Of the sampled loop, (axes,) each; not a number where the loop itself is unstable."""

    gain_up: Array
    """Infinite where none up to 20 makes it unstable."""
    gain_down: Array
    """0 where none down to 1/20 does."""
    delay_s: Array
    """Infinite where none up to 1 s does."""


def sampled_margins(loop: SampledLoop) -> SampledMargins:
    """Critical gains and delay of each axis, the others as they are (they do not see each other).

    The first ones on the way out are found, in steps of 8 % (gain) and 4 ms (delay).
    """
    axes = len(loop.plants)

    def with_gain(factor: Array) -> Array:
        return period_map(replace(loop, gain=factor)).radii

    def with_delay(delay_s: Array) -> Array:
        return period_map(replace(loop, more_delay_s=delay_s)).radii

    stable = period_map(loop).radii < 1.0
    growing = 1.08 ** np.arange(0.0, np.log(_LARGEST_FACTOR) / np.log(1.08))
    delays = np.arange(0.0, _LONGEST_DELAY_S, 0.004)
    nothing = np.full(axes, np.nan)
    return SampledMargins(
        gain_up=np.where(stable, first_unstable(with_gain, growing, axes, np.inf), nothing),
        gain_down=np.where(stable, first_unstable(with_gain, 1.0 / growing, axes, 0.0), nothing),
        delay_s=np.where(stable, first_unstable(with_delay, delays, axes, np.inf), nothing),
    )


def first_unstable(
    radii: Callable[[Array], Array], values: Array, axes: int, otherwise: float
) -> Array:
    """First value at which the radius of an axis reaches 1, bisected; `otherwise` if none does.

    Args:
        radii: (axes,) radii for (axes,) values, each axis on its own.
        values: to try in this order; the first is taken as stable.
        axes: their number.
        otherwise: what stands where no value is unstable.
    """
    inside, outside = np.full(axes, values[0]), np.full(axes, np.nan)
    for value in values[1:]:
        open_axes = np.isnan(outside)
        if not open_axes.any():
            break
        unstable = radii(np.where(open_axes, value, inside)) >= 1.0
        outside = np.where(open_axes & unstable, value, outside)
        inside = np.where(open_axes & ~unstable, value, inside)
    found = ~np.isnan(outside)
    if not found.any():
        return np.full(axes, otherwise)
    outside = np.where(found, outside, inside)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (inside + outside)
        unstable = radii(middle) >= 1.0
        outside = np.where(unstable, middle, outside)
        inside = np.where(unstable, inside, middle)
    return np.where(found, 0.5 * (inside + outside), otherwise)
