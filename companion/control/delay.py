"""Carrying the state over the delay of the loop.

What the controller decides now acts on the vehicle only after the telemetry's and the command's
transport delay; so the outer controller plans from the state that the vehicle will have then.  The
way there is known: the ideal system D(s) under the references that were applied meanwhile.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from companion.control.reference_model import Array, discretise_position_model


# Made at every tick, and frozen it takes several times as long to make: change none.
@dataclass(slots=True)
class AppliedReference:
    """A position reference and the time from which on it acts on the vehicle."""

    from_s: float
    r2_m: Array


_Rows = tuple[float, float, float, float, float, float]
"""Of an axis: a11, a12, a21, a22, b1, b2."""


@lru_cache(maxsize=512)
def _model(m: tuple[float, ...], gain_k: tuple[float, ...], dt_ms: int) -> tuple[_Rows, ...]:
    """The discretised model in plain floats, which for two states are quicker than arrays."""
    a, b = discretise_position_model(np.array(m), np.array(gain_k), dt_ms * 1e-3)
    return tuple(
        (a11, a12, a21, a22, b1, b2)
        for ((a11, a12), (a21, a22)), (b1, b2) in zip(a.tolist(), b.tolist(), strict=True)
    )


def carry(
    m: tuple[float, ...],
    gain_k: tuple[float, ...],
    position_m: Array,
    velocity_m_s: Array,
    sample_s: float,
    until_s: float,
    applied: tuple[AppliedReference, ...],
) -> tuple[Array, Array]:
    """State at `until_s` of the ideal system that was seen at `sample_s`.

    Args:
        m: (axes,) as in the L1 controller, 1/s.
        gain_k: (axes,) K, 1/s.
        position_m: (axes,) at the sample.
        velocity_m_s: (axes,) at the sample.
        sample_s: time of the sample.
        until_s: time to carry it to; intervals are rounded to a millisecond.
        applied: references in order of time, the first in effect at `sample_s` or before; if it
            is later than that, it is taken as in effect from `sample_s` on.
    """
    position, velocity = position_m.tolist(), velocity_m_s.tolist()
    now = sample_s
    for k, reference in enumerate(applied):
        end = applied[k + 1].from_s if k + 1 < len(applied) else until_s
        span_ms = round((min(end, until_s) - now) * 1e3)
        if span_ms <= 0:
            continue
        model, r2 = _model(m, gain_k, span_ms), reference.r2_m.tolist()
        for i, (a11, a12, a21, a22, b1, b2) in enumerate(model):
            p, v, r = position[i], velocity[i], r2[i]
            position[i] = a11 * p + a12 * v + b1 * r
            velocity[i] = a21 * p + a22 * v + b2 * r
        now += span_ms * 1e-3
    return np.array(position), np.array(velocity)
