"""The stack for what the autopilot makes of the thrust field."""

import pytest

from companion.config.resolve import load_flight
from companion.control.thrust_laws import ClimbRateField, CollectiveThrust, VerticalThrust
from companion.flight.assemble import make_stack
from companion.thrust_meaning import ThrustMeaning

CLIMB_RATE = ThrustMeaning("climb_rate", climb_m_s=2.5, descent_m_s=1.0)


def stack(meaning=None, **changes):
    config = load_flight(None, {}, changes)
    kind = {} if meaning is None else {"thrust": meaning}
    return make_stack(config.controller, config.vehicle, config.mission, **kind)


def test_each_meaning_has_its_law():
    assert isinstance(stack().thrust, CollectiveThrust)
    assert isinstance(stack(ThrustMeaning("vertical")).thrust, VerticalThrust)
    assert stack(CLIMB_RATE).thrust == ClimbRateField(2.5, 1.0)


def test_the_stack_asks_for_no_climb_rate_that_the_field_can_not_say():
    limits = stack(CLIMB_RATE).limits
    vehicle = load_flight(None, {}, {}).vehicle
    assert limits.descent_m_s == 1.0 < vehicle.descent_limit_m_s
    assert limits.climb_m_s == vehicle.climb_limit_m_s


def test_over_the_autopilots_loop_the_vertical_axis_has_gains_of_its_own():
    ours, theirs = stack(), stack(CLIMB_RATE)
    z = load_flight(None, {}, {}).controller.l1.climb_rate
    assert theirs.inner.gains.gain_k == (*ours.inner.gains.gain_k[:2], z.k)
    assert theirs.inner.gains.gamma == (*ours.inner.gains.gamma[:2], z.gamma)
    assert theirs.inner.gains.reference_model[:2] == ours.inner.gains.reference_model[:2]
    assert theirs.inner.gains.reference_model[2] != ours.inner.gains.reference_model[2]
    assert theirs.outer.model.m == (*ours.outer.model.m[:2], z.m)


@pytest.mark.parametrize("meaning", [None, ThrustMeaning("vertical")])
def test_over_our_own_loop_it_has_not(meaning):
    assert stack(meaning).inner.gains == stack().inner.gains


def test_without_them_the_gains_are_those_of_all_meanings():
    plain = stack(CLIMB_RATE, **{"controller.l1.climb_rate": "null"})
    assert plain.inner.gains == stack().inner.gains
