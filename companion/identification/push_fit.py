"""Horizontally: what a tilt pushes, what the air brakes, and at which tilt nothing pushes.

``v' = G g R(ψ) t - k1 v - k2 |v| v + c`` with t the tangent of the reported tilt as a vector (up's
horizontal part over its vertical one), ψ what the reported heading is off, and c the push that is
there without a tilt.  The model is integrated over each stretch of the flight from a free beginning
and with a free c, constant and growing, which takes up what changes slowly (a wandering level, a
breeze).  Weighted Gauss-Newton on G cos ψ, G sin ψ, k1 and k2, with the scatter of the velocity
estimated from the fit's own residuals.  A reported speed is nowhere a regressor: its scatter would
bias the drag.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.identification.estimates import Estimate, FittedCurve, UnidentifiedError
from companion.identification.intervals import half_width
from companion.identification.parts import require, stretches, thinned
from companion.identification.push_model import PushModel
from companion.identification.recording import Recording
from companion.identification.scatter import (
    FittedScatter,
    Scatter,
    VelocityScatter,
    likeliest,
)

_PARTS = ("hover", "roll", "pitch", "swing")
_ROUNDS = 2
_STEPS = 3
_THINNED = 360
_LEAST_SPEED_M_S = 0.5


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
    data = PushModel(recording, runs, kept)
    scatters = weighting or (
        FittedScatter(VelocityScatter(0.02, 0.1, 1.0), (0.0, 0.0, 0.0)),
        FittedScatter(VelocityScatter(0.02, 0.1, 1.0), (0.0, 0.0, 0.0)),
    )
    solved = data.solve(data.begin(), scatters)
    begins: tuple[Scatter | None, Scatter | None] = (None, None)
    for _ in range(_ROUNDS):
        for _ in range(_STEPS):
            solved = data.solve(solved, scatters)
        if weighting is None:
            scatters = (
                likeliest(VelocityScatter, data.residuals(solved, 0), begins[0]),
                likeliest(VelocityScatter, data.residuals(solved, 1), begins[1]),
            )
            begins = (scatters[0].scatter, scatters[1].scatter)
    for _ in range(_STEPS):
        solved = data.solve(solved, scatters)
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
