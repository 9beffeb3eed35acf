"""The climb rate that a thrust makes, integrated over stretches of a recording."""

import math

import numpy as np

from companion.control.thrust import GRAVITY_M_S2
from companion.identification.estimates import FittedCurve
from companion.identification.parts import Rows, stretches, thinned
from companion.identification.recording import Array, Recording
from companion.identification.scatter import Residual, Scatter, factor, whitened
from companion.identification.signals import (
    GRID_S,
    accumulated,
    delayed,
    held,
    sampled,
    second_order,
    since_begin_s,
    up_vectors,
)

FAST_POLE_RAD_S = 250.0
"""One step of an autopilot's loop: no velocity can tell it from none."""
_THINNED = 360
_LONGEST_S = 15.0
"""A longer stretch is cut: the effort grows with the cube of its samples."""
_BEFORE_S = 1.5
"""Of commands that the lag is started with, before a stretch."""


def lag_as_second_order(lag_s: float) -> tuple[float, float]:
    """ωn and ζ of a first-order lag in front of the fast pole."""
    fast_s = 1.0 / FAST_POLE_RAD_S
    omega = 1.0 / math.sqrt(lag_s * fast_s)
    return omega, 0.5 * (lag_s + fast_s) * omega


class LiftModel:
    """What the thrust makes of the climb rate, stretch by stretch."""

    def __init__(self, recording: Recording, force: Array) -> None:
        self._times_s = since_begin_s(recording)
        self._recording = recording
        end_s = float(self._times_s[-1])
        self._force = held(self._times_s, force, end_s)
        grid_s = np.arange(len(self._force)) * GRID_S
        vertical = recording.thrust_meaning.kind == "vertical"
        cosine = np.ones(len(recording)) if vertical else up_vectors(recording)[:, 2]
        self._cosine = np.interp(grid_s, self._times_s, cosine)
        self._climb_m_s = recording.velocity_enu_m_s[:, 2]

    def runs(self, names: tuple[str, ...]) -> list[Rows]:
        """The stretches of some parts, in pieces that are not too long."""
        found = [run for name in names for run in stretches(self._recording, name)]
        return [piece for run in found for piece in self._cut(run)]

    def _cut(self, run: Rows) -> list[Rows]:
        span_s = float(self._times_s[run[-1]] - self._times_s[run[0]])
        return list(np.array_split(run, max(1, math.ceil(span_s / _LONGEST_S))))

    def climb_m_s(self, values: Array, run: Rows) -> Array:
        """(len(run),) from 0 at the stretch's first sample."""
        lag_s, dead_s, hover, straight, drag = values.tolist()
        begin_s, end_s = float(self._times_s[run[0]]), float(self._times_s[run[-1]])
        first = max(0, round((begin_s - _BEFORE_S) / GRID_S))
        start, stop = round(begin_s / GRID_S), round(end_s / GRID_S)
        omega, zeta = lag_as_second_order(lag_s)
        force = delayed(second_order(self._force[first : stop + 1], omega, zeta), dead_s)
        share = (force * self._cosine[first : stop + 1])[start - first :] / hover
        climb = accumulated(GRAVITY_M_S2 * straight * (share - 1.0), drag)
        return sampled(climb, self._times_s[run] - start * GRID_S)

    def nuisances(self, values: Array, run: Rows) -> Array:
        """(len(run), 1): the unknown climb rate at the beginning dies out with the drag."""
        since_s = self._times_s[run] - self._times_s[run[0]]
        fading: Array = np.exp(-values[4] * since_s)[:, None]
        return fading

    def residuals(self, values: Array, runs: list[Rows]) -> list[Residual]:
        """What the model leaves, thinned out."""
        parts = []
        for run, few in zip(runs, thinned(runs, _THINNED), strict=True):
            rest = self._climb_m_s[run] - self.climb_m_s(values, run)
            kept = np.searchsorted(run, few)
            nuisances = self.nuisances(values, run)
            parts.append(Residual(self._times_s[few], rest[kept], nuisances[kept]))
        return parts

    def whitened_misfit(self, about: Array, runs: list[Rows], scatter: Scatter) -> "_Whitened":
        """The misfit in units of the scatter, the unknown beginnings left out."""
        return _Whitened(self, about, runs, scatter)

    def curve(self, values: Array, run: Rows) -> FittedCurve:
        """Of a part, for a person: the part's unknown beginning is the best one for all of it."""
        modelled = self.climb_m_s(values, run)
        shapes = np.stack([np.ones(len(run)), self._times_s[run] - self._times_s[run[0]]], axis=1)
        rest = self._climb_m_s[run] - modelled
        size, *_ = np.linalg.lstsq(shapes, rest, rcond=None)
        return FittedCurve(
            "lift",
            "climb rate under the thrust wave (m/s)",
            self._recording.time_s[run],
            self._climb_m_s[run],
            modelled + shapes @ size,
            np.full(len(run), np.nan),
        )

    def measured_m_s(self, run: Rows) -> Array:
        """(len(run),) reported climb rate."""
        climb: Array = self._climb_m_s[run]
        return climb

    def times_s(self, run: Rows) -> Array:
        """(len(run),) since the recording's beginning."""
        times: Array = self._times_s[run]
        return times


class _Whitened:
    """The misfit of all stretches in units of the scatter, the unknown beginnings left out."""

    def __init__(self, model: LiftModel, about: Array, runs: list[Rows], scatter: Scatter) -> None:
        self._model, self._runs = model, runs
        self._factors = [
            factor(scatter, model.times_s(run), model.nuisances(about, run)) for run in runs
        ]

    def __call__(self, values: Array) -> Array:
        """(samples,) for the parameters' values."""
        return np.concatenate(
            [
                whitened(lower, self._model.climb_m_s(values, run) - self._model.measured_m_s(run))
                for run, lower in zip(self._runs, self._factors, strict=True)
            ]
        )
