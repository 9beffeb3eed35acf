"""The response of roll and pitch to their commands, against the reported attitude.

Plain least squares over the axis's own part of the flight; its scatter is taken from parts in which
nothing much is commanded, so that what a second order cannot follow in the steps (ArduPilot shapes
its targets) does not pass for noise, nor noise for it.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.identification.estimates import Estimate, FittedCurve, Response, UnidentifiedError
from companion.identification.intervals import half_width
from companion.identification.least_squares import Parameters, Solution, sandwich, solve
from companion.identification.parts import require, stretches, thinned
from companion.identification.recording import Array, Recording
from companion.identification.scatter import FittedScatter, LoopScatter, Residual, likeliest
from companion.identification.signals import (
    delayed,
    held,
    roll_pitch_rad,
    sampled,
    second_order,
    since_begin_s,
)

_LEAST_SWING_RAD = math.radians(3.0)
_LARGEST_MISFIT = 0.35
"""Root mean square of what is left over that of the response."""
_QUIET = ("hover", "thrust", "climb")
"""Parts in which roll and pitch are commanded little, and in which they have come to rest: the
pauses after the steps still have what a second order leaves of them."""
_THINNED = 600
"""Samples of quiet flight, at most, from which the scatter is taken."""
_PARAMETERS = Parameters(
    start=np.array([9.0, 0.9, 0.05, 1.0, 0.0]),
    steps=np.array([0.05, 0.005, 0.002, 0.005, 0.001]),
    low=np.array([1.0, 0.2, 0.0, 0.4, -0.3]),
    high=np.array([60.0, 3.0, 0.4, 1.6, 0.3]),
)
"""ωn, ζ, dead time, gain, offset."""


@dataclass(frozen=True, slots=True)
class TiltFit:
    """A fitted axis."""

    response: Response
    scatter: FittedScatter
    curve: FittedCurve


def fit_tilt(recording: Recording, axis: str) -> TiltFit:
    """Fit roll or pitch.

    Args:
        recording: with the parts `roll`, `pitch`, and hover.
        axis: roll or pitch.

    Raises:
        UnidentifiedError: the part is missing or too weak, or the vehicle does not follow.
    """
    part = require(recording, axis)
    roll, pitch = roll_pitch_rad(recording)
    answered = roll if axis == "roll" else pitch
    commanded = recording.roll_rad if axis == "roll" else recording.pitch_rad
    times = since_begin_s(recording)
    on_grid = held(times, commanded, float(times[-1]))
    swing = float(np.std(commanded[part]))
    if swing < _LEAST_SWING_RAD:
        raise UnidentifiedError(
            f"the commands of {axis} move by {math.degrees(swing):.1f}° (rms) only, and at least "
            f"{math.degrees(_LEAST_SWING_RAD):.0f}° are needed to see an answer. Fly larger steps"
        )

    def model(values: Array) -> Array:
        omega, zeta, dead_s, gain, offset = values.tolist()
        lagged = delayed(second_order(on_grid, omega, zeta), dead_s)
        answer: Array = gain * sampled(lagged, times) + offset
        return answer

    def misfit(values: Array) -> Array:
        rest: Array = (model(values) - answered)[part]
        return rest

    solution = solve(misfit, _PARAMETERS)
    fitted = model(solution.values)
    _refuse_no_answer(axis, answered[part], solution)
    scatter = _scatter(recording, times, answered - fitted)
    covariance = sandwich(solution.jacobian, scatter.scatter.covariance(times[part]))
    return TiltFit(
        _response(solution.values, covariance),
        scatter,
        FittedCurve(
            axis,
            f"{axis} (rad)",
            recording.time_s[part],
            answered[part],
            fitted[part],
            commanded[part],
        ),
    )


def _scatter(recording: Recording, times_s: Array, rest: Array) -> FittedScatter:
    require(recording, "hover")
    quiet = [run for name in _QUIET for run in stretches(recording, name)]
    return likeliest(
        LoopScatter,
        [
            Residual(times_s[rows], rest[rows], np.ones((len(rows), 1)))
            for rows in thinned(quiet, _THINNED)
        ],
    )


def _refuse_no_answer(axis: str, answered: Array, solution: Solution) -> None:
    share = float(np.std(solution.misfit) / max(float(np.std(answered)), 1e-9))
    if share > _LARGEST_MISFIT:
        raise UnidentifiedError(
            f"no second-order response fits {axis}: {share:.0%} of its motion is left over. Fly "
            "in calmer air, see that nothing else steers the vehicle, and that its attitude "
            "control is tuned"
        )
    for index, name in enumerate(("natural frequency", "damping", "dead time", "gain")):
        value, low, high = (
            solution.values[index],
            _PARAMETERS.low[index],
            _PARAMETERS.high[index],
        )
        if value >= high or (value <= low and name != "dead time"):
            raise UnidentifiedError(
                f"the {name} of {axis} comes out at {value:g}, the end of what is looked for: the "
                "vehicle does not answer as a second order. Look at identify.png"
            )


def _response(values: Array, covariance: Array) -> Response:
    units = ("rad/s", "", "s", "")
    omega, zeta, dead, gain = (
        Estimate(float(values[k]), half_width(covariance[k, k]), unit)
        for k, unit in enumerate(units)
    )
    return Response(omega, zeta, dead, gain)
