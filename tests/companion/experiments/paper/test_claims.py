"""Verdicts follow the data, by the rule that stands beside them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from companion.experiments.paper.claims import judge_claims
from companion.experiments.paper.scale import FULL, QUICK
from companion.experiments.paper.statistics import spread
from tests.companion.experiments.paper.factory import make_results, with_losses

RESULTS = make_results(FULL)


def verdict(results, begin):
    (claim,) = [c for c in judge_claims(results) if begin in c.quote]
    return claim.verdict


def with_errors(controller, wind, factor, study=RESULTS):
    """The study with other errors of one controller in one wind."""
    errors = {c: dict(by_wind) for c, by_wind in study.tracking.errors.items()}
    old = errors[controller][wind]

    def scaled(one):
        return spread([factor * value for value in one.values])

    errors[controller][wind] = replace(
        old,
        by_trajectory={n: scaled(s) for n, s in old.by_trajectory.items()},
        mean=scaled(old.mean),
    )
    return replace(study, tracking=replace(study.tracking, errors=errors))


def test_every_claim_quotes_measures_states_its_rule_and_is_judged():
    for scale in (FULL, QUICK):
        for results in (make_results(scale), with_losses(make_results(scale))):
            claims = judge_claims(results)
            assert len(claims) == len({c.quote for c in claims}) >= 15
            for claim in claims:
                assert claim.quote
                assert claim.section
                assert claim.rule
                assert claim.verdict in ("reproduced", "partly", "not reproduced", "not tested")


@pytest.mark.parametrize(
    ("begin", "controller", "wind", "factor"),
    [
        ("high-accuracy trajectory tracking", "mpc-l1", "calm", 10.0),
        ("significantly larger tracking errors", "pid-l1", "calm", 1e-3),
        ("approximately the same performance", "mpc-l1", "fan", 10.0),
        ("improves the tracking performance as compared", "mpc-pid", "calm", 1e-3),
    ],
)
def test_a_verdict_falls_when_the_figures_do(begin, controller, wind, factor):
    assert verdict(RESULTS, begin) != "not reproduced"
    assert verdict(with_errors(controller, wind, factor), begin) == "not reproduced"


def test_the_increase_by_the_fan_is_judged_against_both_kinds_of_mpc_pid():
    begin = "significantly smaller increase"
    assert verdict(RESULTS, begin) == "not reproduced"  # the same for all, there
    paper = with_errors("mpc-pid", "fan", 5.0)
    assert verdict(paper, begin) == "partly"
    assert verdict(with_errors("mpc-pid-joint", "fan", 5.0, paper), begin) == "reproduced"


def test_the_bound_of_the_prediction_error_decides_about_it():
    begin = "The estimation error remains bounded"
    assert verdict(RESULTS, begin) == "reproduced"
    tight = replace(RESULTS.guarantees, gamma_0_m_s=np.full(3, 1e-9))
    assert verdict(replace(RESULTS, guarantees=tight), begin) == "not reproduced"


def test_the_slope_decides_about_the_adaptation_rate_and_noise_makes_it_partly():
    def at(**changes):
        sweep = replace(RESULTS.adaptation_rate, **changes)
        return verdict(replace(RESULTS, adaptation_rate=sweep), "can be made arbitrarily small")

    assert at(slope=-0.9, noise_decides_from=math.inf) == "reproduced"
    assert at(slope=-0.9, noise_decides_from=500.0) == "partly"
    assert at(slope=-0.3, noise_decides_from=math.inf) == "not reproduced"


def test_without_the_nonlinear_solver_its_claim_is_not_tested():
    results = replace(RESULTS, computing_time=None)
    assert verdict(results, "reduced computational cost") == "not tested"
