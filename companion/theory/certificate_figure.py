"""The picture of a certificate: `certificate.png`."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from companion.control.inner import L1Controller
from companion.control.reference_model import Array
from companion.theory.adaptation_rate import with_gamma
from companion.theory.certificate import AxisCertificate, Certificate, inner_loop, whole_loop
from companion.theory.plant import imaginary
from companion.theory.sampled_data import SampledLoop, period_map

_COLOURS = {"x": "#1f4e79", "z": "#27ae60"}
_TROUBLE = "#c0392b"
_SHOWN = (0, 2)
"""x and z; y has x's plant, and in most controllers its gains."""

Axes = Any
"""matplotlib's; it is imported only when something is drawn."""


def draw_certificate(certificate: Certificate, title: str, path: Path) -> None:
    """Draw Nyquist curve, loop gain, impulse responses and spectral radius against Γ, for x and z.

    Raises:
        OSError: the file can't be written.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.5, 9.0))
    verdict = "certified" if certificate.holds else "not certified"
    figure.suptitle(f"{title}: {verdict}", fontsize=13, x=0.06, y=0.985, ha="left")
    grid = figure.add_gridspec(
        2, 2, left=0.06, right=0.98, bottom=0.065, top=0.915, hspace=0.26, wspace=0.17
    )
    panels = [figure.add_subplot(grid[k // 2, k % 2]) for k in range(4)]
    axes = [certificate.axes[k] for k in _SHOWN]
    _draw_nyquist(panels[0], axes)
    _draw_gain(panels[1], axes)
    _draw_responses(panels[2], axes)
    _draw_radii(panels[3], certificate)
    for panel in panels:
        panel.grid(alpha=0.3, which="both", lw=0.5)
        panel.tick_params(labelsize=8)
        panel.legend(fontsize=8, framealpha=0.85, edgecolor="none")
    figure.savefig(path, dpi=110)


def _draw_nyquist(panel: Axes, axes: list[AxisCertificate]) -> None:
    omega: Array = np.geomspace(0.05, 500.0, 20_000)
    for axis in axes:
        curve = axis.loop.broken_at_u(imaginary(omega))
        margins = axis.margins
        label = f"{axis.axis}: unstable" if margins is None else (
            f"{axis.axis}: nearest to -1 by {margins.nearest:.2f}, "
            f"phase margin {np.degrees(margins.phase_rad):.0f}°"
        )  # fmt: skip
        panel.plot(curve.real, curve.imag, color=_COLOURS[axis.axis], lw=1.4, label=label)
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    panel.plot(np.cos(turn), np.sin(turn), color="#808b96", lw=0.7, ls=":")
    panel.plot([-1.0], [0.0], marker="+", ms=11, mew=1.8, color=_TROUBLE, ls="none")
    panel.set(xlim=(-3.9, 2.1), ylim=(-2.2, 2.2), xlabel="Re L(jω)", ylabel="Im L(jω)")
    panel.set_aspect("equal", adjustable="box")
    panel.set_title(
        "Nyquist curve of the L1 controller with its position loop, broken at u",
        fontsize=9, loc="left",
    )  # fmt: skip


def _draw_gain(panel: Axes, axes: list[AxisCertificate]) -> None:
    omega: Array = np.geomspace(0.1, 300.0, 4000)
    s = imaginary(omega)
    for axis in axes:
        colour, loop = _COLOURS[axis.axis], axis.loop
        for values, style, name in (
            (loop.broken_at_u(s), "-", "|L|"),
            (loop.ch_over_m(s), "--", "|C H / M|"),
            (loop.g(s), ":", "|G|"),
        ):
            panel.loglog(
                omega, np.abs(values), style, color=colour, lw=1.3, label=f"{axis.axis}: {name}"
            )
    panel.axhline(1.0, color="#808b96", lw=0.7)
    panel.set(ylim=(1e-3, 1e2), xlabel="ω, rad/s")
    panel.set_title("Magnitudes", fontsize=9, loc="left")


def _draw_responses(panel: Axes, axes: list[AxisCertificate]) -> None:
    longest = 0.0
    for axis in axes:
        for norm, style, name in (
            (axis.norm_g, "-", "g"),
            (axis.norm_ch_over_m, "--", "of C H / M"),
        ):
            if norm is None:
                continue
            label = f"{axis.axis}: {name}, ∫|·| = {norm.value:.3f}"
            colour = _COLOURS[axis.axis]
            panel.plot(norm.times_s, norm.response, style, color=colour, lw=1.3, label=label)
            above = np.flatnonzero(np.abs(norm.response) > 2e-3 * np.abs(norm.response).max())
            longest = max(longest, float(norm.times_s[above[-1]]))
    if longest == 0.0:
        panel.plot([], [], label="no norms: see ‖G‖ L < 1")
    panel.set(xlim=(0.0, max(1.0, longest)), xlabel="time, s")
    panel.set_title("Impulse responses and their L1 norms", fontsize=9, loc="left")


def _draw_radii(panel: Axes, certificate: Certificate) -> None:
    gains = certificate.subject.gains
    chosen = np.array(gains.gamma)
    multiples: Array = np.geomspace(1e-2, 1e3, 50)
    for loop, style, name in (
        (whole_loop(certificate.subject), "-", "with the outer loop"),
        (inner_loop(certificate.subject), "--", "L1 and K"),
    ):
        decays = np.array([_decays(loop, chosen * multiple) for multiple in multiples])
        for k in _SHOWN:
            axis = certificate.axes[k]
            panel.semilogx(
                multiples * chosen[k], decays[:, k], style,
                color=_COLOURS[axis.axis], lw=1.4, label=f"{axis.axis}: {name}",
            )  # fmt: skip
    for k in _SHOWN:
        panel.axvline(chosen[k], color=_COLOURS[certificate.axes[k].axis], lw=0.8, ls=":")
    panel.axhline(1.0, color=_TROUBLE, lw=1.0)
    low, high = panel.get_ylim()
    panel.set(ylim=(max(low, 0.9), min(high, 1.08)), xlabel="Γ, 1/s²")
    rate = 1.0 / certificate.subject.sample_s
    panel.set_title(
        f"Spectral radius of the sampled loop, per sample of {rate:g} Hz "
        "(dotted: the chosen Γ)", fontsize=9, loc="left",
    )  # fmt: skip


def _decays(loop: SampledLoop, gamma: Array) -> Array:
    """(axes,) spectral radii for adaptation rates, per sample."""
    assert isinstance(loop.inner, L1Controller)
    other = L1Controller(with_gamma(loop.inner.gains, gamma))
    result = period_map(replace(loop, inner=other))
    radii: Array = result.radii ** (loop.sample_s / result.period_s)
    return radii
