"""The certificate of an L1 controller on a vehicle: conditions, norms, bounds, margins."""

import math
from dataclasses import dataclass

from companion.config.models import DynamicsConfig, VehicleConfig
from companion.control.inner import L1Controller
from companion.control.interfaces import OuterController
from companion.control.l1_adaptive import L1Gains
from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2
from companion.control.transfer_function import TransferFunction
from companion.theory import bounds, norms
from companion.theory.adaptation_rate import (
    GammaRange,
    adaptation_radii,
    safe_gamma,
    sampling_limit,
    unprojected,
)
from companion.theory.conditions import Condition, Findings, conditions
from companion.theory.envelope import (
    Air,
    SigmaBounds,
    ThrustLoop,
    horizontal_bounds,
    vertical_bounds,
)
from companion.theory.loops import AxisLoop, h_is_stable, poles_of_h, whole_loop_is_stable
from companion.theory.margins import Margins, SampledMargins, continuous_margins, sampled_margins
from companion.theory.norms import L1Norm
from companion.theory.plant import ComplexArray, axis_plants, evaluate
from companion.theory.sampled_data import PeriodMap, SampledLoop, period_map, sampled_loop
from companion.theory.sampled_noise import NoiseGains, noise_gains

AXES = ("x", "y", "z")
_LARGEST_RADIUS = 1e6
"""Of a step of the adaptation law, with which a loop around it is still reckoned."""


@dataclass(frozen=True, slots=True)
class Subject:
    """What is certified, and under what assumptions."""

    gains: L1Gains
    outer: OuterController
    """Without limits that would act near rest."""
    vehicle: VehicleConfig
    dynamics: DynamicsConfig
    thrust: ThrustLoop
    air: Air
    sample_s: float


@dataclass(frozen=True, slots=True)
class Bounds:
    """Of the estimation error and of the way to the reference system."""

    delta: float
    """Δ: the projection's bound."""
    sigma: SigmaBounds
    gamma_0_m_s: float | None
    """None: no Lyapunov function was found for M(s)."""
    gamma_1_m_s: float | None


@dataclass(frozen=True, slots=True)
class AxisCertificate:
    """Of one axis."""

    axis: str
    loop: AxisLoop
    poles: ComplexArray
    """Of H, 1/s, with a Padé approximation of the delay; the slowest first."""
    norm_g: L1Norm | None
    """‖G‖; None while H is unstable, or its list of poles has no decay; so the next."""
    norm_ch_over_m: L1Norm | None
    norm_behind: L1Norm | None
    """As ‖G‖, with the drag where it acts in truth: behind the attitude; None for z."""
    bounds: Bounds
    margins: Margins | None
    """Of the L1 controller with its position loop; None while that is unstable."""
    adaptation_radius: float
    inner_radius: float
    """Spectral radius over a sample, the position reference at rest."""
    whole_radius: float
    """The same over a common period, with the outer controller."""
    slowest: complex
    """Pole of the whole loop, 1/s."""
    inner_margins: tuple[float, float, float]
    """Gain up, gain down, delay (s) of the sampled loop, the position reference at rest."""
    whole_margins: tuple[float, float, float]
    """The same with the outer controller."""
    noise_to_y_tilde: float
    """Standard deviation of ỹ per one of the measured velocity, with the outer controller."""
    noise_to_u: float
    """The same of u, in its unit per m/s."""
    gamma_low: float
    """Ends of the stable range; not a number where there is none."""
    gamma_high: float
    gamma_high_reason: str
    gamma_safe: float
    """Upper end of the safe part of that range."""
    conditions: tuple[Condition, ...]

    @property
    def holds(self) -> bool:
        """Every condition holds."""
        return all(condition.holds for condition in self.conditions)


@dataclass(frozen=True, slots=True)
class Certificate:
    """Of a controller on a vehicle."""

    subject: Subject
    axes: tuple[AxisCertificate, ...]
    period_s: float
    """Of the whole sampled loop."""

    @property
    def holds(self) -> bool:
        """Every condition holds on every axis."""
        return all(axis.holds for axis in self.axes)


def inner_loop(subject: Subject) -> SampledLoop:
    """The sampled loop with the position reference at rest."""
    return _sampled(subject, None)


def whole_loop(subject: Subject) -> SampledLoop:
    """The sampled loop with the outer controller."""
    return _sampled(subject, subject.outer)


def certify(subject: Subject) -> Certificate:
    """Reckon everything; deterministic, about a second or two.

    Raises:
        ValueError: rates without a common period, a plant that the tests are not made for, or a Γ
            with which nothing can be reckoned.
    """
    radii = adaptation_radii(subject.gains, subject.sample_s)
    _refuse_beyond_arithmetic(subject, radii)
    inner, whole = inner_loop(subject), whole_loop(subject)
    inner_map, whole_map = period_map(inner), period_map(whole)
    inner_margins, whole_margins = sampled_margins(inner), sampled_margins(whole)
    gamma_range = safe_gamma(whole, subject.gains)
    facts = _SampledFacts(
        maps=(inner_map, whole_map),
        margins=(inner_margins, whole_margins),
        gamma_range=gamma_range,
        adaptation_radii=radii,
        noise=noise_gains(whole),
    )
    axes = [_axis(subject, i, facts) for i in range(len(AXES))]
    return Certificate(subject, tuple(axes), whole_map.period_s)


def _refuse_beyond_arithmetic(subject: Subject, radii: Array) -> None:
    for i, radius in enumerate(radii):
        if radius > _LARGEST_RADIUS:
            gains = subject.gains
            raise ValueError(
                f"l1.gamma: Γ = {gains.gamma[i]:g} on {AXES[i]} is beyond what a step of the law "
                f"can be reckoned with; {1.0 / subject.sample_s:g} Hz hold a Γ of up to "
                f"{sampling_limit(gains.reference_model[i], subject.sample_s):.3g}"
            )


