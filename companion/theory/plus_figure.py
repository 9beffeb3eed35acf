"""The picture of MPC-L1+'s certificate: `certificate.png`."""

from pathlib import Path
from typing import Any

import numpy as np

from companion.theory.plant import ComplexArray
from companion.theory.plus_certificate import SHOWN_S, PlusCertificate
from companion.theory.plus_figures import frequencies, slow_and_late
from companion.theory.plus_law import PlusLaw
from companion.theory.plus_loop import broken_at_u, law_response

_COLOURS = {"x": "#1f4e79", "z": "#27ae60"}
_GREY, _TROUBLE = "#808b96", "#c0392b"
_SHOWN = (0, 2)
"""x and z; y has x's plant, and in most controllers its gains."""
_FACTORS = np.linspace(0.5, 2.2, 24)
_DELAYS_S = np.linspace(0.0, 0.1, 24)
_FAMILY_AT = (
    ("slow + 25 %", 1.25, 0.0), ("slow + 50 %", 1.5, 0.0), ("+ 20 ms", 1.0, 0.02),
    ("+ 40 ms", 1.0, 0.04), ("slow + 25 %, + 20 ms", 1.25, 0.02),
)  # fmt: skip

Axes = Any
"""matplotlib's; it is imported only when something is drawn."""


def draw_plus_certificate(certificate: PlusCertificate, title: str, path: Path) -> None:
    """Draw Nyquist curve, sensitivity, response to a disturbance, and where the loop is stable.

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
    _draw_nyquist(panels[0], certificate)
    _draw_gains(panels[1], certificate)
    _draw_responses(panels[2], certificate)
    _draw_family(panels[3], certificate)
    for panel in panels:
        panel.grid(alpha=0.3, which="both", lw=0.5)
        panel.tick_params(labelsize=8)
        panel.legend(fontsize=8, framealpha=0.85, edgecolor="none")
    figure.savefig(path, dpi=110)


def _draw_nyquist(panel: Axes, certificate: PlusCertificate) -> None:
    for k in _SHOWN:
        axis = certificate.axes[k]
        curve = _loop(certificate, certificate.law, k)
        margins = axis.margins
        label = f"{axis.axis}: unstable"
        if not np.isnan(margins.modulus):
            label = (
                f"{axis.axis}: modulus margin {margins.modulus:.2f}, "
                f"phase margin {np.degrees(margins.phase_rad):.0f}°"
            )
        panel.plot(curve.real, curve.imag, color=_COLOURS[axis.axis], lw=1.4, label=label)
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    panel.plot(np.cos(turn), np.sin(turn), color=_GREY, lw=0.7, ls=":")
    panel.plot(
        -1.0 + 0.5 * np.cos(turn), 0.5 * np.sin(turn), color=_TROUBLE, lw=0.8, ls="--",
        label="sensitivity 2",
    )  # fmt: skip
    panel.plot([-1.0], [0.0], marker="+", ms=11, mew=1.8, color=_TROUBLE, ls="none")
    panel.set(xlim=(-3.9, 2.1), ylim=(-2.2, 2.2), xlabel="Re L(jω)", ylabel="Im L(jω)")
    panel.set_aspect("equal", adjustable="box")
    panel.set_title("Nyquist curve at the vehicle's input", fontsize=9, loc="left")


def _draw_gains(panel: Axes, certificate: PlusCertificate) -> None:
    omega = frequencies(certificate.subject.sample_s)
    for k in _SHOWN:
        axis = certificate.axes[k]
        loop = _loop(certificate, certificate.law, k)
        held = _loop(certificate, certificate.unadapted, k)
        colour = _COLOURS[axis.axis]
        for values, style, name in (
            (1.0 / (1.0 + loop), "-", "sensitivity"),
            (loop / (1.0 + loop), "--", "complementary"),
            (1.0 / (1.0 + held), ":", "sensitivity, σ̂ held"),
        ):
            panel.loglog(omega, np.abs(values), style, color=colour, lw=1.3,
                         label=f"{axis.axis}: {name}")  # fmt: skip
    panel.axhline(2.0, color=_TROUBLE, lw=0.8, ls="--")
    panel.set(xlim=(0.1, omega[-1]), ylim=(3e-3, 1e1), xlabel="ω, rad/s")
    panel.set_title("Sensitivity of the sampled loop", fontsize=9, loc="left")


def _draw_responses(panel: Axes, certificate: PlusCertificate) -> None:
    for k in _SHOWN:
        axis = certificate.axes[k]
        times = np.arange(len(axis.response.step_m)) * certificate.subject.sample_s
        colour = _COLOURS[axis.axis]
        for response, style, name in (
            (axis.response, "-", "adapting"),
            (axis.unadapted, ":", "σ̂ held"),
        ):
            panel.plot(times, 1e3 * response.step_m, style, color=colour, lw=1.4,
                       label=f"{axis.axis}: {name}")  # fmt: skip
    panel.axhline(0.0, color=_GREY, lw=0.7)
    panel.set(xlim=(0.0, SHOWN_S), xlabel="time, s", ylabel="position, mm")
    most = max(float(np.abs(a.unadapted.step_m).max()) for a in certificate.axes)
    if np.isfinite(most) and most < 1.0:
        panel.set_ylim(-0.5e3 * most, 1.2e3 * most)
    panel.set_title("Position after a disturbance of 1 m/s² has set in", fontsize=9, loc="left")


def _draw_family(panel: Axes, certificate: PlusCertificate) -> None:
    for k in _SHOWN:
        axis = certificate.axes[k]
        radii = slow_and_late(certificate.law, k, axis.plant, _FACTORS, _DELAYS_S)
        colour = _COLOURS[axis.axis]
        place = (1e3 * _DELAYS_S, _FACTORS, radii)
        panel.contourf(*place, levels=[1.0, np.inf], colors=[colour], alpha=0.16)
        panel.contour(*place, levels=[1.0], colors=[colour], linewidths=1.5)
        panel.plot([], [], color=colour, lw=1.5, label=f"{axis.axis}: unstable in the shaded part")
    here = {"ls": "none", "clip_on": False}
    panel.plot([0.0], [1.0], marker="o", color="black", ms=6, label="as identified", **here)
    for name, factor, delay_s in _FAMILY_AT:
        panel.plot([1e3 * delay_s], [factor], marker="x", color=_TROUBLE, ms=7, mew=1.6, **here)
        panel.annotate(name, (1e3 * delay_s, factor), fontsize=7.5, xytext=(6, 4),
                       textcoords="offset points", color="#333333")  # fmt: skip
    panel.set(xlabel="delay that the law is not told, ms", ylabel="response slower by the factor")
    panel.set_title("Where the loop is stable, nothing learnt", fontsize=9, loc="left")


def _loop(certificate: PlusCertificate, law: PlusLaw, k: int) -> ComplexArray:
    """L at the frequencies."""
    omega = frequencies(law.sample_s)
    plant = certificate.axes[k].plant
    return broken_at_u(law_response(law, k, omega), plant, omega, law.sample_s)
