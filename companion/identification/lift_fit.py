"""From the thrust field to the vertical acceleration: the motors' lag, the dead time, hover thrust.

The model is ``v' = g (1 + γ (f cos(tilt) / h - 1)) - g - k v`` with the force share f behind a
first-order lag τ (a motor with its propeller) and a dead time T; h is the hover thrust, and γ, near
1, says how straight the thrust is about it.  As a second-order response the lag has a second pole
at 250 rad/s, one step of an autopilot's loop, which no velocity can tell from none.

The reported climb rate scatters as a random walk (with satellites 0.3 m/s after one second), in
which an acceleration drowns unless the fit is whitened: generalised least squares, with the scatter
estimated from the fit's own residuals, twice over.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.identification.estimates import Estimate, FittedCurve, Response, UnidentifiedError
from companion.identification.intervals import half_width
from companion.identification.least_squares import Parameters, Solution, inverse_information, solve
from companion.identification.lift_model import LiftModel, lag_as_second_order
from companion.identification.parts import Rows, require
from companion.identification.recording import Array, Recording
from companion.identification.scatter import (
    FittedScatter,
    Scatter,
    VelocityScatter,
    likeliest,
)

_PARTS = ("hover", "thrust", "climb")
_REPORTED_PARTS = ("hover", "roll", "pitch", "climb")
_ALL = (0, 1, 2, 3, 4)
_HOVER_ONLY = (0, 2, 4)
_LEAST_REPORTED = 0.5
"""Share of the samples for which a thrust must be known."""
_REPORTS_ARE_OFF = 0.002
"""Standard deviation, in shares: between two reports the autopilot's loop answers to the very
scatter of the climb rate that the reports are held against."""
_LEAST_WAVE = 0.03
_ROUNDS = 3


@dataclass(frozen=True, slots=True)
class LiftFit:
    """The vertical axis where the field is thrust."""

    response: Response
    hover_thrust: Estimate
    values: Array
    """(5,) τ (s), T (s), h, γ, k (1/s)."""
    covariance: Array
    """(5, 5) of them."""
    scatter: FittedScatter
    curve: FittedCurve


def fit_lift(
    recording: Recording, thrust_curve: float = 0.0, weighting: FittedScatter | None = None
) -> LiftFit:
    """Fit the vertical axis.

    Args:
        recording: with the parts hover, thrust and climb; its field is collective thrust or the
            vertical part of it.
        thrust_curve: c in force = c t² + (1 - c) t.
        weighting: the scatter to weight with; None: it is estimated from the residuals.

    Raises:
        UnidentifiedError: a part is missing, or the thrust does not show in the climb rate.
    """
    wave = require(recording, "thrust")
    field = recording.thrust
    force = thrust_curve * field**2 + (1.0 - thrust_curve) * field
    moved = float(np.std(force[wave]) / np.mean(force[wave]))
    if moved < _LEAST_WAVE:
        raise UnidentifiedError(
            f"the thrust moves by {moved:.0%} (rms) only in the part 'thrust', and at least "
            f"{_LEAST_WAVE:.0%} are needed. Fly a larger wave"
        )
    hover = float(np.mean(force[require(recording, "hover")]))
    model = LiftModel(recording, force)
    fitted = _fit(model, model.runs(_PARTS), _parameters(hover), _ALL, weighting)
    _refuse(fitted.values, _parameters(hover))
    return LiftFit(
        _response(fitted.values, fitted.covariance),
        _hover_thrust(fitted.values[2], fitted.covariance[2, 2], thrust_curve),
        fitted.values,
        fitted.covariance,
        fitted.scatter,
        model.curve(fitted.values, wave),
    )


@dataclass(frozen=True, slots=True)
class ReportedLift:
    """What the thrust that an autopilot reports tells, while it flies the climb rate itself."""

    hover_thrust: Estimate
    scatter: FittedScatter


def fit_reported_lift(
    recording: Recording, weighting: FittedScatter | None = None
) -> ReportedLift | None:
    """The hover thrust from the reported one; None if none is reported.

    The reports are late and few, so they tell nothing of the motors' lag, which is fitted along.

    Args:
        recording: with the part hover.
        weighting: see `fit_lift`.

    Raises:
        UnidentifiedError: there is no hover.
    """
    hover_rows = require(recording, "hover")
    known = np.flatnonzero(np.isfinite(recording.reported_thrust))
    if len(known) < _LEAST_REPORTED * len(recording):
        return None
    newest = np.maximum.accumulate(
        np.where(np.isfinite(recording.reported_thrust), 1, 0) * np.arange(len(recording))
    )
    force = recording.reported_thrust[np.maximum(newest, known[0])]
    hover = float(np.mean(force[hover_rows]))
    model = LiftModel(recording, force)
    fitted = _fit(model, model.runs(_REPORTED_PARTS), _parameters(hover), _HOVER_ONLY, weighting)
    variance = fitted.covariance[2, 2] + (_REPORTS_ARE_OFF * fitted.values[2]) ** 2
    return ReportedLift(_hover_thrust(fitted.values[2], variance, 0.0), fitted.scatter)


@dataclass(frozen=True, slots=True)
class _Fitted:
    values: Array
    covariance: Array
    scatter: FittedScatter


def _parameters(hover: float) -> Parameters:
    """τ, T, h, γ, k."""
    return Parameters(
        start=np.array([0.04, 0.03, hover, 1.0, 0.3]),
        steps=np.array([0.001, 0.002, 0.002, 0.01, 0.05]),
        low=np.array([0.002, -0.05, 0.3 * hover, 0.3, 0.0]),
        high=np.array([0.5, 0.3, 3.0 * hover, 2.0, 4.0]),
    )


def _fit(
    model: LiftModel,
    runs: list[Rows],
    whole: Parameters,
    free: tuple[int, ...],
    weighting: FittedScatter | None,
) -> _Fitted:
    """Fit the free ones of the parameters, and the scatter along with them."""
    chosen = list(free)
    values = whole.start.copy()
    scatter = weighting or FittedScatter(VelocityScatter(0.02, 0.1, 1.0), (0.0, 0.0, 0.0))
    begin: Scatter | None = None

    def solved(about: Array) -> tuple[Array, Solution]:
        """The values, and the fit there."""
        misfit = model.whitened_misfit(about, runs, scatter.scatter)

        def of_chosen(some: Array) -> Array:
            every = about.copy()
            every[chosen] = some
            return misfit(every)

        solution = solve(
            of_chosen,
            Parameters(about[chosen], whole.steps[chosen], whole.low[chosen], whole.high[chosen]),
        )
        every = about.copy()
        every[chosen] = solution.values
        return every, solution

    for _ in range(_ROUNDS):
        values, _ = solved(values)
        if weighting is None:
            scatter = likeliest(VelocityScatter, model.residuals(values, runs), begin)
            begin = scatter.scatter
    values, solution = solved(values)
    # The scatter was found from thinned samples; what all of them have more widens the intervals.
    excess = max(1.0, float(np.mean(solution.misfit**2)))
    covariance = np.zeros((len(values), len(values)))
    covariance[np.ix_(chosen, chosen)] = excess * inverse_information(solution.jacobian)
    return _Fitted(values, covariance, scatter)


def _refuse(values: Array, parameters: Parameters) -> None:
    for index, name in ((0, "lag"), (2, "hover thrust"), (3, "slope")):
        if not parameters.low[index] < values[index] < parameters.high[index]:
            raise UnidentifiedError(
                f"the {name} of the thrust comes out at {values[index]:g}, the end of what is "
                "looked for: the climb rate does not follow the thrust. Fly in calmer air, with a "
                "larger wave, and see that the autopilot takes the thrust as such"
            )


def _response(values: Array, covariance: Array) -> Response:
    lag_s, dead_s, _, straight, _ = values.tolist()
    omega, zeta = lag_as_second_order(lag_s)
    step = 1e-5
    omega_up, zeta_up = lag_as_second_order(lag_s + step)
    to_omega, to_zeta = (omega_up - omega) / step, (zeta_up - zeta) / step
    return Response(
        Estimate(omega, half_width(to_omega**2 * covariance[0, 0]), "rad/s"),
        Estimate(zeta, half_width(to_zeta**2 * covariance[0, 0]), ""),
        Estimate(max(0.0, dead_s), half_width(covariance[1, 1]), "s"),
        Estimate(straight, half_width(covariance[3, 3]), ""),
    )


def _hover_thrust(force: float, variance: float, curve: float) -> Estimate:
    """The field whose force share hovers."""
    if curve < 1e-9:
        return Estimate(float(force), half_width(variance), "")
    rest = 1.0 - curve
    root = math.sqrt(rest * rest + 4.0 * curve * float(force))
    return Estimate((root - rest) / (2.0 * curve), half_width(variance / root**2), "")
