"""MPC-L1+'s certificate as one JSON object."""

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from companion.theory.plus_certificate import (
    GUST_S,
    MemberResult,
    PlusAxisCertificate,
    PlusCertificate,
    Response,
)

KINDS = {
    "conditions": "decided on the law as implemented, linear about a hover, without what is learnt "
    "in flight, around the stated dynamics with the exact dead time",
    "margins": "exact for the stated dynamics, linear; of the sampled loop at the vehicle's input",
    "velocity_gain_s": "L1 norm at the samples, of disturbances held over a sample",
    "lipschitz_1_s": "bound, for the stated speeds, wind and quadratic drag",
    "sigma": "bounds of the model; rate_m_s3 takes all the worst at once",
    "y_tilde_deviation_m_s": "standard deviation by the predictor's covariance, for the stated "
    "noise and the assumed walk of the disturbance; not a bound",
    "y_tilde_bound_m_s": "bound at the samples without noise, while |σ'| stays within "
    "sigma.rate_m_s3, σ̂ off its projection's bound and the acceleration by tilt and thrust true",
    "response": "per m/s² of acceleration that nothing announces; gust_m: rms for gusts of that "
    f"rms with a correlation time of {GUST_S:g} s",
    "noise": "standard deviations by the stated noise, all of it white; body rates taken as exact",
}
"""What is a bound and what is an estimate."""


def plus_record(certificate: PlusCertificate, controller: str, framework: str) -> dict[str, Any]:
    """The certificate for a file or for `--json`; None stands for what is not finite."""
    subject = certificate.subject
    vehicle, air = subject.vehicle, subject.air
    settings = subject.stack.settings
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
        "assumptions": {
            "dynamics": subject.dynamics.model_dump(mode="json"),
            "noise": asdict(settings.noise) | {"tilt_rad": subject.tilt_noise_rad},
            "speed_limit_m_s": vehicle.speed_limit_m_s,
            "tilt_limit_deg": vehicle.tilt_limit_deg,
            "climb_limit_m_s": vehicle.climb_limit_m_s,
            "descent_limit_m_s": vehicle.descent_limit_m_s,
            "wind_m_s": air.wind_m_s,
            "wind_change_m_s2": air.wind_change_m_s2,
        },
        "kinds": KINDS,
        "axes": [_axis(axis) for axis in certificate.axes],
    }


def _axis(axis: PlusAxisCertificate) -> dict[str, Any]:
    slowest = axis.loop.slowest_1_s
    return {
        "axis": axis.axis,
        "holds": axis.holds,
        "plant": asdict(axis.plant),
        "conditions": [asdict(condition) for condition in axis.conditions],
        "radius": axis.loop.radius,
        "slowest_pole_1_s": [slowest.real, slowest.imag],
        "predictor_radius": axis.predictor_radius,
        "unadapted_radius": axis.unadapted_radius,
        "cautious": {
            "radius": axis.cautious_radius,
            "worst": axis.cautious_worst[0],
            "worst_radius": axis.cautious_worst[1],
        },
        "margins": {
            "gain_up": _finite(axis.margins.gain_up),
            "gain_down": _finite(axis.margins.gain_down),
            "delay_s": _finite(axis.margins.delay_s),
            "phase_deg": _finite(math.degrees(axis.margins.phase_rad)),
            "modulus": _finite(axis.margins.modulus),
            "modulus_rad_s": _finite(axis.margins.modulus_rad_s),
            "crossover_rad_s": _finite(axis.margins.crossover_rad_s),
        },
        "velocity_gain_s": _finite(axis.velocity_gain_s),
        "lipschitz_1_s": axis.sigma.lipschitz_1_s,
        "sigma": {
            "planned_m_s2": axis.sigma.planned_m_s2,
            "worst_m_s2": axis.sigma.worst_m_s2,
            "rate_m_s3": axis.sigma.rate_m_s3,
            "bound_m_s2": axis.sigma_bound_m_s2,
        },
        "y_tilde_deviation_m_s": axis.y_tilde_deviation_m_s,
        "y_tilde_bound_m_s": _finite(axis.y_tilde_gain_s2 * axis.sigma.rate_m_s3),
        "response": _response(axis.response),
        "response_without_adaptation": _response(axis.unadapted),
        "noise": {"u": _finite(axis.noise_of_u), "slew_1_s": _finite(axis.noise_of_slew)},
        "family": [_member(result) for result in axis.members],
    }


def _response(response: Response) -> dict[str, float | None]:
    return {
        "step_peak_m": float(np.abs(response.step_m).max()),
        "rest_m": _finite(response.rest_m),
        "gust_m": _finite(response.gust_m),
        "peak_gain_m": _finite(response.peak_gain_m),
    }


def _member(result: MemberResult) -> dict[str, Any]:
    return {
        "name": result.member.name,
        "hard": result.member.hard,
        "stable": result.radius < 1.0,
        "radius": result.radius,
        "slowest_pole_1_s": [result.slowest_1_s.real, result.slowest_1_s.imag],
        "modulus": _finite(result.modulus),
        "gust_m": _finite(result.gust_m),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
