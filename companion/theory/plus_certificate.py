"""The certificate of MPC-L1+ on a vehicle: stability, margins, disturbances, noise, the family."""

import math
from dataclasses import dataclass

import numpy as np

from companion.config.models import DynamicsConfig, VehicleConfig
from companion.control.interfaces import AdaptationMean
from companion.control.plus.stack import PlusStack
from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2
from companion.theory.conditions import Condition
from companion.theory.envelope import Air
from companion.theory.plant import ComplexArray
from companion.theory.plus_conditions import PlusFindings, plus_conditions
from companion.theory.plus_envelope import PlusSigma, sigma_bounds
from companion.theory.plus_family import FAMILY, Member
from companion.theory.plus_figures import (
    Noises,
    PlusMargins,
    PredictorFigures,
    deviation,
    frequencies,
    gust_deviation,
    margins,
    peak_gain,
    predictor_figures,
    rest,
    step_response,
)
from companion.theory.plus_law import PlusLaw, law_of
from companion.theory.plus_loop import (
    INPUT,
    INPUT_RATE,
    POSITION,
    VELOCITY,
    ClosedLoop,
    PlusAxisPlant,
    axis_plants,
    broken_at_u,
    closed_loop,
    law_response,
    radii,
)

AXES = ("x", "y", "z")
GUST_S = 1.0
"""Correlation time of the gusts whose effect is told."""
SHOWN_S = 3.0
"""Of the responses to a step."""
_USUAL_TILT_NOISE_RAD = 2e-3
"""Of a vehicle whose file states none."""


@dataclass(frozen=True, slots=True)
class PlusSubject:
    """What is certified, and under what assumptions."""

    stack: PlusStack
    cautious: PlusStack
    """What the monitor falls back to."""
    vehicle: VehicleConfig
    dynamics: DynamicsConfig
    air: Air
    sample_s: float

    @property
    def tilt_noise_rad(self) -> float:
        """White part of roll and pitch, one sigma."""
        noise = self.vehicle.noise
        return _USUAL_TILT_NOISE_RAD if noise is None else noise.tilt_rad


@dataclass(frozen=True, slots=True)
class Response:
    """Of the position to accelerations that nothing announces; each per m/s²."""

    peak_gain_m: float
    """The largest |p| that any disturbance of at most 1 m/s² can make, at the samples."""
    rest_m: float
    """What stays under a lasting one."""
    gust_m: float
    """Standard deviation under gusts of that standard deviation, forgotten in a second."""
    step_m: Array
    """At the samples after one has set in."""


@dataclass(frozen=True, slots=True)
class MemberResult:
    """Of one vehicle of the family."""

    member: Member
    radius: float
    slowest_1_s: complex
    modulus: float
    """Not a number where it is unstable."""
    gust_m: float


@dataclass(frozen=True, slots=True)
class PlusAxisCertificate:
    """Of one axis."""

    axis: str
    plant: PlusAxisPlant
    loop: ClosedLoop
    margins: PlusMargins
    predictor_radius: float
    y_tilde_deviation_m_s: float
    y_tilde_gain_s2: float
    """Largest |ṽ| per bound of |σ'|."""
    sigma: PlusSigma
    sigma_bound_m_s2: float
    velocity_gain_s: float
    """‖G‖: the largest |v| that any disturbance of at most 1 m/s² can make, at the samples."""
    response: Response
    unadapted: Response
    """With σ̂ held at 0."""
    unadapted_radius: float
    cautious_radius: float
    cautious_worst: tuple[str, float]
    """Of the family that is not hard: the name and the radius."""
    noise_of_u: float
    """Standard deviation of the command that noise makes, in the unit of u."""
    noise_of_slew: float
    """The same of its rate, per s."""
    members: tuple[MemberResult, ...]
    conditions: tuple[Condition, ...]

    @property
    def interface(self) -> str:
        """What u is."""
        return self.plant.actuation.interface

    @property
    def holds(self) -> bool:
        """Every condition holds."""
        return all(condition.holds for condition in self.conditions)


@dataclass(frozen=True, slots=True)
class PlusCertificate:
    """Of MPC-L1+ on a vehicle."""

    subject: PlusSubject
    law: PlusLaw
    unadapted: PlusLaw
    axes: tuple[PlusAxisCertificate, ...]

    @property
    def holds(self) -> bool:
        """Every condition holds on every axis."""
        return all(axis.holds for axis in self.axes)


