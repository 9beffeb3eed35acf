"""MPC-L1+'s certificate as a table in the terminal."""

import math
from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2
from companion.theory.condition_table import conditions_table, print_verdict
from companion.theory.plus_certificate import (
    MemberResult,
    PlusAxisCertificate,
    PlusCertificate,
)

_Row = tuple[str, Callable[[PlusAxisCertificate], str], str]


def print_plus_certificate(console: Console, certificate: PlusCertificate, title: str) -> None:
    """Print the conditions, the figures, and in words what fails.

    Args:
        console: where to.
        certificate: what is told.
        title: the controller and the vehicle.
    """
    console.print(Text(title, style="bold"))
    console.print(conditions_table(certificate.axes))
    console.print()
    console.print(_family(certificate))
    console.print()
    console.print(_figures(certificate))
    console.print()
    print_verdict(console, certificate.axes)
    console.print("What is learnt in flight (lag, drag, gain, heading) is not in it.", style="dim")


def _family(certificate: PlusCertificate) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("modulus margin with", no_wrap=True)
    for axis in certificate.axes:
        table.add_column(axis.axis, justify="right", no_wrap=True)
    table.add_column("", style="dim", overflow="fold")
    nominal = [_number(axis.margins.modulus, 2) for axis in certificate.axes]
    table.add_row("the vehicle as identified", *nominal)
    for k, result in enumerate(certificate.axes[0].members):
        cells = [_distance(axis.members[k]) for axis in certificate.axes]
        note = "a caution if unstable" if result.member.hard else "must be stable"
        table.add_row(result.member.name, *cells, note)
    return table


def _distance(result: MemberResult) -> Text:
    if result.radius < 1.0:
        return Text(f"{result.modulus:.2f}")
    return Text("unstable", style="yellow" if result.member.hard else "bold red")


def _figures(certificate: PlusCertificate) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("figure", no_wrap=True)
    for axis in certificate.axes:
        table.add_column(axis.axis, justify="right", no_wrap=True)
    table.add_column("is", style="dim", overflow="fold")
    for name, show, kind in _rows(certificate):
        table.add_row(name, *(show(axis) for axis in certificate.axes), kind)
    return table


def _rows(certificate: PlusCertificate) -> list[_Row]:
    rate = f"{1.0 / certificate.subject.sample_s:g} Hz"
    return [
        ("u is", lambda a: a.interface.replace("_", " "), "given"),
        ("gain margin", _gains, f"at the vehicle's input, {rate}"),
        ("phase margin", lambda a: _degrees(a.margins.phase_rad), "the same"),
        ("delay margin, ms", lambda a: _ms(a.margins.delay_s), "of delay that is not told"),
        ("modulus margin", lambda a: _number(a.margins.modulus, 2), "min |1 + L|"),
        ("crossover, rad/s", lambda a: _number(a.margins.crossover_rad_s, 1), "last |L| = 1"),
        ("‖G‖, s", lambda a: _general(a.velocity_gain_s), "value: m/s per m/s²"),
        ("L of the drag, 1/s", lambda a: _general(a.sigma.lipschitz_1_s), "bound"),
        ("position per m/s²:", lambda a: "", ""),
        ("  after a step, mm", lambda a: _mm(_peak(a.response.step_m)), "peak"),
        ("    σ̂ held", lambda a: _mm(_peak(a.unadapted.step_m)), "peak"),
        ("  what stays, mm", lambda a: _mm(abs(a.response.rest_m)), "value"),
        ("    σ̂ held", lambda a: _mm(abs(a.unadapted.rest_m)), "value"),
        ("  in gusts, mm", lambda a: _mm(a.response.gust_m), "rms, forgotten in 1 s"),
        ("    σ̂ held", lambda a: _mm(a.unadapted.gust_m), "the same"),
        ("  at worst, mm", lambda a: _mm(a.response.peak_gain_m), "L1 norm"),
        ("noise of u", lambda a: _general(a.noise_of_u), "rms by the stated noise, in u's unit"),
        ("slew of the tilt, g/s", _slew, "rms of the command's, by the stated noise"),
        ("ỹ, m/s", lambda a: _general(a.y_tilde_deviation_m_s), "σ, by the covariance"),
        ("|ỹ| without noise, m/s", _of_sigma_rate, "bound, for Δ_d"),
        ("Δ_d, m/s³", lambda a: _general(a.sigma.rate_m_s3), "estimate of a bound"),
        ("spectral radius", lambda a: f"{a.loop.radius:.4f}", "per sample"),
    ]


def _slew(axis: PlusAxisCertificate) -> str:
    return "–" if axis.axis == "z" else _general(axis.noise_of_slew / GRAVITY_M_S2)


def _of_sigma_rate(axis: PlusAxisCertificate) -> str:
    return _general(axis.y_tilde_gain_s2 * axis.sigma.rate_m_s3)


def _peak(step_m: Array) -> float:
    return float(np.abs(step_m).max())


def _gains(axis: PlusAxisCertificate) -> str:
    m = axis.margins
    if math.isnan(m.gain_up):
        return "–"
    return f"{m.gain_down:.2f} … {'∞' if math.isinf(m.gain_up) else f'{m.gain_up:.2f}'}"


def _degrees(value: float) -> str:
    return "–" if math.isnan(value) else f"{math.degrees(value):.1f}°"


def _ms(seconds: float) -> str:
    if math.isnan(seconds):
        return "–"
    return "∞" if math.isinf(seconds) else f"{seconds * 1e3:.0f}"


def _mm(metres: float) -> str:
    return "–" if not math.isfinite(metres) else f"{metres * 1e3:.1f}"


def _number(value: float, digits: int) -> str:
    return "–" if math.isnan(value) else f"{value:.{digits}f}"


def _general(value: float) -> str:
    return "–" if not math.isfinite(value) else f"{value:.3g}"
