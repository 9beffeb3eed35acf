"""What gains are worth on a family of plants: the mean tracking error, in mm, and what is added."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.control.reference_model import Array
from companion.control.transfer_function import first_order
from companion.identification.recommend_loop import Candidates, LoopBuilder
from companion.identification.recommend_plants import Member
from companion.identification.recommend_run import (
    Indices,
    Loops,
    covariance,
    radii,
    responses,
)
from companion.theory.adaptation_rate import well_sampled_limit
from companion.trajectories.harmonic import TEST_TRAJECTORIES

HOVER_S, SCORED_S = 2.0, 20.0
TIMES_NOMINAL = 1.7
"""Tracking error of a perturbed plant over the nominal one's that is taken without a murmur."""
_MURMUR = 3.0
"""What each mm beyond it counts."""
_LARGEST_RADIUS = 0.998
"""Per period: slower decay than that is as good as none."""
_FLOWN_AWAY_MM = 2000.0
_NOISE_SIGMAS = 2.0
_CALM = 1e-3
_FIRST = np.array([0])
_GUSTS_EVERY_S, _GUST_LASTS_S = 3.0, 0.4
"""Each the other way than the one before it."""


@dataclass(frozen=True, slots=True)
class Paths:
    """The axes of trajectories that are tracked at once."""

    columns: tuple[tuple[int, int], ...]
    """(number of the test trajectory, axis)."""

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Columns of the same trajectory."""
        numbers = sorted({number for number, _ in self.columns})
        return tuple(
            tuple(i for i, (n, _) in enumerate(self.columns) if n == number) for number in numbers
        )


HORIZONTAL = Paths(tuple((number, axis) for number in (1, 2, 3, 4, 5) for axis in (0, 1)))
VERTICAL = Paths(tuple((number, 2) for number in (1, 3, 4, 5)))


@dataclass(frozen=True, slots=True)
class Scores:
    """Of candidates."""

    total_mm: Array
    """(candidates,) weighted mean over the family with all penalties: what is searched."""
    errors_mm: Array
    """(members, candidates) mean tracking error; infinite of an unstable loop."""
    radii: Array
    """(members, candidates) spectral radii over a period of the MPC."""

    @property
    def hold(self) -> NDArray[np.bool_]:
        """(candidates,) whether every loop is stable."""
        stable: NDArray[np.bool_] = np.all(self.radii < _LARGEST_RADIUS, axis=0)
        return stable


class Scorer:
    """Scores candidates of one axis."""

    def __init__(
        self, builder: LoopBuilder, paths: Paths, longest_horizon: int, command_limit: float
    ) -> None:
        """Lay the trajectories out at the times of the plans.

        Args:
            builder: of the family's loops.
            paths: to be tracked.
            longest_horizon: N_h of any candidate.
            command_limit: of |u|.
        """
        self._command_limit = command_limit
        self._builder, self._paths = builder, paths
        rates = builder.rates
        self._steps = round((HOVER_S + SCORED_S) / rates.period_s)
        self._first = round(HOVER_S / rates.period_s)
        times: Array = (
            np.arange(self._steps + longest_horizon + 2, dtype=np.float64) * rates.period_s
            - HOVER_S
        )
        self._now = _desired(paths, times[: self._steps])
        self._ahead = _desired(paths, times + rates.known_delay_s)
        at = times[: self._steps]
        shape = np.zeros(self._steps)
        for k, centre_s in enumerate(np.arange(0.5 * _GUSTS_EVERY_S, SCORED_S, _GUSTS_EVERY_S)):
            shape += (-1.0) ** k * np.exp(-(((at - centre_s) / _GUST_LASTS_S) ** 2))
        shape[np.abs(shape) < _CALM] = 0.0
        self._gust = np.stack([member.gust * shape for member in builder.family])

    @property
    def family(self) -> tuple[Member, ...]:
        """The plants, the nominal one first."""
        return self._builder.family

    @property
    def period_s(self) -> float:
        """Of the MPC."""
        return self._builder.rates.period_s

    @property
    def safe_m_gamma(self) -> float:
        """Largest m Γ that the samples hold well, 1/s³."""
        return well_sampled_limit(first_order(1.0), self._builder.rates.sample_s)

    def scores(self, candidates: Candidates) -> Scores:
        """Score them."""
        family = self._builder.family
        loops = self._builder.loops(candidates)
        found = radii(loops)
        stable = found < _LARGEST_RADIUS
        weights = np.array([member.weight for member in family])
        errors, costs = np.full(found.shape, np.inf), np.full(found.shape, np.inf)
        # A candidate that is unstable anywhere is out: what it does elsewhere is of no use.
        good = np.flatnonzero(stable.all(axis=0))
        total = _FLOWN_AWAY_MM * (
            1.0 + 100.0 * np.maximum(found.max(axis=0) - _LARGEST_RADIUS, 0.0)
        )
        if len(good):
            kept = np.flatnonzero(weights > 0.0)
            scored = np.ix_(kept, good)
            errors[scored], noisy = self._errors(loops.part(kept, good), kept)
            costs[scored] = errors[scored] * noisy
            mean = (weights[kept, None] * costs[scored]).sum(axis=0) / weights.sum()
            bounded = np.array([member.bounded for member in family])
            over = costs[bounded][:, good] - TIMES_NOMINAL * costs[0, good]
            total[good] = mean + _MURMUR * np.maximum(over, 0.0).sum(axis=0)
        return Scores(total, errors, found)

    def noise_of_sigma(self, candidate: Candidates) -> float:
        """What noise makes of σ̂ of one candidate on the nominal plant, one sigma."""
        loops = self._builder.loops(candidate).part(_FIRST, _FIRST)
        at = loops.sigma_at
        return float(np.sqrt(covariance(loops)[0, 0, at, at]))

    def largest_second_difference_m_s2(self, candidate: Candidates, sigmas: float) -> float:
        """Of r2 of one candidate on the nominal plant: on the trajectories, and by noise on top."""
        loops = self._builder.loops(candidate).part(_FIRST, _FIRST)
        _, references = responses(loops, self._ahead, self._gust[_FIRST], self._steps)
        planned = float(np.abs(np.diff(references, n=2, axis=0)).max())
        kept = slice(loops.reference_at, loops.reference_at + 3)
        difference = np.array([1.0, -2.0, 1.0])
        variance = difference @ covariance(loops)[0, 0, kept, kept] @ difference
        return (planned + sigmas * float(np.sqrt(variance))) / self.period_s**2

    def _errors(self, loops: Loops, members: Indices) -> tuple[Array, Array]:
        """(members, candidates) tracking errors in mm, and what noise in u multiplies them by."""
        positions, _ = responses(loops, self._ahead, self._gust[members], self._steps)
        off = self._now[self._first :, None, None, :] - positions[self._first :]
        scatter = covariance(loops)
        variance = scatter[:, :, loops.position_at, loops.position_at]
        total = np.zeros(variance.shape)
        for group in self._paths.groups:
            squared = (off[..., group] ** 2).sum(axis=-1) + len(group) * variance
            total += np.sqrt(squared).mean(axis=0)
        # A command that noise drives to its limit leaves nothing for the trajectory, which the
        # linear model does not know.
        noisy = scatter[:, :, loops.command_at, loops.command_at] / self._command_limit**2
        return 1e3 * total / len(self._paths.groups), 1.0 + _NOISE_SIGMAS**2 * noisy


def _desired(paths: Paths, times_s: Array) -> Array:
    """(times, columns), m."""
    return np.stack(
        [TEST_TRAJECTORIES[n].position(times_s)[:, axis] for n, axis in paths.columns], axis=1
    )
