"""A certificate as one JSON object."""

import math
from typing import Any

from companion.theory.certificate import AxisCertificate, Certificate
from companion.theory.norms import L1Norm

KINDS = {
    "conditions": "decided with the exact delay for the stated A(s)",
    "poles_of_h_1_s": "approximation: Padé of order 5 for the delay; stability itself is counted "
    "with the exact delay",
    "norms": "numerical values of the stated A(s), with their numerical uncertainty",
    "lipschitz": "bound, for the stated speeds, wind and quadratic drag, taken to act at u",
    "norm_behind_attitude": "as norm_g, for a drag that acts behind the attitude, as it does",
    "sigma_rate": "estimate: a bound while r1 asks for no more than r1_m_s",
    "gamma_0_m_s": "bound of the continuous-time law while |σ| stays within the projection's free "
    "part and |σ'| within sigma_rate; noise is not in it",
    "gamma_1_m_s": "the same, from gamma_0_m_s and the norms",
    "noise": "standard deviations per standard deviation of white noise of the measured velocity, "
    "linear",
    "gamma_range": "low and high: ends of stability of the sampled loop; safe_high: rule of thumb, "
    "10 √(mΓ) ≤ 2π f, and stable",
    "margins": "exact for the stated A(s), linear",
}
"""What is a bound and what is an estimate."""


def certificate_record(certificate: Certificate, controller: str, framework: str) -> dict[str, Any]:
    """The certificate for a file or for `--json`; None stands for what is not finite."""
    subject = certificate.subject
    vehicle, dynamics, air = subject.vehicle, subject.dynamics, subject.air
    return {
        "controller": controller,
        "framework": framework,
        "vehicle": vehicle.name,
        "holds": certificate.holds,
        "failures": [
            {"axis": axis.axis, "condition": condition.name, "reason": condition.reason}
            for axis in certificate.axes
            for condition in axis.conditions
            if not condition.holds
        ],
        "rate_hz": 1.0 / subject.sample_s,
        "period_s": certificate.period_s,
        "assumptions": {
            "dynamics": dynamics.model_dump(mode="json"),
            "speed_limit_m_s": vehicle.speed_limit_m_s,
            "acceleration_limit_m_s2": vehicle.acceleration_limit_m_s2,
            "tilt_limit_deg": vehicle.tilt_limit_deg,
            "climb_limit_m_s": vehicle.climb_limit_m_s,
            "descent_limit_m_s": vehicle.descent_limit_m_s,
            "wind_m_s": air.wind_m_s,
            "wind_change_m_s2": air.wind_change_m_s2,
        },
        "kinds": KINDS,
        "axes": [_axis(axis) for axis in certificate.axes],
    }


def _axis(axis: AxisCertificate) -> dict[str, Any]:
    loop, bounds, sigma = axis.loop, axis.bounds, axis.bounds.sigma
    g = axis.norm_g
    return {
        "axis": axis.axis,
        "holds": axis.holds,
        "gains": {
            "reference_model": [list(loop.model.numerator), list(loop.model.denominator)],
            "low_pass": [list(loop.low_pass.numerator), list(loop.low_pass.denominator)],
            "k": loop.gain_k,
            "gamma": loop.gamma,
        },
        "plant": {
            "numerator": list(loop.plant.rational.numerator),
            "denominator": list(loop.plant.rational.denominator),
            "delay_s": loop.plant.delay_s,
        },
        "conditions": [
            {
                "name": condition.name,
                "holds": condition.holds,
                "found": condition.found,
                "reason": condition.reason,
                "caution": condition.caution,
            }
            for condition in axis.conditions
        ],
        "poles_of_h_1_s": [[pole.real, pole.imag] for pole in axis.poles.tolist()],
        "norm_g": _norm(g),
        "norm_ch_over_m": _norm(axis.norm_ch_over_m),
        "norm_behind_attitude": _norm(axis.norm_behind),
        "lipschitz": sigma.lipschitz,
        "largest_lipschitz": None if g is None else 1.0 / (g.value + g.uncertainty),
        "sigma": sigma.sigma,
        "planned_sigma": sigma.planned_sigma,
        "sigma_rate": sigma.sigma_rate,
        "r1_m_s": sigma.r1_m_s,
        "delta": bounds.delta,
        "gamma_0_m_s": bounds.gamma_0_m_s,
        "gamma_1_m_s": bounds.gamma_1_m_s,
        "margins": _margins(axis),
        "adaptation_radius": axis.adaptation_radius,
        "inner_radius": axis.inner_radius,
        "whole_radius": axis.whole_radius,
        "slowest_pole_1_s": [axis.slowest.real, axis.slowest.imag],
        "noise": {
            "y_tilde_per_velocity": _finite(axis.noise_to_y_tilde),
            "u_per_velocity_s_m": _finite(axis.noise_to_u),
        },
        "gamma_range": {
            "low": _finite(axis.gamma_low),
            "high": _finite(axis.gamma_high),
            "high_reason": axis.gamma_high_reason,
            "safe_high": _finite(axis.gamma_safe),
        },
    }


def _margins(axis: AxisCertificate) -> dict[str, Any]:
    continuous = axis.margins
    record: dict[str, Any] = {"continuous": None}
    if continuous is not None:
        record["continuous"] = {
            "gain_up": _finite(continuous.gain_up),
            "gain_down": continuous.gain_down,
            "phase_deg": _finite(math.degrees(continuous.phase_rad)),
            "delay_s": _finite(continuous.delay_s),
            "crossover_rad_s": continuous.crossover_rad_s,
            "nearest": continuous.nearest,
        }
    for name, values in (("inner", axis.inner_margins), ("whole", axis.whole_margins)):
        up, down, delay_s = (_finite(value) for value in values)
        record[name] = {"gain_up": up, "gain_down": down, "delay_s": delay_s}
    return record


def _norm(norm: L1Norm | None) -> dict[str, float] | None:
    return None if norm is None else {"value": norm.value, "uncertainty": norm.uncertainty}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
