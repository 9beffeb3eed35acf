"""How each claim is judged: figures and a verdict from the results, by the rule in `claims.py`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.experiments.computing_time import WHAT
from companion.experiments.paper.results import PaperResults, Verdict
from companion.experiments.paper.scale import TRAJECTORIES
from companion.experiments.paper.statistics import Spread, millimetres
from companion.experiments.paper.tracking import Errors
from companion.report.flight_data import Array

_MILLI = 1e3
_AXES = "xyz"


class UndecidedError(Exception):
    """There is nothing to judge by; the text says what is missing."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """What was measured, and what follows."""

    figures: str
    verdict: Verdict
    reason: str = ""
    """What to keep in mind; nothing that the figures could belie."""


def _flown(*spreads: Spread) -> None:
    """Refuse to judge by flights that were lost.

    Raises:
        UndecidedError: there are such.
    """
    lost = sum(spread.lost for spread in spreads)
    if lost or not all(math.isfinite(spread.mean) for spread in spreads):
        raise UndecidedError(f"{lost or 'some'} of the flights that it rests on were lost.")


def _graded(best: bool, good: bool) -> Verdict:
    """Reproduced, partly or not, by a strict and a lenient condition."""
    if best:
        return "reproduced"
    return "partly" if good else "not reproduced"


def _mm(spread: Spread) -> str:
    return millimetres(spread, " mm")


def _per_axis(values: Array, unit: str, scale: float = 1.0) -> str:
    figures = ", ".join(f"{axis} {scale * v:.3g}" for axis, v in zip(_AXES, values, strict=True))
    return f"{figures} {unit}".rstrip()


def _errors(results: PaperResults, controller: str, wind: str) -> Errors:
    """Errors of a controller that flew everything.

    Raises:
        UndecidedError: it did not.
    """
    errors = results.tracking.errors[controller][wind]
    _flown(errors.mean, *errors.by_trajectory.values())
    return errors


def high_accuracy(results: PaperResults) -> Judgement:
    """Of MPC-L1 in calm air."""
    errors = _errors(results, "mpc-l1", "calm")
    worst = max(errors.by_trajectory.values(), key=lambda s: s.mean)
    return Judgement(
        f"mean of five trajectories {_mm(errors.mean)}, worst {_mm(worst)}",
        _graded(
            errors.mean.mean <= 0.03 and worst.mean <= 0.06,
            errors.mean.mean <= 0.06 and worst.mean <= 0.12,
        ),
        "Every flight is a first one: nothing is learnt from flight to flight.",
    )


def high_gain(results: PaperResults) -> Judgement:
    """Of the sweep's upper part."""
    sweep = results.adaptation_rate
    noisy = sweep.noisy_m_s[:, :2].max(axis=1)
    high = sweep.gammas >= 300.0
    if not (np.isfinite(noisy[high]).all() and high.any()):
        raise UndecidedError("a flight of the sweep was lost.")
    growth = float(noisy[-1] / noisy[high].min())
    fine = bool(sweep.stable[high].all())
    low = [f"{gamma:g}" for gamma in sweep.gammas[~sweep.stable]]
    return Judgement(
        f"of Γ = {', '.join(f'{g:g}' for g in sweep.gammas)} unstable: {', '.join(low) or 'none'}; "
        f"noisy max|ỹ| at the highest is {growth:.2f} × its least value",
        _graded(fine and growth <= 1.1, fine),
        "Γ has a lower bound on a vehicle with lag and delay, and a high Γ follows the noise of "
        "the measured velocity (companion certify gives both ends).",
    )


