"""The response of the climb rate to its command.

Where the thrust field is a climb rate, the loop is the autopilot's, and the response is fitted as
it is seen: like that of a tilt.  Where the field is thrust, the loop is the companion's own
thrust law over a lift that is known much better than its noisy closed loop could be: the response
follows from the identified lift, by simulation, and its intervals from the lift's covariance.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.config.models import ThrustConfig
from companion.identification.estimates import Estimate, FittedCurve, Response, UnidentifiedError
from companion.identification.intervals import half_width
from companion.identification.least_squares import Parameters, sandwich, solve
from companion.identification.lift_fit import LiftFit
from companion.identification.lift_model import FAST_POLE_RAD_S
from companion.identification.parts import require, stretches, thinned
from companion.identification.recording import Array, Recording
from companion.identification.scatter import LoopScatter, Residual, likeliest
from companion.identification.signals import (
    GRID_S,
    delayed,
    held,
    sampled,
    second_order,
    since_begin_s,
)

_COUNTED_S = 0.8
"""What the integral of the thrust law makes good later is not of the loop's speed."""
_SAMPLE_S = 0.01
_LEAST_MOTION_M_S = 0.1
_LARGEST_MISFIT = 0.8
_QUIET = ("hover", "hold", "roll", "pitch")
_THINNED = 400
_PARAMETERS = Parameters(
    start=np.array([4.0, 0.8, 0.08, 1.0, 0.0]),
    steps=np.array([0.05, 0.01, 0.002, 0.01, 0.005]),
    low=np.array([0.5, 0.2, 0.0, 0.4, -0.5]),
    high=np.array([40.0, 4.0, 0.5, 1.6, 0.5]),
)
"""ωn, ζ, dead time, gain, offset."""
_USUAL = np.array([3.5, 0.6, 0.08, 1.0, 0.0])
_USUAL_SPREAD = np.array([1.2, 0.25, 0.03, 0.05, 1.0])
"""The same of an autopilot's climb-rate loop before anything is measured: its gain is 1, since it
integrates, and its defaults are much the same on all vehicles (ArduCopter's own simulation: 3.75
rad/s, 0.605, 75 ms).  Steps of 0.5 m/s hardly rise above an estimate that wanders by 0.3 m/s in a
second; with motion capture the measurement outweighs this by far."""
_LIFT_STEPS = (0.0005, 0.001, 0.001, 0.005, 0.02)
"""Of τ, T, h, γ and k, for the derivatives."""


@dataclass(frozen=True, slots=True)
class ClimbFit:
    """A fitted climb rate."""

    response: Response
    curve: FittedCurve


def fit_climb(recording: Recording) -> ClimbFit:
    """Fit the climb rate as it is seen.

    Args:
        recording: with the parts climb and hover.

    Raises:
        UnidentifiedError: the part is missing or too weak, or the vehicle does not follow.
    """
    part = require(recording, "climb")
    require(recording, "hover")
    quiet = [run for name in _QUIET for run in stretches(recording, name)]
    times = since_begin_s(recording)
    answered = recording.velocity_enu_m_s[:, 2]
    commanded = recording.climb_rate_m_s
    moved = float(np.std(commanded[part]))
    if moved < _LEAST_MOTION_M_S:
        raise UnidentifiedError(
            f"the climb-rate command moves by {moved:.2f} m/s (rms) only, and at least "
            f"{_LEAST_MOTION_M_S:g} are needed. Fly larger steps"
        )
    on_grid = held(times, commanded, float(times[-1]))

    def model(values: Array) -> Array:
        omega, zeta, dead_s, gain, offset = values.tolist()
        lagged = delayed(second_order(on_grid, omega, zeta), dead_s)
        answer: Array = gain * sampled(lagged, times) + offset
        return answer

    scatter = likeliest(
        LoopScatter,
        [
            Residual(times[rows], answered[rows], np.ones((len(rows), 1)))
            for rows in thinned(quiet, _THINNED)
        ],
    ).scatter
    assert isinstance(scatter, LoopScatter)
    period_s = float(np.median(np.diff(times[part])))
    # Of so many correlated samples one counts as if it scattered independently by this much.
    counted = math.sqrt(
        scatter.white**2 + scatter.wander**2 * 2.0 * scatter.correlation_s / period_s
    )

    def misfit(values: Array) -> Array:
        rest = (model(values) - answered)[part]
        return np.concatenate([rest / counted, (values - _USUAL) / _USUAL_SPREAD])

    solution = solve(misfit, _PARAMETERS)
    fitted = model(solution.values)
    rest = answered - fitted
    share = float(np.std(rest[part]) / max(float(np.std(answered[part])), 1e-9))
    if share > _LARGEST_MISFIT:
        raise UnidentifiedError(
            f"the climb rate does not follow its command as a second order ({share:.0%} of its "
            "motion is left over). Fly in calmer air, higher above ground"
        )
    of_all = np.eye(len(part) + len(_USUAL))
    of_all[: len(part), : len(part)] = scatter.covariance(times[part]) / counted**2
    covariance = sandwich(solution.jacobian, of_all)
    curve = FittedCurve(
        "climb",
        "climb rate (m/s)",
        recording.time_s[part],
        answered[part],
        fitted[part],
        commanded[part],
    )
    return ClimbFit(_response(solution.values, covariance), curve)


