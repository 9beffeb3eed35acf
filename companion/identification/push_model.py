"""The horizontal motion that a tilt makes, integrated over stretches of a recording."""

import math
from dataclasses import dataclass

import numpy as np

from companion.control.thrust import GRAVITY_M_S2
from companion.identification.estimates import Estimate, FittedCurve
from companion.identification.intervals import half_width
from companion.identification.parts import Rows
from companion.identification.recording import Array, Recording
from companion.identification.scatter import FittedScatter, Residual, factor, whitened
from companion.identification.signals import since_begin_s, up_vectors

_USUAL_K2_1_M, _USUAL_K2_SPREAD_1_M = 0.02, 0.04
"""What k2 of a multirotor is before anything is measured.  Within a box of a few metres the speeds
differ too little to part k1 v from k2 v² under a wandering estimate; with motion capture the
measurement outweighs this by far."""
_AXES = ("x", "y")


@dataclass(frozen=True, slots=True)
class PushSolution:
    """What the model is made with, and how well that is known."""

    values: Array
    """(4,) G cos ψ, G sin ψ, k1, k2."""
    covariance: Array
    sizes: Array
    """(2, stretches, 3) of what each axis begins with, m/s, its push without a tilt, m/s², and the
    growth of that, m/s³."""
    speeds_m_s: tuple[Array, ...]
    """(rows,) of the model, of each stretch."""


