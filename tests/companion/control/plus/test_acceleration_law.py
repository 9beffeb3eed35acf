"""Vertical acceleration asked of the thrust directly."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control import thrust
from companion.control.thrust import GRAVITY_M_S2, ThrustGains
from companion.control.thrust_laws import CollectiveThrust, VerticalThrust

GAINS = ThrustGains(4.0, 1.0, 0.5, 0.3, 0.1, 0.9, 4.0, 0.01, 0.2)
COLLECTIVE = CollectiveThrust(GAINS)
VERTICAL = VerticalThrust(COLLECTIVE)

accelerations = st.floats(-12.0, 12.0)
climb_rates = st.floats(-2.0, 2.0)
cosines = st.floats(0.5, 1.0)
samples = st.lists(st.tuples(accelerations, climb_rates, cosines), min_size=1, max_size=20)


@settings(deadline=None, derandomize=True)
@given(samples)
def test_what_it_says_is_left_is_what_the_field_makes(flown):
    """By the hover thrust that it reckons with, also where the field is at a limit."""
    memory = COLLECTIVE.start(0.0)
    for wanted, climb, cosine in flown:
        memory, field, left = COLLECTIVE.accelerate(memory, wanted, climb, cosine, 0.01)
        assert GAINS.minimum_thrust - 1e-9 <= field <= GAINS.maximum_thrust + 1e-9
        force = thrust.force_from_thrust(field, GAINS.thrust_curve) * cosine
        made = GRAVITY_M_S2 * (force / memory.hover_force - 1.0)
        assert left == pytest.approx(made, abs=1e-6)
        inside = GAINS.minimum_thrust + 1e-6 < field < GAINS.maximum_thrust - 1e-6
        assert memory.saturated == (not inside)
        if inside:
            assert left == pytest.approx(wanted, abs=1e-9)
        else:
            assert abs(left - wanted) > 0.0


@settings(deadline=None, derandomize=True)
@given(samples)
def test_what_acts_is_the_same_whoever_compensates_the_tilt(flown):
    here, there = COLLECTIVE.start(0.0), VERTICAL.start(0.0)
    for wanted, climb, cosine in flown:
        here, along, left = COLLECTIVE.accelerate(here, wanted, climb, cosine, 0.01)
        there, vertical, left_there = VERTICAL.accelerate(there, wanted, climb, cosine, 0.01)
        acts = thrust.force_from_thrust(along, GAINS.thrust_curve) * cosine
        boosted = thrust.force_from_thrust(vertical, GAINS.thrust_curve)  # over the cosine, there
        assert acts == pytest.approx(boosted, rel=1e-9)
        assert left == left_there
    assert here == there


@pytest.mark.parametrize("law", [COLLECTIVE, VERTICAL])
def test_the_hover_thrust_is_found_under_changing_accelerations(law):
    memory, force, climb = law.start(0.0), 0.5, 0.0
    hover = thrust.force_from_thrust(0.57, GAINS.thrust_curve)
    for k in range(3000):
        wanted = -1.0 * climb + (0.5 if k // 100 % 2 else -0.5)
        memory, field, _ = law.accelerate(memory, wanted, climb, 1.0, 0.01)
        force += 0.01 * (thrust.force_from_thrust(field, GAINS.thrust_curve) - force) / 0.04
        climb += 0.01 * GRAVITY_M_S2 * (force / hover - 1.0)
    assert law.hover_thrust(memory) == pytest.approx(0.57, rel=0.02)


def test_the_climb_rate_loop_takes_over_as_if_nothing_had_been_asked_of_it():
    memory = COLLECTIVE.start(0.0)
    for _ in range(50):
        memory, _, _ = COLLECTIVE.accelerate(memory, 2.0, 0.0, 1.0, 0.01)
    assert memory.integral_m_s2 == 0.0
