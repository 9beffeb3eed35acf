"""Verdicts follow the data, by the rule that stands beside them."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from companion.experiments.paper.claims import STATEMENTS, judge_claims
from companion.experiments.paper.scale import FULL, QUICK
from companion.experiments.paper.statistics import spread
from tests.companion.experiments.paper.factory import make_results, with_losses

RESULTS = make_results(FULL)
SENTENCES = Path("tests/data/paper/claims.txt").read_text(encoding="utf-8").splitlines()


def verdict(results, begin):
    (claim,) = [c for c in judge_claims(results) if begin in c.quote]
    return claim.verdict


def scaled(one, factor):
    return spread([factor * value for value in one.values])


def with_errors(controller, wind, factor, study=RESULTS):
    """The study with other errors of one controller in one wind."""
    errors = {c: dict(by_wind) for c, by_wind in study.tracking.errors.items()}
    old = errors[controller][wind]
    errors[controller][wind] = replace(
        old,
        by_trajectory={n: scaled(s, factor) for n, s in old.by_trajectory.items()},
        mean=scaled(old.mean, factor),
    )
    return replace(study, tracking=replace(study.tracking, errors=errors))


def with_lag(**lags):
    responses = {
        name: replace(response, lag_s=lags.get(name.replace("-", "_"), response.lag_s))
        for name, response in RESULTS.tracking.responses.items()
    }
    return replace(RESULTS, tracking=replace(RESULTS.tracking, responses=responses))


def with_hover(**changes):
    dynamics = RESULTS.changing_dynamics
    return replace(
        RESULTS, changing_dynamics=replace(dynamics, hover=replace(dynamics.hover, **changes))
    )


def with_load(**changes):
    dynamics = RESULTS.changing_dynamics
    load = {**dynamics.load, "mpc-l1": replace(dynamics.load["mpc-l1"], **changes)}
    return replace(RESULTS, changing_dynamics=replace(dynamics, load=load))


def with_sweep(**changes):
    return replace(RESULTS, adaptation_rate=replace(RESULTS.adaptation_rate, **changes))


def with_bounds(**changes):
    return replace(RESULTS, bounds={n: replace(f, **changes) for n, f in RESULTS.bounds.items()})


def with_reference(**changes):
    return replace(RESULTS, reference=tuple(replace(c, **changes) for c in RESULTS.reference))


def with_linear_stack(median_us):
    times = RESULTS.computing_time
    methods = tuple(
        replace(m, median_us=median_us) if m.name == "linear_stack" else m for m in times.methods
    )
    return replace(RESULTS, computing_time=replace(times, methods=methods))


def with_table(home, away):
    errors = np.full((5, 5), away)
    errors[np.diag_indices(5)] = home
    table = replace(RESULTS.model_transfer, errors_m=errors)
    known = tuple(spread([0.05] * 5) for _ in range(5))
    return replace(RESULTS, model_transfer=replace(table, identified=known))


@pytest.mark.parametrize("statement", STATEMENTS, ids=lambda s: s.quote[:40])
def test_a_quotation_is_the_papers_own_words(statement):
    parts = [part.strip() for part in statement.quote.split("…")]
    assert any(all(part in sentence for part in parts) for sentence in SENTENCES)


def test_every_sentence_is_judged_once_and_says_by_what():
    assert len(STATEMENTS) == len(SENTENCES)
    for scale in (FULL, QUICK):
        for claim in judge_claims(make_results(scale)):
            assert claim.figures != "–"
            assert claim.verdict != "not tested"
            assert "nan" not in claim.figures
            assert "inf" not in claim.figures


def test_lost_flights_decide_nothing():
    """All controllers lose trajectory 5, and whole experiments are missing."""
    lost = judge_claims(with_losses(RESULTS))
    assert {c.verdict for c in lost if "PID" in c.quote or "IV-E" in c.section} == {"not tested"}
    only = with_errors("lqr-l1", "calm", math.inf)
    assert verdict(only, "significantly larger tracking errors") == "not tested"
    only = with_errors("mpc-pid-joint", "fan", math.inf)
    assert verdict(only, "significantly smaller increase") == "not tested"
    fewer = replace(RESULTS, bounds={"exact": RESULTS.bounds["exact"]})
    assert verdict(fewer, "does behave close") == "not tested"


CASES = [
    ("high-accuracy", lambda f: with_errors("mpc-l1", "calm", f), (0.5, 2.0, 10.0)),
    ("significantly larger", lambda f: with_errors("pid-l1", "calm", f), (1.0, None, 1e-3)),
    ("approximately the same", lambda f: with_errors("mpc-l1", "fan", f), (0.5, None, 10.0)),
    ("generally worse", lambda f: with_errors("mpc-pid", "fan", f), (2.0, None, 0.1)),
    ("tracking delay", lambda s: with_lag(pid_l1=s, lqr_l1=s), (0.5, 0.06, 0.0)),
    ("persistent excitation", lambda s: with_hover(settled_sine=s), (0.0635, None, 0.05)),
    ("cancel the uncertainties", lambda m: with_hover(settled_offset_m=m), (1e-4, 5e-3, 0.05)),
    (
        "changing dynamics",
        lambda f: with_load(
            from_ideal=scaled(RESULTS.changing_dynamics.load["mpc-l1"].from_ideal_without, f)
        ),
        (1.1, 1.7, 3.0),
    ),
    ("arbitrarily small", lambda s: with_sweep(slope=s), (-0.9, -0.3, 0.1)),
    (
        "arbitrarily high",
        lambda ok: with_sweep(stable=np.full(len(FULL.adaptation_rates), ok)),
        (None, True, False),
    ),
    (
        "remains bounded",
        lambda b: with_bounds(own_gamma_0_m_s=np.full(3, b)),
        (1.0, None, 1e-9),
    ),
    (
        "close to the ideal",
        lambda d: with_bounds(largest_distance_m=np.full(3, d)),
        (0.05, 0.15, 0.3),
    ),
    (
        "approaches the behavior",
        lambda d: with_reference(largest_m_s=np.full(3, d)),
        (0.05, 0.15, 0.3),
    ),
    (
        "(BIBO) stable",
        lambda f: with_reference(y1_ref_m_s=f * RESULTS.reference[0].r1_m_s),
        (1.0, None, 5.0),
    ),
    ("reduced computational cost", with_linear_stack, (10.0, 700.0, 1e5)),
    ("not accurate enough", lambda f: with_errors("mpc-pid", "calm", f), (5.0, 0.01, None)),
    ("tuning this system model", lambda a: with_table(0.04, a), (0.06, 0.0401, None)),
]


@pytest.mark.parametrize(("begin", "change", "values"), CASES, ids=[c[0] for c in CASES])
def test_a_verdict_goes_with_the_figures(begin, change, values):
    """Figures for which it is reproduced, partly, not; None where there is none such."""
    wanted = ("reproduced", "partly", "not reproduced")
    for value, expected in zip(values, wanted, strict=True):
        if value is not None:
            assert verdict(change(value), begin) == expected


def test_only_trajectory_3_profits_or_not():
    begin = "Only for trajectory 3"
    assert verdict(with_errors("mpc-pid", "fan", 5.0), begin) == "not reproduced"
    assert verdict(with_errors("mpc-pid", "fan", 0.1), begin) == "partly"  # all five profit
    errors = with_errors("mpc-pid", "fan", 5.0).tracking.errors["mpc-pid"]["fan"]
    mixed = {**errors.by_trajectory, 3: scaled(errors.by_trajectory[3], 0.01)}
    study = with_errors("mpc-pid", "fan", 5.0)
    table = {**study.tracking.errors}
    table["mpc-pid"] = {**table["mpc-pid"], "fan": replace(errors, by_trajectory=mixed)}
    study = replace(study, tracking=replace(study.tracking, errors=table))
    assert verdict(study, begin) == "reproduced"


def test_mpc_l1_is_measured_against_both_kinds_of_mpc_pid():
    increase, best = "significantly smaller increase", "even in the presence of strong wind"
    assert verdict(RESULTS, increase) == "not reproduced"  # the same for all, there
    paper = with_errors("mpc-pid", "fan", 5.0)
    assert verdict(paper, increase) == "partly"
    assert verdict(with_errors("mpc-pid-joint", "fan", 5.0, paper), increase) == "reproduced"
    better = with_errors("mpc-pid-joint", "calm", 0.01)
    assert verdict(better, best) == "partly"
    assert verdict(with_errors("pid-l1", "fan", 1e-3), best) == "not reproduced"


def test_an_error_that_the_fan_makes_smaller_is_no_smaller_increase():
    fallen = with_errors("mpc-pid", "fan", 0.9)
    for controller in ("mpc-pid-joint", "mpc-l1"):
        fallen = with_errors(controller, "fan", 0.8, fallen)
    assert verdict(fallen, "significantly smaller increase") != "reproduced"


def test_without_the_nonlinear_solver_its_claim_is_not_tested():
    results = replace(RESULTS, computing_time=None)
    assert verdict(results, "reduced computational cost") == "not tested"
