"""The judge: a flight that keeps all its promises passes, and each broken one is told."""

from dataclasses import replace

import numpy as np
import pytest

from companion.experiments.faults.endings import ending_of, touchdown_m_s
from companion.experiments.faults.evidence import Begun, Said, TruePath
from companion.experiments.faults.judging import judge
from companion.experiments.faults.wire_log import Commanded
from companion.mavlink.commands import CommandId
from tests.companion.experiments.faults.synthetic import (
    FAULT_S,
    LIMITS,
    PROMISE,
    evidence,
    heights,
    path,
    setpoints,
)

TIMES_S = np.arange(0.0, 24.0, 0.01)


def broken(promise=PROMISE, **changes):
    return judge(promise, evidence(**changes), LIMITS).broken


def arming(*times_s):
    return tuple(
        Commanded(time_s, CommandId.COMPONENT_ARM_DISARM, (1.0, 0, 0)) for time_s in times_s
    )


def promising(**changes):
    return PROMISE.model_copy(update=changes)


def sent(**changes):
    """Setpoints of which the one at the fault is another."""
    good = setpoints(np.arange(5.0, 16.0, 0.01))
    for name, value in changes.items():
        values = getattr(good, name).copy()
        values[500] = value
        good = replace(good, **{name: values})
    return good


def test_a_flight_that_keeps_all_its_promises_passes():
    judgement = judge(PROMISE, evidence(), LIMITS)
    assert judgement.broken == ()
    assert judgement.passed
    measured = judgement.measured
    assert measured.detected_after_s == pytest.approx(0.2)
    assert measured.detected_by == "the estimate has jumped by 0.3 m"
    assert measured.mean_error_mm == pytest.approx(20.0)
    assert measured.touchdown_m_s == pytest.approx(0.5, abs=0.01)
    assert (measured.late_setpoints, measured.arm_commands) == (0, 1)


# What every flight promises


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"finite": False}, "1 setpoints are not finite"),
        ({"thrust": 1.01}, "a thrust or a body rate is out of bounds"),
        ({"thrust": -0.01}, "a thrust or a body rate is out of bounds"),
        ({"rate_rad_s": 13.0}, "a thrust or a body rate is out of bounds"),
        ({"tilt_rad": np.radians(30.2)}, "a tilt of 30.2° was commanded, and 30.0° is the limit"),
        ({"state_age_s": 0.11}, "a setpoint was based on a state 110 ms old, and 100 ms is the"),
    ],
)
def test_one_bad_setpoint_is_enough(changes, says):
    assert [sentence.startswith(says) for sentence in broken(sent=sent(**changes))] == [True]


def test_a_level_setpoint_needs_no_fresh_state():
    assert broken(sent=sent(state_age_s=3.0, tilt_rad=0.0)) == ()


def test_no_setpoint_after_a_takeover():
    assert broken(taken_over_s=15.9) == ("6 setpoints were sent after a takeover",)


def test_what_is_on_its_way_when_somebody_takes_over_does_not_count():
    assert broken(taken_over_s=15.97) == ()


@pytest.mark.parametrize(
    ("command_id", "name"),
    [
        (CommandId.DO_SET_MODE, "DO_SET_MODE"),
        (CommandId.NAV_TAKEOFF, "NAV_TAKEOFF"),
        (21, "command 21"),  # NAV_LAND
        (CommandId.COMPONENT_ARM_DISARM, "COMPONENT_ARM_DISARM"),
    ],
)
def test_no_command_after_a_takeover(command_id, name):
    def told(time_s):
        late = Commanded(time_s, command_id, (0.0, 0.0, 0.0))
        return broken(others_s=12.0, commands=(*arming(0.5), late))

    assert told(12.1) == (f"1 commands were sent after a takeover: {name}",)
    assert told(12.02) == ()  # it was on its way


def test_messages_may_be_asked_for_after_a_takeover():
    asked = Commanded(13.0, CommandId.SET_MESSAGE_INTERVAL, (32.0, 1e4, 0.0))
    assert broken(others_s=12.0, commands=(*arming(0.5), asked)) == ()


