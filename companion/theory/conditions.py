"""The conditions of a certificate, each with what was found and, where it fails, why."""

import math
from dataclasses import dataclass
from typing import Literal

from companion.control.transfer_function import TransferFunction
from companion.theory.adaptation_rate import UpperReason


@dataclass(frozen=True, slots=True)
class Condition:
    """One condition on one axis."""

    name: str
    holds: bool
    found: str
    """The figures that decide."""
    reason: str = ""
    """Why it fails, and what would help; empty while it holds."""
    caution: str = ""
    """What to keep in mind although it holds."""


@dataclass(frozen=True, slots=True)
class Findings:
    """What the conditions of an axis are decided by."""

    model: TransferFunction
    low_pass: TransferFunction
    h_stable: bool
    slowest_pole: complex
    norm_g: float | None
    """Upper end of its numerical uncertainty."""
    lipschitz: float
    sigma: float
    planned_sigma: float
    delta: float
    projection_margin: float
    continuous_stable: bool
    discretisation: Literal["exact", "euler"]
    sample_s: float
    gamma: float
    adaptation_radius: float
    inner_radius: float
    inner_pole: complex
    whole_radius: float
    whole_pole: complex
    gamma_low: float
    gamma_high: float
    gamma_high_reason: UpperReason
    gamma_safe: float
    gamma_limit: float
    """Where the adaptation mode reaches half the sampling frequency."""
    noise_to_y_tilde: float
    noise_to_u: float


def conditions(f: Findings) -> tuple[Condition, ...]:
    """All of them, in the order of the table."""
    return (
        _model(f),
        _low_pass(f),
        _h(f),
        _norm(f),
        _projection(f),
        _adaptation(f),
        _continuous(f),
        _sampled("sampled L1 and K loop", f.inner_radius, f.inner_pole, f),
        _sampled("sampled, with outer loop", f.whole_radius, f.whole_pole, f),
        _gamma(f),
    )


def _model(f: Findings) -> Condition:
    name = "M strictly positive real"
    if f.model.strictly_positive_real:
        return Condition(name, True, "M stable, of relative degree 1, Re M(jω) > 0")
    return Condition(
        name, False, f"M(s) = {f.model}", "the adaptation law needs a Lyapunov function of M(s)"
    )


def _low_pass(f: Findings) -> Condition:
    c = f.low_pass
    holds = c.stable and math.isclose(c.dc_gain, 1.0)
    found = f"C(0) = {c.dc_gain:.4g}, relative degree {c.order - len(c.numerator) + 1}"
    reason = "" if holds else "C(s) must be stable and strictly proper with C(0) = 1"
    return Condition("C(0) = 1, strictly proper, stable", holds, found, reason)


def _h(f: Findings) -> Condition:
    pole = _pole(f.slowest_pole)
    if f.h_stable:
        return Condition("H(s) stable", True, f"slowest pole {pole} 1/s")
    return Condition(
        "H(s) stable", False, f"pole at {pole} 1/s",
        "C(s) asks more of A(s) than its lag and delay allow (as Γ → ∞ the L1 controller is an "
        "I-P velocity loop of gains ω and ω/m): lower ω, or raise m",
    )  # fmt: skip


def _norm(f: Findings) -> Condition:
    name = "‖G‖ L < 1"
    if f.norm_g is None:
        reason = "H(s) is not stable, so that ‖G‖ is infinite"
        if f.h_stable:
            reason = (
                "H(s) is stable with the exact delay but not with its Padé approximation (pole at "
                f"{_pole(f.slowest_pole)} 1/s), and without a decay rate ‖G‖ can't be reckoned: "
                "lower ω, or raise m"
            )
        return Condition(name, False, "no ‖G‖", reason)
    product = f.norm_g * f.lipschitz
    found = f"{f.norm_g:.3g} · {f.lipschitz:.3g} = {product:.3g}; L up to {1.0 / f.norm_g:.3g}"
    if product < 1.0:
        return Condition(name, True, found)
    return Condition(
        name, False, found,
        "the quadratic drag changes faster with speed than the loop can bear: raise ω, or fly "
        "slower or in less wind",
    )  # fmt: skip


def _projection(f: Findings) -> Condition:
    name = "projection leaves σ free"
    share = math.sqrt(1.0 + f.projection_margin)
    free = f.delta / share
    found = f"|σ| ≤ {f.planned_sigma:.3g} as planned, {f.sigma:.3g} at worst; free to {free:.3g}"
    if f.planned_sigma > free:
        return Condition(
            name, False, found,
            "the projection acts on what the vehicle's own limits of speed and acceleration need "
            f"in still air: raise sigma_bound to {f.planned_sigma * share:.3g} or more",
        )  # fmt: skip
    caution = ""
    if f.sigma > free:
        caution = (
            "at full tilt in the worst wind the projection may act, and then γ0 and γ1 do not "
            f"hold; a sigma_bound of {f.sigma * share:.3g} covers all"
        )
    return Condition(name, True, found, caution=caution)


