"""max |ỹ| against the adaptation rate Γ, with and without measurement noise.

The paper: "γ0 ∝ √(1/Γ), which means that for high adaptation gains, the estimation error is bounded
and can be made arbitrarily small."
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from companion.control.inner import L1Controller
from companion.experiments.flight_task import FlightTask
from companion.experiments.paper.flights import Flights, scored, vectors
from companion.experiments.paper.guarantees import Theory
from companion.experiments.paper.scale import VEHICLE, Scale
from companion.report.flight_data import Array
from companion.theory.plant import AxisPlant
from companion.theory.reference_system import largest_prediction_errors
from companion.theory.sampled_data import period_map, sampled_loop

CONTROLLER = "l1"
TRAJECTORY = 4
SAMPLE_HZ = 250.0
"""The fastest that the vehicle's state comes."""
_STEP_SINE = 0.05
_STEP_SEEN_S = 10.0
_NOISE_RULES = 2.0
"""Where the noisy ỹ is this many times the noise-free one, noise decides."""


@dataclass(frozen=True, slots=True)
class AdaptationRate:
    """The sweep; arrays over the rates."""

    gammas: Array
    exact_m_s: Array
    """(rates, 3) max |ỹ| per axis over the scored part, noise-free."""
    noisy_m_s: Array
    """The same with the vehicle's measurement noise."""
    stable: np.ndarray
    """(rates,) whether the sampled loop is stable by its eigenvalues, in x and y."""
    fitted: np.ndarray
    """(rates,) the points of the slope: stable, and sampled at 10 √(mΓ) or faster."""
    slope: float
    """Of log max |ỹ| (of the horizontal axes, noise-free) over log Γ, of the fitted points."""
    slope_all: float
    """The same over all rates, the unstable ones too."""
    noise_decides_from: float
    """Least stable Γ at which noise more than doubles the horizontal |ỹ|; infinite if none."""
    noise_floor_m_s: float
    """Least horizontal max |ỹ| with noise."""
    well_sampled_to: float
    """Largest Γ of the sweep with 10 √(mΓ) samples a second, horizontal axes."""
    step_model_m_s: Array
    """(rates,) max |ỹ| of the law around A(s) = M(s) for a step at its input: reckoned, not
    flown, and sampled at 20 √(mΓ)."""
    step_model_slope: float


def _task(gamma: float, seed: int, sensors: str | None) -> FlightTask:
    settings = (
        ("controller.l1.gamma", f"[{gamma:g}, {gamma:g}, {gamma:g}]"),
        ("state_rate_hz", f"{SAMPLE_HZ:g}"),
    )
    return FlightTask(CONTROLLER, TRAJECTORY, "calm", seed, VEHICLE, settings, sensors)


def tasks(scale: Scale) -> list[FlightTask]:
    """What is flown."""
    return [
        _task(gamma, scale.seeds[0], sensors)
        for gamma in scale.adaptation_rates
        for sensors in ("exact", None)
    ]


def evaluate(flights: Flights, scale: Scale, theory: Theory) -> AdaptationRate:
    """The sweep's figures."""
    gammas = np.array(scale.adaptation_rates)
    exact, noisy = (
        np.array([_largest(flights, _task(g, scale.seeds[0], sensors)) for g in gammas])
        for sensors in ("exact", None)
    )
    horizontal, horizontal_noisy = exact[:, :2].max(axis=1), noisy[:, :2].max(axis=1)
    stable = np.array([_is_stable(float(gamma), theory) for gamma in gammas])
    m = theory.gains.reference_model[0].denominator[1]
    step = _step_on_the_ideal_plant(gammas, theory, m)
    decides = stable & (horizontal_noisy > _NOISE_RULES * horizontal)
    sampled = 10.0 * np.sqrt(m * gammas) <= SAMPLE_HZ
    fitted = stable & sampled
    return AdaptationRate(
        gammas,
        exact,
        noisy,
        stable,
        fitted,
        slope=log_slope(gammas[fitted], horizontal[fitted]),
        slope_all=log_slope(gammas, horizontal),
        noise_decides_from=float(gammas[decides].min()) if decides.any() else math.inf,
        noise_floor_m_s=float(horizontal_noisy.min()),
        well_sampled_to=float(gammas[sampled].max()) if sampled.any() else math.nan,
        step_model_m_s=step,
        step_model_slope=log_slope(gammas, step),
    )


def _is_stable(gamma: float, theory: Theory) -> bool:
    """Whether L1 and its position loop, as implemented and sampled here, are stable in x and y."""
    rates = tuple(gamma for _ in theory.gains.gamma)
    inner = L1Controller(replace(theory.gains, gamma=rates))
    loop = sampled_loop(theory.plants, inner, None, 1.0 / SAMPLE_HZ, theory.loop_delay_s)
    return bool((period_map(loop).radii[:2] < 1.0).all())


def _step_on_the_ideal_plant(gammas: Array, theory: Theory, m: float) -> Array:
    """Largest |ỹ| of the implemented law around A(s) = M(s), per Γ, for a step of its input.

    The worst that a disturbance can do: with relative degree 1 a step of d is one of σ.  Sampled at
    20 √(mΓ) of the largest Γ.
    """
    plant = AxisPlant(theory.gains.reference_model[0], 0.0)
    errors: Array = largest_prediction_errors(
        plant,
        theory.gains.reference_model[0],
        theory.gains.low_pass[0],
        gammas,
        1.0 / (20.0 * math.sqrt(m * float(gammas.max()))),
        lambda times: np.full_like(times, _STEP_SINE),
        _STEP_SEEN_S,
    )
    return errors


def log_slope(gammas: Array, values: Array) -> float:
    """Slope of a straight line through the logarithms; NaN with fewer than two finite values."""
    use = np.isfinite(values) & (values > 0.0)
    if use.sum() < 2:
        return math.nan
    return float(np.polyfit(np.log(gammas[use]), np.log(values[use]), 1)[0])


def _largest(flights: Flights, task: FlightTask) -> Array:
    table = flights.table(task)
    if table is None:
        return np.full(3, np.inf)
    largest: Array = np.nanmax(np.abs(vectors(table, "y_tilde_{}_m_s")[scored(table)]), axis=0)
    return largest