def test_commands_to_a_vehicle_that_nobody_else_has_taken_are_the_companions_own():
    landing = Commanded(16.5, CommandId.DO_SET_MODE, (1.0, 4.0, 6.0))
    assert broken(commands=(*arming(0.5), landing)) == ()


def test_a_vehicle_is_not_armed_again():
    assert broken(disarmed_s=12.0, commands=arming(0.5, 12.5)) == (
        "it was commanded to arm again, 1 times",
    )


def test_asking_again_before_it_has_disarmed_is_no_second_arming():
    assert broken(commands=arming(0.5, 0.8, 1.02)) == ()


def test_what_is_known_to_be_armed_is_not_armed_again():
    assert broken(commands=arming(0.5, 0.8, 1.1)) == ("it was commanded to arm again, 1 times",)
    assert broken(armed_s=None, commands=arming(0.5, 0.8, 1.1)) == ()


@pytest.mark.parametrize("event", ["disarm", "reboot"])
def test_what_has_truly_disarmed_is_not_armed_again_whether_that_is_known_or_not(event):
    begun = (*evidence().begun, Begun(0.7, event, 1.0))
    told = broken(begun=begun, commands=arming(0.5, 0.8), armed_s=None, disarmed_s=None)
    assert told == ("it was commanded to arm again, 1 times",)


# Endings


def test_a_flight_that_the_companion_did_not_land_was_handed_over():
    changed = evidence(outcome="aborted")
    assert ending_of(changed) == "handed over"
    (sentence,) = broken(outcome="aborted", note="why")
    assert sentence == "it ended as 'handed over', not landed (why)"


def test_a_vehicle_that_stays_where_it_is_was_held():
    held = path(TIMES_S, np.interp(TIMES_S, [1.0, 4.0], [0.0, 2.5]))
    assert ending_of(evidence(path=held)) == "held"


def test_a_vehicle_that_sinks_slowly_is_brought_down():
    sinking = path(TIMES_S, np.interp(TIMES_S, [1.0, 4.0, 22.0, 26.0], [0.0, 2.5, 2.5, 0.5]))
    assert ending_of(evidence(path=sinking)) == "handed over"


def test_a_vehicle_that_flies_away_is_promised_by_nobody():
    height = np.interp(TIMES_S, [1.0, 4.0], [0.0, 2.5])
    away = path(TIMES_S, height, sideways_m=np.interp(TIMES_S, [10.0, 24.0], [0.0, 14.0]))
    assert ending_of(evidence(path=away)) == "drifting"


@pytest.mark.parametrize(("speed_m_s", "ending"), [(1.9, "landed"), (2.1, "crashed")])
def test_how_fast_it_meets_the_ground_decides(speed_m_s, ending):
    fall = path(TIMES_S, np.interp(TIMES_S, [1, 4, 16, 16 + 2.5 / speed_m_s], [0, 2.5, 2.5, 0]))
    assert touchdown_m_s(fall) == pytest.approx(speed_m_s, rel=0.01)
    assert ending_of(evidence(path=fall)) == ending


@pytest.mark.parametrize(("speed_m_s", "ending"), [(1.9, "landed"), (2.1, "crashed")])
def test_a_slide_at_the_ground_is_a_crash(speed_m_s, ending):
    sideways = np.interp(TIMES_S, [16.0, 21.0], [0.0, 5.0 * speed_m_s])
    flown = path(TIMES_S, heights(TIMES_S), sideways_m=sideways)
    assert ending_of(evidence(path=flown)) == ending


def in_the_end(rates_m_s, lasts_s, sideways_m_s=0.0):
    """In the air until the watch ends, with another motion at last."""
    end = TIMES_S[-1] - lasts_s
    height = np.interp(TIMES_S, [1.0, 4.0], [0.0, 9.0])
    height = height - rates_m_s * np.clip(TIMES_S - end, 0.0, None)
    return path(TIMES_S, height, sideways_m=sideways_m_s * np.clip(TIMES_S - end, 0.0, None))


