"""What the thrust field means: one law for each meaning, tilt compensated exactly once."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.thrust import GRAVITY_M_S2, ThrustGains
from companion.control.thrust_laws import ClimbRateField, CollectiveThrust, VerticalThrust

GAINS = ThrustGains(4.0, 1.0, 0.5, 0.0, 0.1, 0.9, 4.0, 0.01, 0.2)
COLLECTIVE = CollectiveThrust(GAINS)
VERTICAL = VerticalThrust(COLLECTIVE)
FIELD = ClimbRateField(climb_m_s=2.5, descent_m_s=1.5)
LAWS = [COLLECTIVE, VERTICAL, FIELD]

climb_rates = st.floats(-3.0, 3.0)
cosines = st.floats(0.5, 1.0)
samples = st.lists(st.tuples(climb_rates, climb_rates, cosines), min_size=1, max_size=30)


@settings(deadline=None, derandomize=True)
@given(samples)
def test_what_acts_is_the_same_whoever_compensates_the_tilt(flown):
    """One divides by the cosine here, the other leaves it to the autopilot: never both."""
    here, there = COLLECTIVE.start(0.0), VERTICAL.start(0.0)
    for command, climb, cosine in flown:
        here, along_body = COLLECTIVE.step(here, command, climb, cosine, 0.01)
        there, vertical = VERTICAL.step(there, command, climb, cosine, 0.01)
        boosted = vertical / cosine  # by the autopilot
        assert boosted == pytest.approx(along_body, rel=1e-9)
        assert along_body * cosine == pytest.approx(vertical, rel=1e-9)
    assert here == there


@settings(deadline=None, derandomize=True)
@given(cosines)
def test_at_rest_the_vertical_force_is_the_weight_at_any_tilt(cosine):
    hover = GAINS.hover_thrust
    _, along_body = COLLECTIVE.step(COLLECTIVE.start(0.0), 0.0, 0.0, cosine, 0.01)
    _, vertical = VERTICAL.step(VERTICAL.start(0.0), 0.0, 0.0, cosine, 0.01)
    assert along_body == pytest.approx(min(hover / cosine, GAINS.maximum_thrust))
    assert vertical == pytest.approx(min(hover, GAINS.maximum_thrust * cosine))


@pytest.mark.parametrize("law", LAWS)
@settings(deadline=None, derandomize=True)
@given(samples)
def test_every_field_is_one(law, flown):
    memory = law.start(0.0)
    for command, climb, cosine in flown:
        memory, field = law.step(memory, command, climb, cosine, 0.01)
        assert 0.0 <= field <= 1.0
        assert 0.0 <= law.hold(memory, climb, cosine) <= 1.0


@settings(deadline=None, derandomize=True)
@given(climb_rates, climb_rates, cosines)
def test_a_climb_rate_field_asks_for_the_very_climb_rate(command, climb, cosine):
    _, field = FIELD.step(FIELD.start(climb), command, climb, cosine, 0.01)
    scale = FIELD.climb_m_s if field > 0.5 else FIELD.descent_m_s
    understood = (field - 0.5) * 2.0 * scale  # by ArduCopter
    clipped = max(-FIELD.descent_m_s, min(FIELD.climb_m_s, command))
    assert understood == pytest.approx(clipped, abs=1e-9)


def test_holding_is_no_climb_rate():
    assert FIELD.hold(FIELD.start(0.0), 2.0, 0.8) == 0.5
    assert FIELD.step(None, 0.0, 0.3, 0.9, 0.01) == (None, 0.5)
    assert math.isnan(FIELD.hover_thrust(None))


def test_holding_a_force_works_against_a_climb_rate():
    for law in (COLLECTIVE, VERTICAL):
        memory = law.start(0.0)
        assert law.hold(memory, 0.5, 1.0) < GAINS.hover_thrust < law.hold(memory, -0.5, 1.0)


@pytest.mark.parametrize("law", [COLLECTIVE, VERTICAL])
def test_the_hover_thrust_survives_a_new_start(law):
    memory, force, climb = law.start(0.0), 0.5, 0.0
    for _ in range(3000):
        memory, field = law.step(memory, 0.0, climb, 1.0, 0.01)
        force += 0.01 * (field - force) / 0.04
        climb += 0.01 * GRAVITY_M_S2 * (force / 0.57 - 1.0)
    assert law.hover_thrust(memory) == pytest.approx(0.57, rel=0.02)
    again = law.start(0.0, memory)
    assert law.hover_thrust(again) == law.hover_thrust(memory)
    assert law.hover_thrust(law.start(0.0)) == pytest.approx(GAINS.hover_thrust)