def computing(results: PaperResults) -> Judgement:
    """Of the timing."""
    times = results.computing_time
    if times is None:
        raise UndecidedError("CasADi is not installed: pip install 'companion[nonlinear]'.")
    medians = {m.name: m.median_us for m in times.methods if m.median_us is not None}
    own = medians.get("linear_stack")
    others = [value for name, value in medians.items() if name.startswith("nonlinear")]
    if own is None or not others:
        raise UndecidedError("a method could not be timed.")
    ratio = min(others) / own
    figures = "; ".join(f"{WHAT[name]}: {value:.0f} µs" for name, value in medians.items())
    return Judgement(
        f"{figures}. Fastest nonlinear over all of MPC-L1: {ratio:.1f} ×",
        _graded(ratio >= 2.0, ratio > 1.0),
        "Medians. With constraints active the linear MPC calls its QP solver and comes near the "
        "fastest nonlinear scheme; implementations are compared, not algorithms.",
    )


def excitation(results: PaperResults) -> Judgement:
    """Of the hover in wind."""
    hover = results.changing_dynamics.hover
    if hover is None:
        raise UndecidedError("the hover was not flown to its end.")
    clean = abs(hover.settled_sine / hover.expected_sine - 1.0)
    noisy = abs(hover.settled_noisy_sine / hover.expected_sine - 1.0)
    return Judgement(
        f"push/g {hover.expected_sine:.4f}; settled σ̂ {hover.settled_sine:.4f} without noise "
        f"({clean:.1%} off), {hover.settled_noisy_sine:.4f} with ({noisy:.1%} off); within 10 % "
        f"{hover.settling_s:.1f} s after the take-over; the vehicle then moves at most "
        f"{hover.largest_speed_m_s * _MILLI:.1f} mm/s",
        _graded(clean <= 0.1 and noisy <= 0.25, clean <= 0.1),
        "σ̂ is a lumped input disturbance, not a set of parameters.",
    )


def reference_bounded(results: PaperResults) -> Judgement:
    """Of the norm condition and the simulated reference system."""
    g = results.guarantees
    product = g.norm_g * g.lipschitz
    if not results.reference:
        raise UndecidedError("the flights that drive it were lost.")
    gains = [float(np.abs(c.y1_ref_m_s).max() / np.abs(c.r1_m_s).max()) for c in results.reference]
    holds = bool((product < 1.0).all())
    return Judgement(
        f"‖G‖ L: {_per_axis(product, '')}; largest |y1_ref| over largest |r1|: "
        + ", ".join(f"{gain:.2f}" for gain in gains),
        _graded(holds and max(gains) < 2.0, not holds),
    )


def adaptation_rate(results: PaperResults) -> Judgement:
    """Of the sweep without noise."""
    sweep = results.adaptation_rate
    if not math.isfinite(sweep.slope):
        raise UndecidedError("fewer than two flights of the sweep can be fitted.")
    fitted = sweep.gammas[sweep.fitted]
    return Judgement(
        f"slope {sweep.slope:.2f} over Γ = {fitted.min():g} … {fitted.max():g} (over the whole "
        f"sweep {sweep.slope_all:.2f}); reckoned for a step at the input of A = M, the worst case, "
        f"{sweep.step_model_slope:.2f}; with noise |ỹ| does not fall below "
        f"{sweep.noise_floor_m_s * _MILLI:.0f} mm/s",
        _graded(sweep.slope <= -0.5, sweep.slope < 0.0),
        "√(1/Γ) is a bound, which a step tends to from above as Γ grows: smooth disturbances give "
        "a steeper fall. With noise in the measured velocity, which ỹ contains, the sentence does "
        "not hold.",
    )


def reference_followed(results: PaperResults) -> Judgement:
    """Of y1 against y1_ref."""
    if len(results.reference) < 2:
        raise UndecidedError("a flight that it rests on was lost.")
    largest = np.max([c.largest_m_s for c in results.reference], axis=0)
    gamma_1 = results.guarantees.gamma_1_m_s
    figures = "; ".join(f"{c.name}: {_per_axis(c.largest_m_s, 'm/s')}" for c in results.reference)
    return Judgement(
        f"max |y1_ref - y1|: {figures}; γ1 {_per_axis(gamma_1, 'm/s')}",
        _graded(bool((largest < np.minimum(gamma_1, 0.1)).all()), bool((largest < 0.2).all())),
        "γ1 is beyond the vehicle's speed limit and decides nothing. y1_ref has the stated A(s) "
        "with its delay, and the r1 of the flight.",
    )