@pytest.mark.parametrize(
    ("flown", "ending"),
    [
        (in_the_end(1.4, 3.0), "handed over"),
        (in_the_end(1.6, 3.0), "drifting"),
        (in_the_end(4.0, 0.2), "drifting"),  # it has begun to fall
        (in_the_end(0.5, 3.0, sideways_m_s=0.9), "handed over"),
        (in_the_end(0.5, 3.0, sideways_m_s=1.1), "drifting"),
    ],
)
def test_who_brings_it_down_does_so_slowly_and_upright(flown, ending):
    assert ending_of(evidence(path=flown)) == ending


def test_a_vehicle_that_went_far_away_was_not_flown_as_promised():
    sideways = np.interp(TIMES_S, [5.0, 16.0], [0.0, 51.0])
    flown = path(TIMES_S, heights(TIMES_S), sideways_m=sideways)
    assert broken(path=flown) == ("it went 51 m from home, and 50 m is far",)
    there_and_back = np.interp(TIMES_S, [5.0, 10.0, 16.0], [0.0, 51.0, 0.0])
    flown = path(TIMES_S, heights(TIMES_S), sideways_m=there_and_back)
    assert len(broken(path=flown)) == 1


@pytest.mark.parametrize("until", ["taken over", "handed over", "disarm", "over"])
def test_the_true_tilt_stays_near_the_limit_as_long_as_the_companion_flies(until):
    def told(over_s):
        tilt_rad = np.where((TIMES_S > 9.0) & (TIMES_S < 9.5), np.radians(41.0), 0.05)
        flown = evidence(path=path(TIMES_S, heights(TIMES_S), tilt_rad=tilt_rad))
        changes = {
            "taken over": {"taken_over_s": over_s, "sent": setpoints(np.arange(5.0, over_s, 0.01))},
            "handed over": {"phases": (*flown.phases, (over_s, "handed over"))},
            "disarm": {"begun": (*flown.begun, Begun(over_s, "disarm", 1.0))},
            "over": {"ended_s": over_s},
        }
        return judge(PROMISE, replace(flown, **changes[until]), LIMITS).broken

    assert told(9.2) == ("it tilted by 41.0° while the companion flew it, and 30.0° is the limit",)
    assert told(8.9) == ()


def test_a_true_tilt_a_little_beyond_the_limit_is_a_swing():
    flown = path(TIMES_S, heights(TIMES_S), tilt_rad=np.radians(39.0))
    assert broken(path=flown) == ()


def test_a_bounce_does_not_hide_the_first_touch():
    height = np.interp(TIMES_S, [1, 4, 16, 17, 17.2, 17.6], [0, 2.5, 2.5, 0, 0.1, 0])
    assert ending_of(evidence(path=path(TIMES_S, height))) == "crashed"


def test_a_vehicle_that_topples_has_crashed():
    tilt_rad = np.where(TIMES_S > 16.5, np.radians(61.0), 0.05)
    toppled = path(TIMES_S, heights(TIMES_S), tilt_rad=tilt_rad)
    assert ending_of(evidence(path=toppled)) == "crashed"
    assert broken(promising(endings=("crashed",)), path=toppled) == ()


def test_a_vehicle_that_never_left_the_ground_was_not_flown():
    assert ending_of(evidence(path=path(TIMES_S, np.full(len(TIMES_S), 0.001)))) == "not flown"
    nothing = TruePath(np.empty(0), np.empty((0, 3)), np.empty((0, 3)), np.empty(0))
    (sentence,) = broken(path=nothing)
    assert sentence.startswith("it ended as 'not flown'")


# What a row promises besides


def test_the_trajectory_is_flown_to_its_end():
    assert broken(completed=False) == ("the trajectory was not flown to its end",)
    assert broken(promising(completed=False)) == ("the trajectory was flown to its end",)


def test_a_fault_that_did_not_begin_proves_nothing():
    told = broken(begun=())
    assert told[0] == "the fault did not begin: the truth tells of no 'jump'"
    assert told[1] == "it was told of 'has jumped' never, not within 0.5 s"