def _sampled(subject: Subject, outer: OuterController | None) -> SampledLoop:
    return sampled_loop(
        axis_plants(subject.dynamics),
        L1Controller(unprojected(subject.gains)),
        outer,
        subject.sample_s,
        subject.dynamics.loop_delay_s,
    )


@dataclass(frozen=True, slots=True)
class _SampledFacts:
    """Of the sampled loop, all axes; pairs are without and with the outer controller."""

    maps: tuple[PeriodMap, PeriodMap]
    margins: tuple[SampledMargins, SampledMargins]
    gamma_range: GammaRange
    adaptation_radii: Array
    noise: NoiseGains


def _axis(subject: Subject, i: int, facts: _SampledFacts) -> AxisCertificate:
    gains = subject.gains
    loop = AxisLoop(
        axis_plants(subject.dynamics)[i],
        gains.reference_model[i],
        gains.low_pass[i],
        gains.gain_k[i],
        gains.gamma[i],
    )
    stable, whole_stable = h_is_stable(loop), whole_loop_is_stable(loop)
    poles = poles_of_h(loop)
    norm_g = norm_ch_over_m = norm_behind = None
    if stable and poles[0].real < 0.0:
        decay = float(-poles[0].real)
        norm_g = norms.from_frequency_response(loop.g, decay)
        norm_ch_over_m = norms.from_frequency_response(loop.ch_over_m, decay)
        if AXES[i] != "z":
            behind = TransferFunction((GRAVITY_M_S2,), (1.0, subject.dynamics.linear_drag_1_s))
            norm_behind = norms.from_frequency_response(
                lambda s: evaluate(behind, s) * loop.sensitivity(s), decay
            )
    limits = _bounds(subject, i, norm_g, norm_ch_over_m)
    maps, gamma_range = facts.maps, facts.gamma_range
    inner_radii, whole_radii = maps[0].radii, maps[1].radii
    findings = Findings(
        model=gains.reference_model[i],
        low_pass=gains.low_pass[i],
        h_stable=stable,
        slowest_pole=complex(poles[0]),
        norm_g=None if norm_g is None else norm_g.value + norm_g.uncertainty,
        lipschitz=limits.sigma.lipschitz,
        sigma=limits.sigma.sigma,
        planned_sigma=limits.sigma.planned_sigma,
        delta=limits.delta,
        projection_margin=gains.projection_margin,
        continuous_stable=whole_stable,
        discretisation=gains.discretisation,
        sample_s=subject.sample_s,
        gamma=gains.gamma[i],
        adaptation_radius=float(facts.adaptation_radii[i]),
        inner_radius=float(inner_radii[i]),
        inner_pole=complex(maps[0].critical[i]),
        whole_radius=float(whole_radii[i]),
        whole_pole=complex(maps[1].critical[i]),
        gamma_low=float(gamma_range.low[i]),
        gamma_high=float(gamma_range.high[i]),
        gamma_high_reason=gamma_range.reasons[i],
        gamma_safe=float(gamma_range.safe[i]),
        gamma_limit=sampling_limit(gains.reference_model[i], subject.sample_s),
        noise_to_y_tilde=float(facts.noise.y_tilde[i]),
        noise_to_u=float(facts.noise.u_s_m[i]),
    )
    return AxisCertificate(
        axis=AXES[i],
        loop=loop,
        poles=poles,
        norm_g=norm_g,
        norm_ch_over_m=norm_ch_over_m,
        norm_behind=norm_behind,
        bounds=limits,
        margins=continuous_margins(loop.broken_at_u) if whole_stable else None,
        adaptation_radius=findings.adaptation_radius,
        inner_radius=findings.inner_radius,
        whole_radius=findings.whole_radius,
        slowest=findings.whole_pole,
        inner_margins=_of_axis(facts.margins[0], i),
        whole_margins=_of_axis(facts.margins[1], i),
        noise_to_y_tilde=findings.noise_to_y_tilde,
        noise_to_u=findings.noise_to_u,
        gamma_low=findings.gamma_low,
        gamma_high=findings.gamma_high,
        gamma_high_reason=findings.gamma_high_reason,
        gamma_safe=findings.gamma_safe,
        conditions=conditions(findings),
    )


def _of_axis(margins: SampledMargins, i: int) -> tuple[float, float, float]:
    return float(margins.gain_up[i]), float(margins.gain_down[i]), float(margins.delay_s[i])


def _bounds(
    subject: Subject, i: int, norm_g: L1Norm | None, norm_ch_over_m: L1Norm | None
) -> Bounds:
    gains, vehicle, dynamics = subject.gains, subject.vehicle, subject.dynamics
    model, low_pass, delta = gains.reference_model[i], gains.low_pass[i], gains.sigma_bound[i]
    if AXES[i] == "z":
        sigma = vertical_bounds(
            vehicle, dynamics, subject.air, subject.thrust, model, low_pass, delta
        )
    else:
        sigma = horizontal_bounds(vehicle, dynamics, subject.air, model, low_pass, delta)
    gamma_0 = bounds.gamma_0(model, gains.gamma[i], delta, sigma.sigma_rate)
    gamma_1 = None
    if gamma_0 is not None and norm_g is not None and norm_ch_over_m is not None:
        largest_g = norm_g.value + norm_g.uncertainty
        largest = norm_ch_over_m.value + norm_ch_over_m.uncertainty
        gamma_1 = bounds.gamma_1(largest, largest_g, sigma.lipschitz, gamma_0)
        gamma_1 = None if math.isinf(gamma_1) else gamma_1
    return Bounds(delta, sigma, gamma_0, gamma_1)