class PushModel:
    """The stretches, and the model integrated over them."""

    def __init__(self, recording: Recording, runs: list[Rows], kept: list[Rows]) -> None:
        self._recording = recording
        self._runs, self._kept = runs, kept
        self._places = [np.searchsorted(run, few) for run, few in zip(runs, kept, strict=True)]
        self._times_s = since_begin_s(recording)
        up = up_vectors(recording)
        self._tangent = up[:, :2] / up[:, 2:]

    def begin(self) -> PushSolution:
        """A guess: gravity, little drag, the reported speeds."""
        velocity = self._recording.velocity_enu_m_s
        sizes = np.zeros((2, len(self._runs), 3))
        for k, run in enumerate(self._runs):
            sizes[:, k, 0] = velocity[run[0], :2]
        return PushSolution(
            np.array([1.0, 0.0, 0.2, _USUAL_K2_1_M]),
            np.zeros((4, 4)),
            sizes,
            tuple(np.hypot(*velocity[run, :2].T) for run in self._runs),
        )

    def solve(
        self, about: PushSolution, scatters: tuple[FittedScatter, FittedScatter]
    ) -> PushSolution:
        """One step of Gauss and Newton, of both axes together."""
        normal, right = np.zeros((4, 4)), np.zeros(4)
        normal[3, 3] = 1.0 / _USUAL_K2_SPREAD_1_M**2
        right[3] = (_USUAL_K2_1_M - about.values[3]) / _USUAL_K2_SPREAD_1_M**2
        slopes = {}
        for axis in range(2):
            for k, few in enumerate(self._kept):
                columns, shapes = self._slopes(about, k, axis)
                lower = factor(scatters[axis].scatter, self._times_s[few], shapes)
                slopes[axis, k] = columns, shapes, self._left(about, k, axis)
                white = whitened(lower, columns)
                normal += white.T @ white
                right += white.T @ whitened(lower, slopes[axis, k][2])
        covariance: Array = np.asarray(np.linalg.pinv(normal), dtype=float)
        change = covariance @ right
        sizes = about.sizes.copy()
        nothing = [np.zeros((len(few), 1)) for few in self._kept]
        for (axis, k), (columns, shapes, left) in slopes.items():
            lower = factor(scatters[axis].scatter, self._times_s[self._kept[k]], nothing[k])
            more, *_ = np.linalg.lstsq(
                whitened(lower, shapes), whitened(lower, left - columns @ change), rcond=None
            )
            sizes[axis, k] += more
        stepped = PushSolution(about.values + change, covariance, sizes, about.speeds_m_s)
        speeds = tuple(
            np.hypot(self._modelled(stepped, k, 0), self._modelled(stepped, k, 1))
            for k in range(len(self._runs))
        )
        return PushSolution(stepped.values, covariance, sizes, speeds)

    def residuals(self, solved: PushSolution, axis: int) -> list[Residual]:
        """What the model leaves of an axis."""
        return [
            Residual(
                self._times_s[few],
                self._left(solved, k, axis),
                np.concatenate(self._slopes(solved, k, axis), axis=1),
            )
            for k, few in enumerate(self._kept)
        ]

    def trims_rad(self, solved: PushSolution) -> tuple[Estimate, Estimate]:
        """Roll and pitch at which nothing pushes: of the stretches' constants, their mean."""
        lengths = np.array([self._times_s[run[-1]] - self._times_s[run[0]] for run in self._runs])
        middles = solved.sizes[:, :, 1] + 0.5 * solved.sizes[:, :, 2] * lengths
        yaw = float(np.mean(self._recording.yaw_rad))
        ahead = math.cos(yaw) * middles[0] + math.sin(yaw) * middles[1]
        left = -math.sin(yaw) * middles[0] + math.cos(yaw) * middles[1]
        weights = lengths / lengths.sum()
        trims = []
        for push, sign in ((left, 1.0), (ahead, -1.0)):
            mean = float(weights @ push)
            variance = float(weights @ (push - mean) ** 2) / max(1, len(lengths) - 1)
            trims.append(
                Estimate(
                    math.atan(sign * mean / GRAVITY_M_S2),
                    half_width(variance) / GRAVITY_M_S2,
                    "rad",
                )
            )
        return trims[0], trims[1]

    def curves(self, solved: PushSolution) -> tuple[FittedCurve, ...]:
        """Of the swing, for a person."""
        made = []
        for k, run in enumerate(self._runs):
            if self._recording.segment[run[0]] != "swing":
                continue
            for axis, name in enumerate(_AXES):
                made.append(
                    FittedCurve(
                        name,
                        f"velocity along {name} (m/s)",
                        self._recording.time_s[run],
                        self._recording.velocity_enu_m_s[run, axis],
                        self._modelled(solved, k, axis),
                        np.full(len(run), np.nan),
                    )
                )
        return tuple(made)

    def _pushes(self, k: int, axis: int) -> Array:
        """(rows, 2) what G cos ψ and G sin ψ multiply, m/s²."""
        run = self._runs[k]
        other = self._tangent[run, 1 - axis]
        turned = -other if axis == 0 else other
        return GRAVITY_M_S2 * np.stack([self._tangent[run, axis], turned], axis=1)

    def _modelled(self, solved: PushSolution, k: int, axis: int) -> Array:
        """(rows,) velocity of the model."""
        run = self._runs[k]
        since_s = self._times_s[run] - self._times_s[run[0]]
        first, push, growth = solved.sizes[axis, k].tolist()
        rate = self._pushes(k, axis) @ solved.values[:2] + push + growth * since_s
        decay = solved.values[2] + solved.values[3] * solved.speeds_m_s[k]
        fading = _fading(since_s, decay)
        modelled: Array = first * fading + _integrated(since_s, rate[:, None], fading)[:, 0]
        return modelled

    def _slopes(self, solved: PushSolution, k: int, axis: int) -> tuple[Array, Array]:
        """Derivatives of the model's velocity at the kept rows.

        Returns:
            (kept, 4) by the values, and (kept, 3) by the stretch's own sizes.
        """
        run = self._runs[k]
        since_s = self._times_s[run] - self._times_s[run[0]]
        speed = solved.speeds_m_s[k]
        velocity = self._modelled(solved, k, axis)
        # The drag k2 |v| v grows by twice k2 |v| along the way, by once across it: between them.
        fading = _fading(since_s, solved.values[2] + 1.5 * solved.values[3] * speed)
        rates = np.concatenate(
            [
                self._pushes(k, axis),
                np.stack([-velocity, -speed * velocity, np.ones(len(run)), since_s], axis=1),
            ],
            axis=1,
        )
        integrals = _integrated(since_s, rates, fading)[self._places[k]]
        shapes = np.concatenate([fading[self._places[k], None], integrals[:, 4:]], axis=1)
        return integrals[:, :4], shapes

    def _left(self, solved: PushSolution, k: int, axis: int) -> Array:
        """(kept,) what the model leaves."""
        few = self._kept[k]
        modelled = self._modelled(solved, k, axis)[self._places[k]]
        left: Array = self._recording.velocity_enu_m_s[few, axis] - modelled
        return left


def _fading(since_s: Array, decay_1_s: Array) -> Array:
    """(n,) what is left of an initial velocity under a decay that changes."""
    steps = np.diff(since_s)
    total = np.concatenate([[0.0], np.cumsum(0.5 * steps * (decay_1_s[1:] + decay_1_s[:-1]))])
    fading: Array = np.exp(-total)
    return fading


def _integrated(since_s: Array, rates: Array, fading: Array) -> Array:
    """(n, k) solutions of ``v' = rate - decay v`` from 0, by variation of constants."""
    ahead = rates / fading[:, None]
    steps = np.diff(since_s)[:, None]
    summed = np.cumsum(0.5 * steps * (ahead[1:] + ahead[:-1]), axis=0)
    whole: Array = fading[:, None] * np.concatenate([np.zeros((1, rates.shape[1])), summed])
    return whole