def _adaptation(f: Findings) -> Condition:
    product = f.gamma * f.sample_s
    found = f"radius {f.adaptation_radius:.4f}; {f.discretisation}, Γ dt = {product:.3g}"
    name = "discrete adaptation law stable"
    if f.adaptation_radius < 1.0:
        return Condition(name, True, found)
    reason = f"explicit Euler is stable only for Γ dt < 1, that is Γ < {1.0 / f.sample_s:.4g}"
    if f.discretisation != "euler":
        reason = "predictor and adaptation law are unstable by themselves"
        if f.gamma > f.gamma_limit:
            turn = math.pi * math.sqrt(f.gamma / f.gamma_limit)
            reason = (
                f"the adaptation mode √(mΓ) turns by {turn:.2g} rad within a sample, at which the "
                "step's matrix exponential has no precision left"
            )
    return Condition(name, False, found, reason)


def _continuous(f: Findings) -> Condition:
    name = "L1 and K loop, continuous time"
    if f.continuous_stable:
        return Condition(name, True, "Nyquist's count with the exact delay: no unstable pole")
    return Condition(
        name, False, "Nyquist's count with the exact delay: unstable poles",
        f"with Γ = {f.gamma:g} predictor, adaptation law, C(s) and K do not stabilise A(s)",
    )  # fmt: skip


def _sampled(name: str, radius: float, pole: complex, f: Findings) -> Condition:
    found = f"spectral radius {radius:.4f}"
    if radius < 1.0:
        return Condition(name, True, found)
    if f.adaptation_radius >= 1.0:
        return Condition(name, False, found, "the adaptation law in it is unstable by itself")
    oscillates = f"at {abs(pole.imag):.1f} rad/s" if pole.imag else "monotonously"
    return Condition(
        name, False, found,
        f"the law as it is flown, at {1.0 / f.sample_s:g} Hz, does not stabilise the plant with "
        f"its delay; deviations grow {oscillates}",
    )  # fmt: skip


def _gamma(f: Findings) -> Condition:
    name = "Γ in the stable range"
    rate = f"at {1.0 / f.sample_s:g} Hz"
    if math.isnan(f.gamma_low):
        limit = f.gamma_limit
        if f.discretisation == "euler":
            limit = min(limit, 1.0 / f.sample_s)
        start = min(f.gamma, limit)
        end = min(250.0 * start, limit)
        reason = f"no Γ from {start / 250.0:.2g} to {end:.2g} is stable {rate}"
        return Condition(name, False, f"Γ = {f.gamma:g}, no range", reason)
    low = f"{f.gamma_low:.3g} < " if f.gamma_low > 0.0 else ""
    stable = f"stable: {low}Γ < {f.gamma_high:.3g}"
    if f.gamma_safe >= f.gamma_high:
        found = f"Γ = {f.gamma:g}; {stable}, all of it well sampled"
    elif f.gamma_safe > f.gamma_low:
        found = f"Γ = {f.gamma:g}; {stable}, safe to {f.gamma_safe:.3g}"
    else:
        found = f"Γ = {f.gamma:g}; {stable}, none of it safe"
    if f.gamma_low < f.gamma < f.gamma_high:
        return Condition(name, True, found, caution=_beyond_safe(f))
    if f.gamma <= f.gamma_low:
        reason = (
            f"with Γ below {f.gamma_low:.3g} the estimate lags behind what the loop needs, and "
            f"the loop is unstable {rate}"
        )
    else:
        reason = {
            "euler": f"explicit Euler {rate} is stable only for Γ < {1.0 / f.sample_s:.4g}",
            "nyquist": "the adaptation mode √(mΓ) lies above half the sampling frequency: samples "
            "do not hold it",
            "whole loop": f"with Γ above {f.gamma_high:.3g} the loop is unstable {rate}",
        }[f.gamma_high_reason]
    return Condition(name, False, found, reason)


def _beyond_safe(f: Findings) -> str:
    if f.gamma <= f.gamma_safe:
        return ""
    return (
        f"stable but not safe: beyond Γ = {f.gamma_safe:.3g} the mode √(mΓ) is faster than a tenth "
        "of the sampling frequency (in rad/s), and it amplifies noise: that of the velocity comes "
        f"{f.noise_to_y_tilde:.3g} × to ỹ, and to u as {f.noise_to_u:.3g} per m/s; lower Γ, or "
        "sample faster"
    )


def _pole(pole: complex) -> str:
    return f"{pole.real:.3g}" + (f" ± {abs(pole.imag):.3g}j" if abs(pole.imag) > 1e-9 else "")