def cancellation(results: PaperResults) -> Judgement:
    """Of the noise-free hover in steady wind."""
    hover = results.changing_dynamics.hover
    if hover is None:
        raise UndecidedError("the hover was not flown to its end.")
    offset = hover.settled_offset_m
    return Judgement(
        f"in a push of {hover.expected_sine:.3f} g the hover settles within "
        f"{offset * _MILLI:.2f} mm of its point",
        _graded(offset <= 0.001, offset <= 0.01),
    )


def bounded_estimate(results: PaperResults) -> Judgement:
    """Of ỹ in the two flights of the bounds figure."""
    g, flights = results.guarantees, results.bounds
    if set(flights) != {"exact", "noisy"}:
        raise UndecidedError("a flight that it rests on was lost.")
    exact, noisy = flights["exact"], flights["noisy"]
    seen, seen_noisy = exact.largest_y_tilde_m_s, noisy.largest_y_tilde_m_s
    holds = bool((seen < exact.own_gamma_0_m_s).all())
    holds_noisy = bool((seen_noisy < noisy.own_gamma_0_m_s + g.noise_extra_m_s).all())
    return Judgement(
        f"max |ỹ| noise-free {_per_axis(seen, 'mm/s', _MILLI)}; with noise "
        f"{_per_axis(seen_noisy, 'mm/s', _MILLI)}; γ0 with the flight's own figures, noise-free "
        f"{_per_axis(exact.own_gamma_0_m_s, 'm/s')}; for every flight "
        f"{_per_axis(g.gamma_0_m_s, 'm/s')} (ratio of noise-free max |ỹ| to it "
        f"{_per_axis(seen / g.gamma_0_m_s, '')})",
        _graded(holds and holds_noisy, holds),
        "γ0 is derived from the predictor and the projection (docs/certify.md), not the book's "
        "(4.31). For every flight it is beyond the vehicle's speed limit: a bound, and no test.",
    )


def ideal_system(results: PaperResults) -> Judgement:
    """Of y2 against y2_id."""
    flights = results.bounds
    if set(flights) != {"exact", "noisy"}:
        raise UndecidedError("a flight that it rests on was lost.")
    largest = max(float(flight.largest_distance_m.max()) for flight in flights.values())
    figures = "; ".join(
        f"{name}: largest {_per_axis(flight.largest_distance_m, 'mm', _MILLI)}, mean "
        f"{flight.mean_distance_m * _MILLI:.0f} mm"
        for name, flight in flights.items()
    )
    return Judgement(
        f"|y2 - y2_id|, {figures}",
        _graded(largest <= 0.1, largest <= 0.2),
        f"The largest is {largest / 0.1:.0%} of the limit.",
    )


def feedback_only(results: PaperResults) -> Judgement:
    """Of PID-L1 and LQR-L1 in calm air."""
    mpc = _errors(results, "mpc-l1", "calm")
    others = {name: _errors(results, name, "calm") for name in ("pid-l1", "lqr-l1")}
    ratios = {name: e.mean.mean / mpc.mean.mean for name, e in others.items()}
    everywhere = all(
        e.by_trajectory[n].mean > mpc.by_trajectory[n].mean
        for e in others.values()
        for n in TRAJECTORIES
    )
    variant = results.tracking.errors["pid-l1-error"]["calm"].mean
    return Judgement(
        f"mean of five: MPC-L1 {_mm(mpc.mean)}, "
        + ", ".join(f"{name} {_mm(e.mean)} ({ratios[name]:.0f} ×)" for name, e in others.items())
        + f"; PID-L1 with D on the error, which contains a derivative of y2*, {_mm(variant)}",
        _graded(everywhere and min(ratios.values()) >= 2.0, min(ratios.values()) > 1.0),
        "How the gains were found stands in each controller's file and in docs/decisions/0009.",
    )


