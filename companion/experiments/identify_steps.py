"""A second-order model per axis from separate steps in x, y and z, as the paper's MPC-PID takes it.

The framework ``pid`` has r2 = y2*, so that a step of the desired position is a step of r2.  The
model is ``ω² / (s² + 2 ζ ω s + ω²)``: linear, of second order, without delay.  The step is the
largest of a few at which no limit cuts u: a linear model of a saturated response says nothing.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.config.yaml_source import ConfigError
from companion.experiments.flight_task import FlightTask, load_task
from companion.experiments.fly_task import fly_loaded
from companion.experiments.memory_log import MemoryLog
from companion.trajectories.trajectory import Motion

Array = NDArray[np.float64]

_STEP_AT_S = 1.0
_RECORDED_S = 8.0
_BASE_M = (0.0, 0.0, 1.5)
_AXES = ("x", "y", "z")
_CUT = 1e-9
_LARGEST_MISFIT = 0.25
"""Of the step's size, rms."""
STEPS_M = (0.5, 0.3, 0.2, 0.1, 0.05)
"""Sizes of the step, the largest first."""
_FIRST_GUESSES = ((1.0, 0.7), (3.0, 0.7), (2.0, 0.3), (2.0, 1.5))
"""Natural frequency, rad/s, and damping, from which the fit begins; the best end counts."""


class UnidentifiedError(Exception):
    """A step's flight gives no model; the text says why."""


@dataclass(frozen=True, slots=True)
class StepTrajectory:
    """Rest, then a step along one axis, then rest."""

    axis: int
    size_m: float
    scored_s: float = _STEP_AT_S + _RECORDED_S

    @property
    def name(self) -> str:
        """Name for people."""
        return f"step of {self.size_m:g} m in {_AXES[self.axis]}"

    @property
    def end_s(self) -> float:
        """It rests from its step on; this is when it is no longer looked at."""
        return self.scored_s

    def position(self, times_s: Array) -> Array:
        """Desired positions (samples, 3), ENU m."""
        position = np.tile(np.array(_BASE_M), (len(times_s), 1))
        position[times_s >= _STEP_AT_S, self.axis] += self.size_m
        return position

    def position_at(self, time_s: float) -> tuple[float, float, float]:
        """The same at one time."""
        x, y, z = self.position(np.array([time_s]))[0].tolist()
        return x, y, z

    def motion(self, times_s: Array) -> Motion:
        """The same, with the rates of rest: a step has none that a vehicle could have."""
        rest = np.zeros((len(times_s), 3))
        return Motion(self.position(times_s), rest, rest)


@dataclass(frozen=True, slots=True)
class SecondOrder:
    """``ω² / (s² + 2 ζ ω s + ω²)`` and how well it fits."""

    natural_frequency_rad_s: float
    damping: float
    misfit_rms_m: float
    """Root mean square of the response minus the model's."""
    step_m: float = STEPS_M[0]
    """The step that was flown."""

    @property
    def m(self) -> float:
        """2 ζ ω, 1/s: D(s) is ``K m / (s² + m s + K m)``."""
        return 2.0 * self.damping * self.natural_frequency_rad_s

    @property
    def k(self) -> float:
        """ω² / m, 1/s."""
        return self.natural_frequency_rad_s**2 / self.m


@dataclass(frozen=True, slots=True)
class StepTask:
    """A step along one axis, flown with the controller and the weather of a task."""

    task: FlightTask
    axis: int


def identify(step: StepTask) -> SecondOrder:
    """Fly steps, the largest first, until one is not cut by a limit; fit the model to that one.

    The response is the reported position.

    Raises:
        ConfigError: the task can't be flown as it stands, or its r2 is not y2*.
        UnidentifiedError: the step was not flown to its end, or no model fits.
    """
    loaded = load_task(step.task)
    framework = loaded.config.controller.framework
    if framework not in ("pid", "l1"):
        raise ConfigError(
            f"steps of r2 need a framework with r2 = y2*, which {framework} has not. Take 'pid'."
        )
    for size_m in STEPS_M:
        log = MemoryLog()
        trajectory = StepTrajectory(step.axis, size_m)
        outcome = fly_loaded(loaded, trajectory, log, airborne=step.task.airborne)
        if outcome.scored_s is None or not outcome.completed:
            raise UnidentifiedError(f"the {trajectory.name} was not flown: {outcome.note}")
        ticks = log.data().ticks
        times = ticks.time_s - outcome.scored_s[0] - _STEP_AT_S
        position = ticks.position_enu_m[:, step.axis]
        known = np.isfinite(position) & (times < _RECORDED_S)
        after = known & (times >= 0.0)
        if np.nanmax(np.abs(ticks.u[after] - ticks.applied_u[after]), initial=0.0) < _CUT:
            before = known & (times > -0.5) & (times < 0.0)
            response = (position[after] - position[before].mean()) / size_m
            model = fit_second_order(times[after], response)
            return SecondOrder(
                model.natural_frequency_rad_s,
                model.damping,
                model.misfit_rms_m * size_m,
                size_m,
            )
    raise UnidentifiedError(
        f"every step in {_AXES[step.axis]} down to {STEPS_M[-1]:g} m is cut by the vehicle's "
        "limits: the loop is unstable, or its gains are too high to be identified"
    )


def fit_second_order(times_s: Array, response: Array) -> SecondOrder:
    """Least-squares fit of ω and ζ to the response to a unit step at time 0.

    Args:
        times_s: (samples,) since the step.
        response: (samples,) from 0 to about 1.

    Raises:
        UnidentifiedError: the response does not look like one.
    """
    from scipy.optimize import least_squares

    def misfit(logarithms: Array) -> Array:
        return step_response(times_s, *np.exp(logarithms)) - response

    if len(times_s) < 20 or not np.isfinite(response).all():
        raise UnidentifiedError("too few samples of the step's response")
    fits = [
        least_squares(misfit, np.log(guess), bounds=(np.log((0.05, 0.02)), np.log((50.0, 20.0))))
        for guess in _FIRST_GUESSES
    ]
    best = min(fits, key=lambda fit: fit.cost)
    omega, zeta = (float(value) for value in np.exp(best.x))
    rms = float(np.sqrt(np.mean(best.fun**2)))
    if rms > _LARGEST_MISFIT:
        raise UnidentifiedError(f"no second-order model fits: {rms:.2f} of the step is left over")
    return SecondOrder(omega, zeta, rms)


def step_response(times_s: Array, omega: float, zeta: float) -> Array:
    """Response of ``ω² / (s² + 2 ζ ω s + ω²)`` to a unit step at time 0.

    Args:
        times_s: (samples,) at least 0.
        omega: natural frequency, rad/s.
        zeta: damping, at least 0.
    """
    if abs(zeta - 1.0) < 1e-4:  # the two poles meet: the formula below divides by their distance
        zeta = 1.0 + 1e-4
    root = np.sqrt(complex(zeta**2 - 1.0))
    fast, slow = -omega * (zeta + root), -omega * (zeta - root)
    response: Array = (
        1.0 + (slow * np.exp(fast * times_s) - fast * np.exp(slow * times_s)) / (fast - slow)
    ).real
    return response
