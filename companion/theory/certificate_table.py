"""A certificate as a table in the terminal."""

import math
from collections.abc import Callable

from rich.console import Console
from rich.table import Table
from rich.text import Text

from companion.theory.certificate import AxisCertificate, Certificate
from companion.theory.condition_table import conditions_table, print_verdict
from companion.theory.norms import L1Norm

_Row = tuple[str, Callable[[AxisCertificate], str], str]
_UPPER = {
    "whole loop": "unstable above",
    "euler": "Euler: Γ dt < 1",
    "nyquist": "mode at Nyquist",
}


def print_certificate(console: Console, certificate: Certificate, title: str) -> None:
    """Print the conditions, the figures, and in words what fails.

    Args:
        console: where to.
        certificate: what is told.
        title: the controller and the vehicle.
    """
    console.print(Text(title, style="bold"))
    console.print(conditions_table(certificate.axes))
    console.print()
    console.print(_figures(certificate))
    console.print()
    print_verdict(console, certificate.axes)


def _figures(certificate: Certificate) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("figure", no_wrap=True)
    for axis in certificate.axes:
        table.add_column(axis.axis, justify="right", no_wrap=True)
    table.add_column("is", style="dim", overflow="fold")
    for name, show, kind in _rows(certificate):
        table.add_row(name, *(show(axis) for axis in certificate.axes), kind)
    return table


def _rows(certificate: Certificate) -> list[_Row]:
    rate = f"{1.0 / certificate.subject.sample_s:g} Hz"
    known = [axis for axis in certificate.axes if not math.isnan(axis.gamma_high)]
    ends = {_UPPER[axis.gamma_high_reason] for axis in known}
    return [
        ("‖G‖", lambda a: _norm(a.norm_g), "value"),
        ("L that it admits", lambda a: _inverse(a.norm_g), "value"),
        ("L of the drag", lambda a: f"{a.bounds.sigma.lipschitz:.3g}", "bound"),
        ("‖G‖, drag behind tilt", lambda a: _norm(a.norm_behind), "value"),
        ("‖C H / M‖", lambda a: _norm(a.norm_ch_over_m), "value"),
        ("Δ", lambda a: f"{a.bounds.delta:.3g}", "given"),
        ("Δ_d, 1/s", lambda a: f"{a.bounds.sigma.sigma_rate:.3g}", "estimate"),
        ("γ0, m/s", lambda a: _or_none(a.bounds.gamma_0_m_s), "bound, for Δ, Δ_d"),
        ("γ1, m/s", lambda a: _or_none(a.bounds.gamma_1_m_s), "bound, for Δ, Δ_d"),
        ("gain margin, L1 and K", _continuous_gain, "continuous"),
        ("phase margin", _phase, "continuous"),
        ("delay margin, ms", _continuous_delay, "continuous"),
        ("gain margin, L1 and K", lambda a: _gains(a.inner_margins), rate),
        ("delay margin, ms", lambda a: _delay(a.inner_margins), rate),
        ("gain margin, whole loop", lambda a: _gains(a.whole_margins), rate),
        ("delay margin, ms", lambda a: _delay(a.whole_margins), rate),
        (
            "spectral radius",
            lambda a: f"{a.whole_radius:.4f}",
            f"per {certificate.period_s * 1e3:g} ms",
        ),
        ("noise of ỹ", lambda a: _times(a.noise_to_y_tilde), "of the velocity's"),
        ("noise of u, per m/s", lambda a: _general(a.noise_to_u), "of the velocity's"),
        ("Γ, 1/s²", lambda a: f"{a.loop.gamma:g}", "given"),
        ("least stable Γ", _low, "unstable below"),
        ("largest safe Γ", _safe, "10 √(mΓ) ≤ 2π f, and stable"),
        ("largest stable Γ", lambda a: _general(a.gamma_high), "; ".join(sorted(ends))),
    ]


def _norm(norm: L1Norm | None) -> str:
    return "–" if norm is None else f"{norm.value:.3f}"


def _inverse(norm: L1Norm | None) -> str:
    return "–" if norm is None else f"{1.0 / (norm.value + norm.uncertainty):.3g}"


def _or_none(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def _general(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3g}"


def _times(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.2f} ×"


def _low(axis: AxisCertificate) -> str:
    return "none" if axis.gamma_low == 0.0 else _general(axis.gamma_low)


def _safe(axis: AxisCertificate) -> str:
    return "none" if axis.gamma_safe <= axis.gamma_low else _general(axis.gamma_safe)


def _continuous_gain(axis: AxisCertificate) -> str:
    if axis.margins is None:
        return "–"
    return _gains((axis.margins.gain_up, axis.margins.gain_down, 0.0))


def _continuous_delay(axis: AxisCertificate) -> str:
    return "–" if axis.margins is None else _delay((0.0, 0.0, axis.margins.delay_s))


def _phase(axis: AxisCertificate) -> str:
    return "–" if axis.margins is None else f"{math.degrees(axis.margins.phase_rad):.1f}°"


def _gains(margins: tuple[float, float, float]) -> str:
    up, down, _ = margins
    if math.isnan(up):
        return "–"
    return f"{down:.2f} … {'∞' if math.isinf(up) else f'{up:.2f}'}"


def _delay(margins: tuple[float, float, float]) -> str:
    delay_s = margins[2]
    if math.isnan(delay_s):
        return "–"
    return "∞" if math.isinf(delay_s) else f"{delay_s * 1e3:.0f}"
