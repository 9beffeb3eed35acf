"""PX4's choice of an action when several things are wrong."""

from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.autopilot.px4.failsafe import Action, Cause, CauseNumber, Failsafe, mode_of
from sitl_shim.autopilot.px4.modes import Mode

_BATTERY = Cause("battery", Action.RETURN, CauseNumber.BATTERY_CRITICAL)
_WORSE = Cause("battery worse", Action.LAND, CauseNumber.BATTERY_EMERGENCY)
_FENCE = Cause("geofence", Action.HOLD, held=False, lasts=True)


class Flight:
    """A failsafe in OFFBOARD, in steps of a second."""

    def __init__(self, can_fly=lambda mode: True, hold_s=0.0):
        self.told = []
        self.guard = Failsafe(can_fly, lambda *what: self.told.append(what))
        self.hold_s = hold_s

    def step(self, *causes, fallback=Action.NONE, intended=Mode.OFFBOARD, chosen=False):
        return self.guard.step(
            causes, fallback, intended, chosen=chosen, hold_s=self.hold_s, passed_s=1.0
        )


actions = st.sampled_from(list(Action))
causes = st.builds(
    Cause, key=st.sampled_from("abc"), action=actions, held=st.just(False), lasts=st.booleans()
)


@settings(deadline=None, derandomize=True)
@given(
    st.lists(
        st.tuples(st.lists(causes, max_size=3, unique_by=lambda c: c.key), actions), max_size=6
    )
)
def test_nothing_milder_flies_than_the_worst_that_is_wrong_now(course):
    flight = Flight()
    for wrong, fallback in course:
        worst = max([fallback, *(cause.action for cause in wrong)])
        assert flight.step(*wrong, fallback=fallback) >= worst


@settings(deadline=None, derandomize=True)
@given(actions, st.sets(st.sampled_from(list(Mode))))
def test_what_cannot_be_flown_gives_way_to_something_worse_that_can(action, modes):
    flown = Flight(can_fly=lambda mode: mode in modes).step(fallback=action)
    assert flown >= action
    if Action.POSITION <= flown <= Action.LAND:
        assert mode_of(flown) in modes
    elif flown is not action:
        assert flown is Action.DESCEND
        assert not {mode_of(other) for other in Action if action <= other <= Action.LAND} & modes


def test_what_is_over_is_over_unless_it_lasts_until_a_mode_is_chosen():
    flight = Flight()
    assert flight.step(_BATTERY) is Action.RETURN
    assert flight.step() is Action.NONE
    assert flight.step(_FENCE) is Action.HOLD
    assert flight.step() is Action.HOLD
    assert flight.step(chosen=True) is Action.NONE
    assert flight.guard.idle


def test_it_holds_first_and_says_so_and_then_acts_and_says_so():
    flight = Flight(hold_s=2.0)
    assert [flight.step(_BATTERY) for _ in range(4)] == [
        Action.HOLD,
        Action.HOLD,
        Action.RETURN,
        Action.RETURN,
    ]
    number = CauseNumber.BATTERY_CRITICAL
    assert flight.told == [
        (Action.HOLD, Action.RETURN, number),
        (Action.RETURN, Action.NONE, number),
    ]


def test_it_does_not_hold_where_it_cannot_or_when_it_acts_already():
    flight = Flight(can_fly=lambda mode: mode is not Mode.AUTO_LOITER, hold_s=5.0)
    assert flight.step(_BATTERY) is Action.RETURN
    flight = Flight(hold_s=0.0)
    flight.step(_BATTERY)
    flight.hold_s = 5.0
    assert flight.step(_BATTERY, _WORSE) is Action.LAND


def test_who_chooses_a_mode_while_it_acts_takes_over_until_something_new_is_wrong():
    flight = Flight()
    flight.step(_BATTERY)
    assert flight.step(_BATTERY, chosen=True) is Action.WARN
    assert flight.step(_BATTERY) is Action.WARN
    assert not flight.guard.active
    assert flight.step(_BATTERY, _WORSE) is Action.LAND


def test_a_takeover_does_not_give_a_mode_what_it_lacks():
    flight = Flight()
    flight.step(_BATTERY)
    taken = flight.step(_BATTERY, fallback=Action.DESCEND, chosen=True)
    assert taken is Action.DESCEND


def test_a_vehicle_that_lands_does_not_return():
    assert Flight().step(_BATTERY, intended=Mode.AUTO_LAND) is Action.WARN
