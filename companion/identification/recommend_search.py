"""Searches the gains of one axis that are worth most on a family of plants.

What is searched over is K, the damping ½ √(m/K) of D(s), ω/m, Γ and the horizon; the gain of the
velocity loop that the L1 controller is for Γ → ∞ is ω/m times the plant's.  The ranges scale with
the vehicle's lag, so that they do for a quick vehicle and for a slow one.  Differential evolution
(Storn & Price 1997) with a fixed seed: the same family gives the same gains.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from companion.control.reference_model import Array
from companion.identification.recommend_loop import Candidates
from companion.identification.recommend_score import Scorer, Scores

_PER_VARIABLE = 6
_SEED = 1


@dataclass(frozen=True, slots=True)
class Space:
    """Where gains are searched: (least, largest) of each."""

    k: tuple[float, float]
    damping: tuple[float, float]
    """Of D(s): that of the position loop while the position reference rests."""
    omega_over_m: tuple[float, float]
    gamma: tuple[float, float]
    horizon_s: tuple[float, float] | None
    """None: the horizon is given."""
    horizon: int = 0
    """Where it is given."""
    generations: int = 60


@dataclass(frozen=True, slots=True)
class Found:
    """The best gains of an axis, and what they are worth."""

    candidate: Candidates
    """One."""
    scores: Scores
    evaluated: int


class NothingHoldsError(Exception):
    """No gains were found that every plant of the family is stable with."""


def search(scorer: Scorer, space: Space, progress: Callable[[int], None] | None = None) -> Found:
    """Search; deterministic, of the order of ten seconds.

    Args:
        scorer: of the family.
        space: where to search.
        progress: told how many generations are done; it may end before the last one.

    Raises:
        NothingHoldsError: nothing that holds was found.
    """
    from scipy.optimize import differential_evolution

    ranges = [space.k, space.damping, space.omega_over_m, space.gamma]
    if space.horizon_s is not None:
        ranges.append(space.horizon_s)
    period_s = scorer.period_s

    def candidates(x: Array) -> Candidates:
        values = np.exp(x)
        k = values[0]
        m = 4.0 * values[1] ** 2 * k
        omega = values[2] * m
        horizon = np.full(len(k), space.horizon)
        if space.horizon_s is not None:
            horizon = np.maximum(2, np.round(values[4] / period_s)).astype(int)
        # Sampled ten times or more in a turn of its mode, Γ is called safe.
        gamma = np.floor(np.minimum(values[3], scorer.safe_m_gamma / m))
        return Candidates(_rounded(m), _rounded(omega), _rounded(k), gamma, tuple(horizon.tolist()))

    def cost(x: Array) -> Array:
        return scorer.scores(candidates(x)).total_mm

    generations = 0

    def told(*_: object, **__: object) -> None:
        nonlocal generations
        generations += 1
        if progress is not None:
            progress(generations)

    result = differential_evolution(
        cost,
        [(float(np.log(low)), float(np.log(high))) for low, high in ranges],
        popsize=_PER_VARIABLE,
        maxiter=space.generations,
        seed=_SEED,
        vectorized=True,
        updating="deferred",
        polish=False,
        tol=1e-3,
        callback=told,
    )
    best = candidates(np.asarray(result.x)[:, None])
    scores = scorer.scores(best)
    if not scores.hold[0]:
        raise NothingHoldsError(
            "no gains of mpc-l1 were found with which every plant of the family about this vehicle "
            "is stable: its response is too slow, or its delay too long, for this controller. "
            "Look at the identified figures; raise the autopilot's attitude gains, or fly with "
            "less delay"
        )
    return Found(best, scores, int(result.nfev))


def _rounded(values: Array) -> Array:
    """To three digits, as the file has them."""
    digits = 2 - np.floor(np.log10(values)).astype(int)
    return np.array([round(v, d) for v, d in zip(values.tolist(), digits.tolist(), strict=True)])
