"""Horizontally: what a tilt pushes, what the air brakes, and at which tilt nothing pushes.

``v' = G g R(ψ) t - k1 v - k2 |v| v + c`` with t the tangent of the reported tilt as a vector (up's
horizontal part over its vertical one), ψ what the reported heading is off, and c the push that is
there without a tilt.  Its integral is linear in G cos ψ, G sin ψ, k1, k2 and what each stretch
begins with, but for the speed in the drag, which is the model's own and found by iteration (a
reported one would bring its scatter into the regressors).  Weighted least squares, with the
scatter of the velocity estimated from the fit's own residuals; what changes slowly (a wandering
level, a breeze) is left to a polynomial of each stretch.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.control.thrust import GRAVITY_M_S2
from companion.identification.estimates import Estimate, FittedCurve, UnidentifiedError
from companion.identification.intervals import half_width
from companion.identification.parts import Rows, require, stretches, thinned
from companion.identification.recording import Array, Recording
from companion.identification.scatter import (
    FittedScatter,
    Residual,
    Scatter,
    VelocityScatter,
    factor,
    likeliest,
    whitened,
)
from companion.identification.signals import since_begin_s, up_vectors

_PARTS = ("hover", "roll", "pitch", "swing")
_ROUNDS = 3
_THINNED = 360
_LEAST_SPEED_M_S = 0.5
_AXES = ("x", "y")


@dataclass(frozen=True, slots=True)
class PushFit:
    """The horizontal axes."""

    tilt_gain: Estimate
    linear_drag_1_s: Estimate
    quadratic_drag_1_m: Estimate
    trim_roll_rad: Estimate
    trim_pitch_rad: Estimate
    scatters: tuple[FittedScatter, FittedScatter]
    """Of the velocity along x and y."""
    curves: tuple[FittedCurve, ...]


def fit_push(
    recording: Recording, weighting: tuple[FittedScatter, FittedScatter] | None = None
) -> PushFit:
    """Fit the horizontal axes.

    Args:
        recording: with the parts hover, roll, pitch and swing.
        weighting: the scatters along x and y to weight with; None: they are estimated from the
            residuals.

    Raises:
        UnidentifiedError: a part is missing, or the vehicle was not moved enough.
    """
    swing = require(recording, "swing")
    speed = float(np.sqrt(np.mean(recording.velocity_enu_m_s[swing, :2] ** 2)))
    if speed < _LEAST_SPEED_M_S:
        raise UnidentifiedError(
            f"the vehicle moved at {speed:.2f} m/s (rms) only in the part 'swing', and at least "
            f"{_LEAST_SPEED_M_S:g} are needed to see its drag. Give the flight a larger box"
        )
    runs = [run for name in _PARTS for run in stretches(recording, name)]
    kept = thinned(runs, _THINNED)
    data = _Data(recording, runs, kept)
    scatters = weighting or (
        FittedScatter(VelocityScatter(0.02, 0.1, 1.0), (0.0, 0.0, 0.0)),
        FittedScatter(VelocityScatter(0.02, 0.1, 1.0), (0.0, 0.0, 0.0)),
    )
    solved = data.solve(scatters)
    begins: tuple[Scatter | None, Scatter | None] = (None, None)
    for _ in range(_ROUNDS):
        data.take_speed_of(solved)
        if weighting is None:
            scatters = (
                likeliest(VelocityScatter, data.residuals(solved, 0), begins[0]),
                likeliest(VelocityScatter, data.residuals(solved, 1), begins[1]),
            )
            begins = (scatters[0].scatter, scatters[1].scatter)
        solved = data.solve(scatters)
    along, across, linear, quadratic = solved.values.tolist()
    gain = math.hypot(along, across)
    slope = np.array([along, across]) / gain
    if not 0.3 < gain < 2.0:
        raise UnidentifiedError(
            f"a tilt seems to push {gain:.2f} times what gravity makes of it: the reported "
            "velocity does not belong to the reported tilt. Check the estimator"
        )
    covariance = solved.covariance
    trims = data.trims_rad(solved)
    return PushFit(
        Estimate(gain, half_width(float(slope @ covariance[:2, :2] @ slope)), ""),
        Estimate(linear, half_width(covariance[2, 2]), "1/s"),
        Estimate(quadratic, half_width(covariance[3, 3]), "1/m"),
        trims[0],
        trims[1],
        scatters,
        data.curves(solved),
    )


@dataclass(frozen=True, slots=True)
class _Solved:
    values: Array
    """(4,) G cos ψ, G sin ψ, k1, k2."""
    covariance: Array
    sizes: Array
    """(2, stretches, 3) of the nuisances."""


class _Data:
    """The stretches, thinned out, with the integrals that the model is made of."""

    def __init__(self, recording: Recording, runs: list[Rows], kept: list[Rows]) -> None:
        self._recording = recording
        self._runs, self._kept = runs, kept
        self._places = [np.searchsorted(run, few) for run, few in zip(runs, kept, strict=True)]
        self._times_s = since_begin_s(recording)
        up = up_vectors(recording)
        self._tangent = up[:, :2] / up[:, 2:]
        self._velocity = recording.velocity_enu_m_s[:, :2].copy()
        """What the drag is reckoned from: reported at first, then the model's."""

    def solve(self, scatters: tuple[FittedScatter, FittedScatter]) -> _Solved:
        """Generalised least squares of both axes together."""
        normal, right = np.zeros((4, 4)), np.zeros(4)
        for axis in range(2):
            for k, few in enumerate(self._kept):
                shapes = self._nuisances(k)
                lower = factor(scatters[axis].scatter, self._times_s[few], shapes)
                columns = whitened(lower, self._columns(k, axis))
                normal += columns.T @ columns
                right += columns.T @ whitened(lower, self._measured(k, axis))
        covariance: Array = np.asarray(np.linalg.pinv(normal), dtype=float)
        values = covariance @ right
        return _Solved(values, covariance, self._sizes(values, scatters))

    def residuals(self, solved: _Solved, axis: int) -> list[Residual]:
        """What the model leaves of an axis."""
        return [
            Residual(
                self._times_s[few],
                self._measured(k, axis) - self._columns(k, axis) @ solved.values,
                self._nuisances(k),
            )
            for k, few in enumerate(self._kept)
        ]

    def take_speed_of(self, solved: _Solved) -> None:
        """Let the drag be reckoned from the model's speed from now on."""
        fresh = self._velocity.copy()
        for k, run in enumerate(self._runs):
            for axis in range(2):
                fresh[run, axis] = self._modelled(solved, k, axis)
        self._velocity = fresh

    def trims_rad(self, solved: _Solved) -> tuple[Estimate, Estimate]:
        """Roll and pitch at which nothing pushes: of the stretches' constants, their mean."""
        lengths = np.array([self._times_s[run[-1]] - self._times_s[run[0]] for run in self._runs])
        slopes = solved.sizes[:, :, 1]
        middles = slopes + solved.sizes[:, :, 2] * lengths
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

    def curves(self, solved: _Solved) -> tuple[FittedCurve, ...]:
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

    def _columns(self, k: int, axis: int, *, whole: bool = False) -> Array:
        """Integrals over a stretch of what G cos ψ, G sin ψ, k1 and k2 multiply."""
        run = self._runs[k]
        own, other = self._tangent[run, axis], self._tangent[run, 1 - axis]
        turned = -other if axis == 0 else other
        velocity = self._velocity[run]
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        rates = np.stack(
            [
                GRAVITY_M_S2 * own,
                GRAVITY_M_S2 * turned,
                -velocity[:, axis],
                -speed * velocity[:, axis],
            ],
            axis=1,
        )
        steps = np.diff(self._times_s[run])[:, None]
        summed = np.cumsum(0.5 * steps * (rates[1:] + rates[:-1]), axis=0)
        integrals = np.concatenate([np.zeros((1, 4)), summed])
        taken: Array = integrals if whole else integrals[self._places[k]]
        return taken

    def _nuisances(self, k: int, *, whole: bool = False) -> Array:
        """What a stretch begins with, a constant push, and one that grows."""
        run = self._runs[k]
        rows = run if whole else self._kept[k]
        since_s = self._times_s[rows] - self._times_s[run[0]]
        return np.stack([np.ones(len(rows)), since_s, since_s**2], axis=1)

    def _measured(self, k: int, axis: int) -> Array:
        measured: Array = self._recording.velocity_enu_m_s[self._kept[k], axis]
        return measured

    def _modelled(self, solved: _Solved, k: int, axis: int) -> Array:
        columns = self._columns(k, axis, whole=True)
        shapes = self._nuisances(k, whole=True)
        modelled: Array = columns @ solved.values + shapes @ solved.sizes[axis, k]
        return modelled

    def _sizes(self, values: Array, scatters: tuple[FittedScatter, FittedScatter]) -> Array:
        sizes = np.zeros((2, len(self._runs), 3))
        for axis in range(2):
            for k, few in enumerate(self._kept):
                shapes = self._nuisances(k)
                lower = factor(scatters[axis].scatter, self._times_s[few], np.zeros((len(few), 1)))
                rest = self._measured(k, axis) - self._columns(k, axis) @ values
                sizes[axis, k], *_ = np.linalg.lstsq(
                    whitened(lower, shapes), whitened(lower, rest), rcond=None
                )
        return sizes
