"""max |ỹ| against the adaptation rate Γ."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.experiments.paper.adaptation_rate import SAMPLE_HZ, TRAJECTORY, AdaptationRate
from companion.experiments.paper.results import PaperResults
from companion.report.flight_data import Array
from companion.report.pages.style import (
    FAINT,
    INK,
    L1,
    L1_NOISY,
    MUTED,
    PAPER,
    SHOULD_BE,
    SMALL,
    new_figure,
    note,
    say,
)

_MM = 1e3
_HORIZONTAL = slice(0, 2)


def caption(results: PaperResults) -> str:
    """What is drawn."""
    sweep = results.adaptation_rate
    noise = (
        f"From Γ = {sweep.noise_decides_from:g} on, noise more than doubles it"
        if math.isfinite(sweep.noise_decides_from)
        else "Noise nowhere doubles it"
    )
    if math.isfinite(sweep.noise_floor_m_s):
        noise += f", and it never falls below {sweep.noise_floor_m_s * _MM:.0f} mm/s"
    unstable = ", ".join(f"{g:g}" for g in sweep.gammas[~sweep.stable])
    hollow = f"Γ = {unstable}" if unstable else "none"
    return (
        "Largest |ỹ| in mm/s (the greater of x and y, over the scored part) against the adaptation "
        f"rate Γ in 1/s², both logarithmic: the L1 controller alone on trajectory {TRAJECTORY} in "
        f"calm air, seed {results.scale.seeds[0]}, the state at {SAMPLE_HZ:g} Hz, without and with "
        f"measurement noise. The slope without noise is {_number(sweep.slope)}, "
        f"{_of_which(sweep)} (−0.5 is what the bound γ0 ∝ √(1/Γ) says; smooth disturbances fall "
        "faster). "
        "Crosses: reckoned for a step at the input of A(s) = M(s), the worst case, slope "
        f"{_number(sweep.step_model_slope)}: at the low end of Γ the damping of the mode √(mΓ) "
        "takes some of the peak, and towards large Γ the slope tends to −0.5. "
        f"{noise}. Hollow is where the sampled loop is unstable by its eigenvalues: {hollow}. "
        "Where the ground is grey, the state comes "
        "at less than 10 √(mΓ)."
    )


def _of_which(sweep: AdaptationRate) -> str:
    fitted = sweep.gammas[sweep.fitted]
    if not len(fitted):
        return "as no rate is both stable and sampled fast enough"
    return f"fitted from Γ = {fitted.min():g} to {fitted.max():g}, stable and sampled fast enough"


def _number(slope: float) -> str:
    return f"{slope:.2f}".replace("-", "−") if math.isfinite(slope) else "unknown"


def draw(results: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(5.0)
    axes = figure.add_subplot()
    sweep = results.adaptation_rate
    exact, noisy = (
        values[:, _HORIZONTAL].max(axis=1) * _MM for values in (sweep.exact_m_s, sweep.noisy_m_s)
    )
    if not (np.isfinite(exact) | np.isfinite(noisy)).any():
        say(axes, "none of the flights could be flown")
        return figure
    axes.set(xscale="log", yscale="log")
    _draw_points(axes, sweep.gammas, noisy, sweep.stable, L1_NOISY, "with measurement noise")
    _draw_points(axes, sweep.gammas, exact, sweep.stable, L1, "noise-free")
    _draw_slope(axes, sweep, exact)
    step = sweep.step_model_m_s * _MM
    if np.isfinite(step).all():
        axes.plot(sweep.gammas, step, "x", color=MUTED, ms=5, label="reckoned, a step")
    floor = sweep.noise_floor_m_s * _MM
    if math.isfinite(floor):
        axes.axhline(floor, color=L1_NOISY, lw=1.0, ls=":", label="least with noise")
    _shade_slow_sampling(axes, sweep)
    lost = sweep.gammas[~np.isfinite(exact) | ~np.isfinite(noisy)]
    if len(lost):
        note(axes, "lost at Γ = " + ", ".join(f"{g:g}" for g in lost))
    axes.set_xticks(sweep.gammas, [f"{g:g}" for g in sweep.gammas])
    axes.set_xticks([], minor=True)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_xlabel("adaptation rate Γ, 1/s²")
    axes.set_title("largest |ỹ|, horizontal, mm/s", pad=38)
    axes.legend(loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=3, borderaxespad=0.1)
    return figure


def _draw_points(
    axes: Axes, gammas: Array, values: Array, stable: np.ndarray, colour: str, label: str
) -> None:
    use = np.isfinite(values)
    axes.plot(gammas[use & stable], values[use & stable], color=colour, lw=1.2)
    axes.plot(gammas[use & stable], values[use & stable], "o", color=colour, ms=7, label=label)
    axes.plot(
        gammas[use & ~stable],
        values[use & ~stable],
        "o",
        markerfacecolor=PAPER,
        markeredgecolor=colour,
        markeredgewidth=1.5,
        ms=7,
    )


def _draw_slope(axes: Axes, sweep: AdaptationRate, exact_mm_s: Array) -> None:
    use = sweep.fitted & np.isfinite(exact_mm_s) & (exact_mm_s > 0.0)
    if use.sum() < 2 or not math.isfinite(sweep.slope):
        return
    logs = np.log(sweep.gammas[use])
    offset = float((np.log(exact_mm_s[use]) - sweep.slope * logs).mean())
    ends = np.array([logs.min(), logs.max()])
    axes.plot(
        np.exp(ends),
        np.exp(offset + sweep.slope * ends),
        **SHOULD_BE,
        label=f"slope {_number(sweep.slope)}",
    )
    first = float(np.exp(offset + sweep.slope * ends[0]))
    half = first * np.exp(-0.5 * (ends - ends[0]))
    axes.plot(np.exp(ends), half, color=MUTED, lw=1.0, ls=":", label="slope −0.50")


def _shade_slow_sampling(axes: Axes, sweep: AdaptationRate) -> None:
    """From halfway between the last rate that is sampled fast enough and the next one."""
    slow = sweep.gammas[sweep.gammas > sweep.well_sampled_to]
    axes.set_xlim(0.8 * sweep.gammas.min(), 1.25 * sweep.gammas.max())
    if not len(slow):
        return
    begin = math.sqrt(sweep.well_sampled_to * slow.min())
    axes.axvspan(begin, 1.25 * sweep.gammas.max(), color=FAINT, alpha=0.5, lw=0, zorder=-5)
    axes.text(
        0.995,
        0.98,
        "sampled more slowly\nthan 10 √(mΓ)",
        ha="right",
        va="top",
        transform=axes.transAxes,
        fontsize=SMALL,
        color=INK,
    )