def delay(results: PaperResults) -> Judgement:
    """Of the shown time responses."""
    lags = {name: response.lag_s for name, response in results.tracking.responses.items()}
    if not {"pid-l1", "lqr-l1", "mpc-l1"} <= set(lags):
        raise UndecidedError("a flight along trajectory 4 was lost.")
    slow, mpc = min(lags["pid-l1"], lags["lqr-l1"]), abs(lags["mpc-l1"])
    return Judgement(
        "lag: " + ", ".join(f"{name} {lag:.2f} s" for name, lag in lags.items()),
        _graded(slow >= 0.1 and slow >= 3.0 * mpc, slow > mpc),
        "The lag is the shift of the desired path that brings it closest to the flown one.",
    )


def step_model(results: PaperResults) -> Judgement:
    """Of the identified model."""
    models = results.identification
    if not models:
        raise UndecidedError("no step could be flown with the PID.")
    pid, l1 = _errors(results, "mpc-pid", "calm"), _errors(results, "mpc-l1", "calm")
    misfits = [model.misfit_rms_m / model.step_m for model in models]
    rough, worse = max(misfits) > 0.1, pid.mean.mean > l1.mean.mean
    fits = "; ".join(
        f"{axis} ω {m.natural_frequency_rad_s:.2f} rad/s, ζ {m.damping:.2f}, misfit {misfit:.0%} "
        f"of a step of {m.step_m:g} m"
        for axis, m, misfit in zip(_AXES, models, misfits, strict=True)
    )
    return Judgement(
        f"{fits}; MPC-PID {_mm(pid.mean)} at a tilt slew of "
        f"{results.tracking.errors['mpc-pid']['calm'].tilt_slew_g_s.mean:.1f} g/s, MPC-L1 "
        f"{_mm(l1.mean)} at "
        f"{results.tracking.errors['mpc-l1']['calm'].tilt_slew_g_s.mean:.1f} g/s",
        _graded(rough and worse, rough or worse),
        "The model has no delay, and the MPC over it, with the weights of MPC-L1, asks for more "
        "than the PID's loop bears if the slew is high.",
    )


def one_model(results: PaperResults) -> Judgement:
    """Of the 5 × 5 table."""
    table = results.model_transfer
    if not math.isfinite(table.gain_at_home) or not math.isfinite(table.loss_away):
        raise UndecidedError("a flight of the table was lost.")
    helps, harms = table.gain_at_home <= 0.98, table.harmed_away >= 0.5
    return Judgement(
        f"own model over the identified one: {table.gain_at_home:.2f} ×; foreign model over the "
        f"identified one: {table.loss_away:.2f} ×; a foreign model is worse than the trajectory's "
        f"own by 2 % or more in {table.harmed_away:.0%} of the cases; the own one is the best of "
        f"the five on {table.best_at_home} of 5",
        _graded(helps and harms, helps or harms),
        "Geometric means.",
    )


def same_with_fan(results: PaperResults) -> Judgement:
    """Of MPC-L1 with the fan."""
    calm, fan = (_errors(results, "mpc-l1", wind) for wind in ("calm", "fan"))
    ratio = fan.mean.mean / calm.mean.mean
    return Judgement(
        f"calm {_mm(calm.mean)}, fan {_mm(fan.mean)} ({ratio:.2f} ×)",
        _graded(ratio <= 1.25, ratio <= 2.0),
        "C(s) passes only the slow part of a jet that is crossed in half a second.",
    )


def _by_the_fan(results: PaperResults, controller: str) -> dict[int, float]:
    """Increase of the error by the fan per trajectory, m."""
    calm, fan = (_errors(results, controller, wind) for wind in ("calm", "fan"))
    return {n: fan.by_trajectory[n].mean - calm.by_trajectory[n].mean for n in TRAJECTORIES}


