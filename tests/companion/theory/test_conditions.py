from dataclasses import replace

import pytest

from companion.control.transfer_function import TransferFunction, first_order
from companion.theory.conditions import Findings, conditions

GOOD = Findings(
    model=first_order(0.5),
    low_pass=first_order(0.2),
    h_stable=True,
    slowest_pole=complex(-0.5),
    norm_g=5.0,
    lipschitz=0.03,
    sigma=14.0,
    planned_sigma=12.0,
    delta=16.0,
    projection_margin=0.1,
    continuous_stable=True,
    discretisation="exact",
    sample_s=0.01,
    gamma=300.0,
    adaptation_radius=0.99,
    inner_radius=0.998,
    inner_pole=complex(-0.2, 0.6),
    whole_radius=0.97,
    whole_pole=complex(-0.9, 4.0),
    gamma_low=200.0,
    gamma_high=2e5,
    gamma_high_reason="nyquist",
    gamma_safe=8e3,
    gamma_limit=2e5,
    noise_to_y_tilde=1.2,
    noise_to_u=0.5,
)


def test_good_findings_fulfil_every_condition_without_a_word_of_caution():
    for condition in conditions(GOOD):
        assert condition.holds, condition
        assert condition.reason == ""
        assert condition.caution == ""


@pytest.mark.parametrize(
    ("changed", "name", "says"),
    [
        (
            {"model": TransferFunction((0.25,), (1.0, 1.0, 0.25))},
            "M strictly positive real",
            "needs a Lyapunov function",
        ),
        (
            {"low_pass": TransferFunction((0.3,), (1.0, 0.2))},
            "C(0) = 1, strictly proper, stable",
            "C(0) = 1",
        ),
        ({"h_stable": False, "slowest_pole": 1 + 2j}, "H(s) stable", "lower ω, or raise m"),
        (
            {"norm_g": None, "slowest_pole": 0.01 + 2j},
            "‖G‖ L < 1",
            "stable with the exact delay but not with its Padé approximation (pole at 0.01 ± 2j",
        ),
        ({"lipschitz": 0.2}, "‖G‖ L < 1", "fly slower or in less wind"),
        ({"planned_sigma": 15.5}, "projection leaves σ free", "raise sigma_bound to 16.3 or more"),
        (
            {"adaptation_radius": 1.0, "discretisation": "euler"},
            "discrete adaptation law stable",
            "Γ < 100",
        ),
        (
            {"adaptation_radius": 1.0},
            "discrete adaptation law stable",
            "unstable by themselves",
        ),
        ({"continuous_stable": False}, "L1 and K loop, continuous time", "do not stabilise A(s)"),
        ({"inner_radius": 1.0}, "sampled L1 and K loop", "deviations grow at 0.6 rad/s"),
        ({"whole_radius": 1.1}, "sampled, with outer loop", "deviations grow at 4.0 rad/s"),
        ({"gamma_low": float("nan")}, "Γ in the stable range", "no Γ from 1.2 to 7.5e+04"),
        (
            {"gamma_low": float("nan"), "gamma": 1e12},
            "Γ in the stable range",
            "no Γ from 8e+02 to 2e+05",
        ),
        (
            {"gamma_low": float("nan"), "discretisation": "euler"},
            "Γ in the stable range",
            "no Γ from 0.4 to 1e+02",
        ),
        ({"gamma": 150.0}, "Γ in the stable range", "the estimate lags behind"),
        ({"gamma": 3e5}, "Γ in the stable range", "above half the sampling frequency"),
        (
            {"gamma_high": 100.0, "gamma_low": 30.0, "gamma_high_reason": "euler"},
            "Γ in the stable range",
            "explicit Euler at 100 Hz is stable only for Γ < 100",
        ),
        (
            {"gamma_high": 250.0, "gamma_high_reason": "whole loop"},
            "Γ in the stable range",
            "with Γ above 250 the loop is unstable",
        ),
    ],
)
def test_each_condition_fails_alone_and_says_why(changed, name, says):
    failing = [c for c in conditions(replace(GOOD, **changed)) if not c.holds]
    assert [c.name for c in failing] == [name]
    assert says in failing[0].reason


def test_a_projection_that_may_act_in_a_storm_is_a_caution_and_no_failure():
    cautious = [c for c in conditions(replace(GOOD, sigma=15.7)) if c.caution]
    assert [c.name for c in cautious] == ["projection leaves σ free"]
    assert cautious[0].holds
    assert "a sigma_bound of 16.5 covers all" in cautious[0].caution


def found(name, **changed):
    return next(c for c in conditions(replace(GOOD, **changed)) if c.name == name)


def test_an_unstable_h_has_an_infinite_norm_and_says_both():
    changed = {"h_stable": False, "slowest_pole": 1 + 2j, "norm_g": None}
    assert found("‖G‖ L < 1", **changed).reason == "H(s) is not stable, so that ‖G‖ is infinite"
    assert not found("H(s) stable", **changed).holds


def test_a_mode_that_turns_many_times_within_a_sample_costs_the_step_its_precision():
    changed = {"gamma": 2e17, "adaptation_radius": 1.05}
    said = found("discrete adaptation law stable", **changed).reason
    assert "turns by 3.1e+06 rad within a sample" in said


def test_a_rate_that_is_stable_but_not_safe_is_a_caution_that_names_the_noise():
    changed = {"gamma": 19e4, "noise_to_y_tilde": 10.79, "noise_to_u": 7.182}
    condition = found("Γ in the stable range", **changed)
    assert condition.holds
    assert condition.found == "Γ = 190000; stable: 200 < Γ < 2e+05, safe to 8e+03"
    assert "beyond Γ = 8e+03" in condition.caution
    assert "10.8 × to ỹ, and to u as 7.18 per m/s" in condition.caution


@pytest.mark.parametrize(
    ("safe", "says"),
    [(2e5, "< 2e+05, all of it well sampled"), (150.0, "< 2e+05, none of it safe")],
)
def test_all_or_none_of_the_stable_range_may_be_safe(safe, says):
    condition = found("Γ in the stable range", gamma_safe=safe)
    assert condition.holds
    assert condition.found.endswith(says)
    assert bool(condition.caution) == (safe < GOOD.gamma)
