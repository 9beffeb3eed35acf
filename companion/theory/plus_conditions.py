"""The conditions of MPC-L1+'s certificate, each with what was found and, where it fails, why."""

import math
from dataclasses import dataclass

from companion.theory.conditions import Condition
from companion.theory.plus_family import Member

GUIDE_MODULUS = 0.5
"""Of |1 + L|: a sensitivity of at most 2, the usual guide."""
_BARELY = 0.2


@dataclass(frozen=True, slots=True)
class PlusFindings:
    """What the conditions of an axis are decided by."""

    predictor_radius: float
    radius: float
    slowest_1_s: complex
    unadapted_radius: float
    cautious_radius: float
    cautious_worst: tuple[str, float]
    modulus: float
    velocity_gain_s: float
    lipschitz_1_s: float
    planned_sigma_m_s2: float
    sigma_m_s2: float
    sigma_bound_m_s2: float
    members: tuple[tuple[Member, float, float], ...]
    """Each with spectral radius and modulus margin."""


def plus_conditions(f: PlusFindings) -> tuple[Condition, ...]:
    """All of them, in the order of the table."""
    return (
        _predictor(f),
        _nominal(f),
        _unadapted(f),
        _cautious(f),
        _modulus(f),
        _norm(f),
        _projection(f),
        _family(f),
    )


def _predictor(f: PlusFindings) -> Condition:
    name, found = "predictor stable", f"radius {f.predictor_radius:.4f} at its steady gain"
    if f.predictor_radius < 1.0:
        return Condition(name, True, found)
    return Condition(name, False, found, "its error does not die away: check the stated noise")


def _nominal(f: PlusFindings) -> Condition:
    name = "sampled loop, as identified"
    found = f"radius {f.radius:.4f}, slowest pole {_pole(f.slowest_1_s)}"
    if f.radius < 1.0:
        return Condition(name, True, found)
    reason = "unstable on the very vehicle that it was made for: lower bandwidth_rad_s or low_pass"
    return Condition(name, False, found, f"{reason}_rad_s")


def _unadapted(f: PlusFindings) -> Condition:
    name, found = "the same with σ̂ held", f"radius {f.unadapted_radius:.4f}"
    if f.unadapted_radius < 1.0:
        return Condition(name, True, found)
    reason = "with the adaptation switched off the loop is unstable: lower bandwidth_rad_s"
    return Condition(name, False, found, reason)


def _cautious(f: PlusFindings) -> Condition:
    name = "the monitor's cautious variant"
    worst, radius = f.cautious_worst
    found = f"radius {f.cautious_radius:.4f}; {radius:.4f} at worst ({worst})"
    if f.cautious_radius >= 1.0:
        return Condition(name, False, found, "unstable as identified: change `caution`")
    caution = "" if radius < 1.0 else f"unstable with {worst}"
    return Condition(name, True, found, caution=caution)


def _modulus(f: PlusFindings) -> Condition:
    name = "modulus margin"
    if math.isnan(f.modulus):
        return Condition(name, False, "none", "the loop is unstable")
    found = f"{f.modulus:.2f}: sensitivity up to {1.0 / f.modulus:.2f}"
    caution = ""
    if f.modulus < GUIDE_MODULUS:
        caution = (
            f"below the usual guide of {GUIDE_MODULUS:g}: what differs from the identified vehicle "
            "is made more of; lower bandwidth_rad_s, low_pass_rad_s or sigma_walk"
        )
    return Condition(name, True, found, caution=caution)


def _norm(f: PlusFindings) -> Condition:
    name = "‖G‖ L < 1"
    product = f.velocity_gain_s * f.lipschitz_1_s
    if not math.isfinite(product):
        return Condition(name, False, "‖G‖ is infinite", "the loop is unstable")
    found = f"{f.velocity_gain_s:.3g} s · {f.lipschitz_1_s:.3g} 1/s = {product:.3g}"
    if product < 1.0:
        return Condition(name, True, found)
    reason = "the quadratic drag may make the loop unstable: fly slower or in less wind (--wind)"
    return Condition(name, False, found, reason)


def _projection(f: PlusFindings) -> Condition:
    name = "projection leaves σ free"
    found = (
        f"|σ| ≤ {f.planned_sigma_m_s2:.3g} in still air, {f.sigma_m_s2:.3g} at worst; "
        f"free to {f.sigma_bound_m_s2:g} m/s²"
    )
    if f.planned_sigma_m_s2 > f.sigma_bound_m_s2:
        reason = f"raise sigma_bound_m_s2 to {_up(f.planned_sigma_m_s2):g} at least"
        return Condition(name, False, found, reason)
    caution = ""
    if f.sigma_m_s2 > f.sigma_bound_m_s2:
        caution = (
            "in the worst wind σ̂ may rest on its bound; a sigma_bound_m_s2 of "
            f"{_up(f.sigma_m_s2):g} covers all"
        )
    return Condition(name, True, found, caution=caution)


def _family(f: PlusFindings) -> Condition:
    name = "stable over the family"
    unstable = [member for member, radius, _ in f.members if radius >= 1.0]
    rest = [(member, margin) for member, radius, margin in f.members if radius < 1.0]
    found = f"{len(rest)} of {len(f.members)}"
    if rest:
        weakest, margin = min(rest, key=lambda one: one[1])
        found += f"; the weakest of them, {weakest.name}: modulus margin {margin:.2f}"
    failing = [member.name for member in unstable if not member.hard]
    if failing:
        reason = (
            f"unstable with {'; '.join(failing)}: lower bandwidth_rad_s, low_pass_rad_s or "
            "sigma_walk"
        )
        return Condition(name, False, found, reason)
    cautions = []
    if unstable:
        names = "; ".join(member.name for member in unstable)
        cautions.append(f"unstable with {names}, as long as nothing is learnt in flight")
    barely = [member.name for member, margin in rest if margin < _BARELY]
    if barely:
        cautions.append(f"a modulus margin below {_BARELY:g} with {'; '.join(barely)}")
    return Condition(name, True, found, caution=". ".join(cautions))


def _pole(pole: complex) -> str:
    if abs(pole.imag) < 1e-9:
        return f"{pole.real:.3g} 1/s"
    return f"{pole.real:.3g} ± {abs(pole.imag):.3g}j 1/s"


def _up(value: float) -> float:
    return math.ceil(value * 10.0) / 10.0