def _list(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers)) or "none"


def mpc_pid_worse_with_fan(results: PaperResults) -> Judgement:
    """Of MPC-PID with the fan."""
    calm, fan = (_errors(results, "mpc-pid", wind) for wind in ("calm", "fan"))
    worse = [n for n, increase in _by_the_fan(results, "mpc-pid").items() if increase > 0.0]
    mean_worse = fan.mean.mean > calm.mean.mean
    return Judgement(
        f"calm {_mm(calm.mean)}, fan {_mm(fan.mean)}; worse on {_list(worse)}",
        _graded(len(worse) >= 4 and mean_worse, mean_worse),
    )


def only_trajectory_3(results: PaperResults) -> Judgement:
    """Of the trajectories on which the fan helps MPC-PID."""
    better = [n for n, increase in _by_the_fan(results, "mpc-pid").items() if increase < 0.0]
    return Judgement(f"better with the fan on {_list(better)}", _graded(better == [3], 3 in better))


def smaller_increase(results: PaperResults) -> Judgement:
    """Of what the fan adds."""
    increases = {
        name: float(np.mean(list(_by_the_fan(results, name).values())))
        for name in ("mpc-l1", "mpc-pid", "mpc-pid-joint")
    }
    own, recipe, joint = increases.values()
    least = min(recipe, joint)
    return Judgement(
        "mean of five: "
        + ", ".join(f"{name} {value * _MILLI:+.1f} mm" for name, value in increases.items()),
        _graded(least > 0.0 and own <= 0.5 * least, own < recipe),
        "It depends on the PID: a stiff one rejects a push by itself.",
    )


def better_than_all(results: PaperResults) -> Judgement:
    """Of the means in both winds."""
    first = ("pid-l1", "lqr-l1", "mpc-pid")
    figures, paper, joint_too = [], True, True
    for wind in ("calm", "fan"):
        own = _errors(results, "mpc-l1", wind).mean
        others = {name: _errors(results, name, wind).mean for name in (*first, "mpc-pid-joint")}
        paper = paper and all(own.mean < others[name].mean for name in first)
        joint_too = joint_too and own.mean < others["mpc-pid-joint"].mean
        said = ", ".join(f"{name} {_mm(spread)}" for name, spread in others.items())
        figures.append(f"{wind}: MPC-L1 {_mm(own)}, {said}")
    return Judgement(
        "; ".join(figures),
        _graded(paper and joint_too, paper),
        "mpc-pid is tuned as the paper tunes it: the PID alone, a model from steps, the MPC on "
        "top; mpc-pid-joint has the same structure, PID and model tuned together with the MPC.",
    )


def changing_dynamics(results: PaperResults) -> Judgement:
    """Of the load."""
    load = results.changing_dynamics.load.get("mpc-l1")
    if load is None:
        raise UndecidedError("the flight was lost.")
    _flown(load.from_ideal, load.from_ideal_without, load.settled, load.settled_without)
    ratio = load.from_ideal.mean / load.from_ideal_without.mean
    pid = results.changing_dynamics.load.get("mpc-pid")
    beside = "" if pid is None else f" (MPC-PID {_mm(pid.settled)})"
    return Judgement(
        f"mean |y2 - D(s) r2| settled {_mm(load.from_ideal)}, without the load "
        f"{_mm(load.from_ideal_without)} ({ratio:.2f} ×); tracking error {_mm(load.shortly_after)} "
        f"in the 2 s after it, {_mm(load.settled)} settled, {_mm(load.settled_without)} without "
        f"it{beside}; sag {load.largest_sag_m * _MILLI:.0f} mm",
        _graded(ratio <= 1.25, ratio <= 2.0),
        "Part of it is the work of the climb-rate loop's hover-thrust estimator.",
    )