def test_a_fault_is_seen_in_time():
    late = (*evidence().said[:1], Said(FAULT_S + 0.6, "warning", "the estimate has jumped"))
    assert broken(promising(autopilot_says=None), said=late) == (
        "it was told of 'has jumped' after 0.60 s, not within 0.5 s",
    )


def test_another_word_in_time_is_not_the_one_that_is_promised():
    said = (
        Said(FAULT_S + 0.1, "warning", "the battery is old"),
        Said(FAULT_S + 2.0, "warning", "the estimate has jumped"),
        *evidence().said[2:],
    )
    assert broken(said=said) == ("it was told of 'has jumped' after 2.00 s, not within 0.5 s",)
    assert broken(promising(says=None), said=said) == ()  # where none is named, any will do


def test_a_fault_that_nobody_tells_of_is_not_seen():
    told = broken(promising(says=None), said=evidence().said[2:])
    assert told == ("it was seen never, not within 0.5 s",)


def test_a_hand_over_comes_in_time():
    def handed_over(after_s):
        phases = (*evidence().phases, (FAULT_S + after_s, "handed over"))
        return broken(promising(handed_over_within_s=2.0), phases=phases)

    assert handed_over(1.9) == ()
    assert handed_over(2.1) == ("it was handed over after 2.10 s, not within 2 s",)
    assert handed_over(-1.0) == ("it was handed over never, not within 2 s",)
    assert judge(PROMISE, evidence(), LIMITS).passed


def test_a_warning_from_before_the_fault_does_not_count():
    early = (*evidence().said[2:], Said(FAULT_S - 0.1, "error", "the estimate has jumped"))
    assert broken(said=early) == (
        "it was told of 'has jumped' never, not within 0.5 s",
        "the companion did not say 'has jumped'",
    )


def test_a_word_that_overtakes_the_truth_comes_at_once():
    said = (*evidence().said[2:], Said(FAULT_S - 0.02, "error", "the estimate has jumped"))
    judgement = judge(PROMISE, evidence(said=said), LIMITS)
    assert judgement.passed
    assert judgement.measured.detected_after_s == 0.0


def test_mere_information_counts_if_it_says_what_is_promised():
    said = (*evidence().said[2:], Said(FAULT_S + 0.1, "info", "the estimate has jumped"))
    assert broken(said=said) == ()
    other = (*evidence().said[2:], Said(FAULT_S + 0.1, "info", "phase hover"))
    assert "it was told of 'has jumped' never, not within 0.5 s" in broken(said=other)


def test_what_the_autopilot_says_is_not_the_companions_word():
    said = (
        *evidence().said[2:],
        Said(FAULT_S + 0.1, "warning", "the autopilot says: the estimate has jumped"),
    )
    assert broken(said=said) == (
        "it was told of 'has jumped' never, not within 0.5 s",
        "the companion did not say 'has jumped'",
    )


def test_the_autopilot_says_what_is_promised_of_it():
    assert broken(promising(autopilot_says="Battery")) == ("the autopilot did not say 'Battery'",)


@pytest.mark.parametrize(
    ("limit", "says"),
    [
        ({"mean_error_mm": 19.9}, "the mean error is 20 mm, not at most 19.9 mm"),
        ({"worst_error_mm": 19.9}, "the worst error is 20 mm, not at most 19.9 mm"),
    ],
)
def test_errors_are_within_what_is_promised(limit, says):
    assert broken(promising(**limit)) == (says,)


def test_an_error_that_nobody_knows_is_not_within_bounds():
    nothing = evidence().tracked
    nothing = replace(nothing, scored=np.zeros(len(nothing.time_s), dtype=bool))
    assert len(broken(tracked=nothing)) == 2


def test_the_first_of_several_events_of_a_name_counts():
    twice = (Begun(FAULT_S + 5.0, "jump", 1.0), Begun(FAULT_S, "jump", 0.3))
    assert judge(PROMISE, evidence(begun=twice), LIMITS).measured.detected_after_s < 0.3
