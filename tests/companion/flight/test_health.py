"""What our own heartbeat says: the worst since the one before, and nothing better than is true."""

from companion.flight.vehicle.health import Health
from companion.mavlink.messages import VehicleStateOfHealth as State


def test_before_anything_it_stands_by():
    assert Health().say() is State.STANDBY


def test_a_controller_that_is_well_is_active():
    health = Health()
    health.active()
    assert [health.say(), health.say()] == [State.ACTIVE, State.ACTIVE]


def test_one_bad_tick_among_many_is_told_once():
    health = Health()
    for troubled in (False, True, False, False):
        health.active(troubled=troubled)
    assert [health.say(), health.say()] == [State.CRITICAL, State.ACTIVE]


def test_trouble_that_lasts_is_told_each_time():
    health = Health()
    for _ in range(3):
        health.active(troubled=True)
        assert health.say() is State.CRITICAL


def test_a_hand_over_is_an_emergency_until_somebody_flies_or_lands():
    health = Health()
    health.active(troubled=True)
    health.emergency()
    assert [health.say(), health.say()] == [State.EMERGENCY, State.EMERGENCY]
    health.active()
    assert health.say() is State.ACTIVE
    health.emergency()
    health.standby()
    assert health.say() is State.STANDBY


def test_what_was_wrong_before_standing_by_is_not_told_after():
    health = Health()
    health.active(troubled=True)
    health.standby()
    health.active()
    assert health.say() is State.ACTIVE