def certify_plus(subject: PlusSubject) -> PlusCertificate:
    """Reckon everything; deterministic, some seconds.

    Raises:
        ValueError: the predictor's covariance does not settle.
    """
    delay_s, h = subject.dynamics.loop_delay_s, subject.sample_s
    stack = subject.stack
    nobody = AdaptationMean((0.0,) * 3, (0.0,) * 3, (0.0,) * 3)
    law = law_of(stack, delay_s, h)
    unadapted = law_of(stack.without_adaptation(nobody), delay_s, h)
    cautious = law_of(subject.cautious, delay_s, h)
    told = {0.0: law}
    for member in FAMILY:
        if member.told_s not in told:
            told[member.told_s] = law_of(stack, delay_s + member.told_s, h)
    plants = axis_plants(stack.settings.plant, delay_s)
    drags = np.array([plant.drag_1_s for plant in plants])
    found = predictor_figures(stack.settings.noise, drags, law.covariance, h)
    facts = _Facts(
        law, unadapted, cautious, told, plants, margins(law, plants), found, radii(cautious, plants)
    )
    axes = tuple(_axis(subject, i, facts) for i in range(len(AXES)))
    return PlusCertificate(subject, law, unadapted, axes)


@dataclass(frozen=True, slots=True)
class _Facts:
    """Of all axes."""

    law: PlusLaw
    unadapted: PlusLaw
    cautious: PlusLaw
    told: dict[float, PlusLaw]
    plants: tuple[PlusAxisPlant, ...]
    margins: tuple[PlusMargins, ...]
    predictor: PredictorFigures
    cautious_radii: Array


def _axis(subject: PlusSubject, i: int, facts: _Facts) -> PlusAxisCertificate:
    settings, plant, law = subject.stack.settings, facts.plants[i], facts.law
    loop, still = closed_loop(law, i, plant), closed_loop(facts.unadapted, i, plant)
    noise = settings.noise
    noises = Noises(
        noise.position_m[i],
        noise.velocity_m_s[i],
        subject.tilt_noise_rad * settings.plant.tilt_gain * GRAVITY_M_S2 if i < 2 else 0.0,
        noise.acceleration_m_s2_sqrt_hz[i],
    )
    omega = frequencies(law.sample_s)
    answers = {told_s: law_response(other, i, omega) for told_s, other in facts.told.items()}
    members = tuple(_member(facts.told[m.told_s], i, m, plant, answers[m.told_s]) for m in FAMILY)
    worst = _worst(facts.cautious, i, plant)
    sigma = sigma_bounds(subject.vehicle, subject.dynamics, subject.air, vertical=i == 2)
    findings = PlusFindings(
        predictor_radius=float(facts.predictor.radius[i]),
        radius=loop.radius,
        slowest_1_s=loop.slowest_1_s,
        unadapted_radius=still.radius,
        cautious_radius=float(facts.cautious_radii[i]),
        cautious_worst=worst,
        modulus=facts.margins[i].modulus,
        velocity_gain_s=peak_gain(loop, VELOCITY),
        lipschitz_1_s=sigma.lipschitz_1_s,
        planned_sigma_m_s2=sigma.planned_m_s2,
        sigma_m_s2=sigma.worst_m_s2,
        sigma_bound_m_s2=settings.sigma_bound_m_s2[i],
        members=tuple((m.member, m.radius, m.modulus) for m in members),
    )
    return PlusAxisCertificate(
        axis=AXES[i],
        plant=plant,
        loop=loop,
        margins=facts.margins[i],
        predictor_radius=findings.predictor_radius,
        y_tilde_deviation_m_s=float(law.y_tilde_deviation_m_s[i]),
        y_tilde_gain_s2=float(facts.predictor.y_tilde_s2[i]),
        sigma=sigma,
        sigma_bound_m_s2=findings.sigma_bound_m_s2,
        velocity_gain_s=findings.velocity_gain_s,
        response=_response(loop),
        unadapted=_response(still),
        unadapted_radius=still.radius,
        cautious_radius=findings.cautious_radius,
        cautious_worst=worst,
        noise_of_u=deviation(loop, INPUT, noises),
        noise_of_slew=deviation(loop, INPUT_RATE, noises),
        members=members,
        conditions=plus_conditions(findings),
    )


def _worst(law: PlusLaw, i: int, plant: PlusAxisPlant) -> tuple[str, float]:
    """The name of the member with the largest radius, and that, of those that must be stable."""
    mild = [member for member in FAMILY if not member.hard and member.told_s == 0.0]
    found = [(m.name, closed_loop(law, i, m.change(plant)).radius) for m in mild]
    return max(found, key=lambda one: one[1])


def _member(
    law: PlusLaw, i: int, member: Member, plant: PlusAxisPlant, response: ComplexArray
) -> MemberResult:
    changed = member.change(plant)
    loop = closed_loop(law, i, changed)
    distance = math.nan
    if loop.radius < 1.0:
        omega = frequencies(law.sample_s)
        values = broken_at_u(response, changed, omega, law.sample_s)
        distance = float(np.abs(1.0 + values).min())
    gust = gust_deviation(loop, POSITION, GUST_S)
    return MemberResult(member, loop.radius, loop.slowest_1_s, distance, gust)


def _response(loop: ClosedLoop) -> Response:
    return Response(
        peak_gain(loop, POSITION),
        rest(loop, POSITION),
        gust_deviation(loop, POSITION, GUST_S),
        step_response(loop, POSITION, SHOWN_S),
    )
