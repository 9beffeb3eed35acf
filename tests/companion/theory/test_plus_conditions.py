import math
from dataclasses import replace

import pytest

from companion.theory.envelope import Air
from companion.theory.plus_conditions import PlusFindings, plus_conditions
from companion.theory.plus_envelope import sigma_bounds
from companion.theory.plus_family import Member, lag, late
from tests.companion.theory.plus_flights import subject_of

MILD, HARD = Member("mild", lag(1.25)), Member("hard", late(0.04), hard=True)
GOOD = PlusFindings(
    predictor_radius=0.9,
    radius=0.95,
    slowest_1_s=complex(-5.0, 7.0),
    unadapted_radius=0.94,
    cautious_radius=0.96,
    cautious_worst=("mild", 0.98),
    modulus=0.55,
    velocity_gain_s=0.7,
    lipschitz_1_s=0.3,
    planned_sigma_m_s2=0.2,
    sigma_m_s2=2.0,
    sigma_bound_m_s2=6.0,
    members=((MILD, 0.96, 0.4), (HARD, 0.98, 0.3)),
)


def judged(**changes):
    return {c.name: c for c in plus_conditions(replace(GOOD, **changes))}


def test_good_findings_fulfil_every_condition_without_a_word_of_caution():
    for condition in judged().values():
        assert condition.holds, condition
        assert condition.reason == condition.caution == ""


@pytest.mark.parametrize(
    ("changes", "name", "says"),
    [
        ({"predictor_radius": 1.0}, "predictor stable", "does not die away"),
        ({"radius": 1.01}, "sampled loop, as identified", "lower bandwidth_rad_s"),
        ({"unadapted_radius": 1.01}, "the same with σ̂ held", "switched off"),
        ({"cautious_radius": 1.01}, "the monitor's cautious variant", "`caution`"),
        ({"modulus": math.nan}, "modulus margin", "unstable"),
        ({"velocity_gain_s": 4.0}, "‖G‖ L < 1", "fly slower"),
        ({"velocity_gain_s": math.inf}, "‖G‖ L < 1", "unstable"),
        ({"planned_sigma_m_s2": 6.04}, "projection leaves σ free", "to 6.1 at least"),
        (
            {"members": ((MILD, 1.001, math.nan), (HARD, 0.98, 0.3))},
            "stable over the family",
            "unstable with mild",
        ),
    ],
)
def test_each_condition_fails_with_its_reason(changes, name, says):
    found = judged(**changes)
    assert [n for n, condition in found.items() if not condition.holds] == [name]
    assert says in found[name].reason


@pytest.mark.parametrize(
    ("changes", "name", "says"),
    [
        ({"modulus": 0.4}, "modulus margin", "below the usual guide of 0.5"),
        ({"cautious_worst": ("mild", 1.01)}, "the monitor's cautious variant", "mild"),
        ({"sigma_m_s2": 6.31}, "projection leaves σ free", "sigma_bound_m_s2 of 6.4"),
        (
            {"members": ((MILD, 0.96, 0.1), (HARD, 1.01, math.nan))},
            "stable over the family",
            "as long as nothing is learnt in flight. a modulus margin below 0.2 with mild",
        ),
    ],
)
def test_what_holds_but_barely_is_said_with_caution(changes, name, says):
    found = judged(**changes)
    assert all(condition.holds for condition in found.values())
    assert says in found[name].caution


def test_sigma_is_what_the_linear_drag_against_the_ground_leaves():
    subject = subject_of("bebop2")
    vehicle, dynamics = subject.vehicle, subject.dynamics
    still = sigma_bounds(vehicle, dynamics, Air(0.0, 0.0), vertical=False)
    speed = vehicle.speed_limit_m_s
    assert still.planned_m_s2 == pytest.approx(dynamics.quadratic_drag_1_m * speed**2)
    assert still.worst_m_s2 == pytest.approx(still.planned_m_s2)
    assert still.lipschitz_1_s == pytest.approx(2.0 * dynamics.quadratic_drag_1_m * speed)
    windy = sigma_bounds(vehicle, dynamics, Air(4.5, 12.0), vertical=False)
    assert windy.planned_m_s2 == still.planned_m_s2
    # Any wind and velocity within the limits stays below it.
    for v in (-speed, 0.0, speed):
        for w in (-4.5, 0.0, 4.5):
            against = v - w
            k1, k2 = dynamics.linear_drag_1_s, dynamics.quadratic_drag_1_m
            left = k1 * v - k1 * against - k2 * abs(against) * against
            assert abs(left) <= windy.worst_m_s2 + 1e-12
    assert windy.rate_m_s3 > still.rate_m_s3