def climb_by_lift(lift: LiftFit) -> Response:
    """The climb rate under the companion's thrust law of default gains, over an identified lift.

    Args:
        lift: as identified.
    """
    best = _second_order_of(lift.values)
    columns = []
    for index, step in enumerate(_LIFT_STEPS):
        shift = np.zeros(len(_LIFT_STEPS))
        shift[index] = step
        up, down = _second_order_of(lift.values + shift), _second_order_of(lift.values - shift)
        columns.append((up - down) / (2.0 * step))
    slopes = np.stack(columns, axis=1)
    return _response(best, slopes @ lift.covariance @ slopes.T)


def _second_order_of(lift: Array) -> Array:
    """ωn, ζ, dead time and gain of the second order next to the loop's step response."""
    answer = _loop_step(lift)
    times: Array = np.asarray(np.arange(len(answer)) * GRID_S, dtype=float)
    unit = np.ones(len(answer) + 1)
    unit[0] = 0.0

    def misfit(values: Array) -> Array:
        omega, zeta, dead_s, gain = values.tolist()
        lagged = delayed(second_order(unit, omega, zeta), dead_s)
        rest: Array = (gain * sampled(lagged, times + GRID_S) - answer)[::5]
        return rest

    parameters = Parameters(
        np.array([10.0, 1.2, 0.03, 1.0]),
        np.array([0.05, 0.005, 0.001, 0.005]),
        np.array([0.5, 0.2, -0.05, 0.3]),
        np.array([80.0, 6.0, 0.5, 2.0]),
    )
    values: Array = solve(misfit, parameters).values
    return values


def _loop_step(lift: Array) -> Array:
    """(n,) climb rate on the grid after a unit step of its command at time 0, from rest."""
    lag_s, dead_s, _, straight, drag = lift.tolist()
    law = ThrustConfig()
    every = round(_SAMPLE_S / GRID_S)
    steps = round(_COUNTED_S / GRID_S) + 1
    late = max(0.0, dead_s / GRID_S)
    whole, part = int(late), late - int(late)
    slow_keep = float(np.exp(-GRID_S / max(lag_s, 1e-4)))
    fast_keep = float(np.exp(-GRID_S * FAST_POLE_RAD_S))
    asked = [0.0] * (whole + 2)
    slow = fast = climb = integral = command = 0.0
    answer = np.zeros(steps)
    for k in range(steps):
        answer[k] = climb
        if k % every == 0:
            error = 1.0 - climb
            command = law.proportional * error + integral
            integral += law.integral * error * _SAMPLE_S
        asked.append(command)
        arrived = (1.0 - part) * asked[-1 - whole] + part * asked[-2 - whole]
        slow += (1.0 - slow_keep) * (arrived - slow)
        fast += (1.0 - fast_keep) * (slow - fast)
        climb += GRID_S * (straight * fast - drag * climb)
    return answer


def _response(values: Array, covariance: Array) -> Response:
    units = ("rad/s", "", "s", "")
    omega, zeta, dead, gain = (
        Estimate(float(values[k]), half_width(covariance[k, k]), unit)
        for k, unit in enumerate(units)
    )
    return Response(omega, zeta, Estimate(max(0.0, dead.value), dead.half_width_95, "s"), gain)
