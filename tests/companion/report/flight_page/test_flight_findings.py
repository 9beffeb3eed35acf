"""What stands out in a flight's records."""

import numpy as np
import pytest

from companion.report.flight_page.findings import find, first_words, lasting_s
from tests.companion.report.flight_page.made_up_story import (
    LIMITS,
    message,
    result,
    story,
    where,
)

TIMES = story().data.ticks.time_s


def found(made, **changes):
    return find(made, result(**changes), LIMITS)


def texts(made, **changes):
    return [finding.text for finding in found(made, **changes)]


def test_in_a_good_flight_nothing_stands_out():
    assert found(story()) == ()


def test_a_fallback_is_told_with_its_length_its_kind_and_the_supervisors_reason():
    fallen = where(TIMES, 10.0, 10.5) | where(TIMES, 12.0, 12.25)
    reason = "no usable state for more than 100 ms (the newest sample is {} ms old)"
    reasons = np.where(fallen, np.where(TIMES < 11.0, reason.format(109), reason.format(118)), "")
    made = story(
        on_fallback=fallen,
        said={"fallback": np.where(fallen, "shifted_plan", ""), "reason": reasons},
    )
    (text,) = texts(made)
    assert text == (
        "2 times on a fallback, 0.75 s in all (shifted plan). The supervisor said: "
        "no usable state for more than 100 ms."
    )


def test_lost_samples_are_counted_and_weigh_when_they_are_older_than_the_limit():
    ticks = story().data.ticks
    kept = ~where(TIMES, 10.0, 10.06)
    short = _without(ticks, kept)
    (finding,) = found(short)
    assert finding.level == "none"
    assert "1 time: about 6 samples of one in 10 ms, for 70 ms at the longest" in finding.text
    (finding,) = found(_without(ticks, ~where(TIMES, 10.0, 10.3)))
    assert finding.level == "half"


def _without(ticks, kept):
    from companion.report.flight_data import FlightData, Ticks
    from tests.companion.report.synthetic_flight import NO_TRUTH

    fields = {name: getattr(ticks, name) for name in Ticks.__slots__ if name != "watched"}
    return story(data=FlightData(Ticks(**{k: v[kept] for k, v in fields.items()}), NO_TRUTH))


@pytest.mark.parametrize(("length_s", "told"), [(0.15, False), (0.5, True)])
def test_a_tilt_that_is_cut_off_is_told_from_a_fifth_of_a_second_on(length_s, told):
    asked = np.zeros((len(TIMES), 3))
    asked[where(TIMES, 10.0, 10.0 + length_s), 0] = 0.9
    given = np.clip(asked, -0.57, 0.57)
    said = texts(story(u=asked, applied_u=given))
    assert [text for text in said if "tilt command was cut off for 0.5 s" in text] == said
    assert bool(said) is told


def test_thrust_at_its_ends_and_a_climb_rate_that_is_cut_off_are_told():
    high, low = where(TIMES, 10.0, 11.0), where(TIMES, 12.0, 12.5)
    thrust = np.where(high, 0.95, np.where(low, 0.08, 0.5))
    said = texts(story(thrust=thrust))
    assert said == [
        "Thrust stood at its highest value, 0.95, for 1.0 s.",
        "Thrust stood at its lowest value, 0.08, for 0.5 s.",
    ]
    # Where the field is a climb rate there is no hover thrust, and no such end.
    assert texts(story(thrust=thrust, hover_thrust=np.full(len(TIMES), np.nan))) == []
    asked = np.zeros((len(TIMES), 3))
    asked[high, 2] = 3.0
    assert texts(story(u=asked, applied_u=np.minimum(asked, 1.5))) == [
        "The climb rate asked for was cut off for 1.0 s."
    ]


def test_an_estimate_at_its_bound_is_told():
    (text,) = texts(story(projecting=where(TIMES, 10.0, 14.0)))
    assert text.startswith("σ̂ stood at its bound for 4.0 s")


def test_the_monitor_and_hand_overs_that_nobody_planned_weigh():
    state = np.where(where(TIMES, 10.0, 12.0), "reduced", "nominal")
    changes = [
        {"t_s": 5.0, "controller": "l1-off", "cause": "switch", "handed_over": True, "text": "a"},
        {"t_s": 7.0, "controller": "pid", "cause": "monitor", "handed_over": True, "text": "b"},
    ]
    said = found(story(said={"monitor": state}), controller_changes=changes)
    assert [(f.level, f.text) for f in said] == [
        ("half", "The in-flight monitor was at reduced for 2.0 s."),
        ("half", "7.0 s after the trajectory's start: b."),
        ("none", "5.0 s after the trajectory's start: a."),
    ]


@pytest.mark.parametrize(("missed", "level"), [(0, None), (15, "none"), (16, "half")])
def test_late_setpoints_weigh_from_one_in_two_hundred(missed, level):
    said = found(story(), missed_deadlines=missed)
    assert [f.level for f in said] == ([] if level is None else [level])


def test_clipped_plans_and_packets_that_were_not_read_are_told():
    said = texts(story(), r_max_active_share=0.8, rejected_packets={"unsigned": 3})
    assert "r_max was active in 80%" in said[0]
    assert said[1] == "Packets were not read for their signature: 3 unsigned."
    assert texts(story(), r_max_active_share=0.5, rejected_packets={"unsigned": 0}) == []


def test_what_the_autopilot_warned_of_is_told_once_each():
    said = "the autopilot says: "
    made = story(
        messages=[
            message(said + "Battery low"),
            message(said + "Battery low"),
            message(said + "Failsafe", "error"),
            message(said + "Takeoff detected", "info"),
            message("handing over", "error"),
        ]
    )
    assert texts(made) == ["The autopilot said: Battery low; Failsafe."]


def test_every_finding_says_from_when_on_it_is_told():
    fallen = where(TIMES, 10.0, 10.5)
    made = story(on_fallback=fallen, projecting=fallen, messages=[message("the autopilot says: x")])
    said = found(made, missed_deadlines=1, r_max_active_share=0.9)
    assert len(said) == 5
    assert all(finding.told_from.startswith("Told ") for finding in said)


def test_a_gap_is_not_counted_as_lasting():
    times = np.array([0.0, 0.01, 0.02, 0.03, 5.0, 5.01])
    assert lasting_s(times, np.array([0, 0, 0, 1, 0, 0], dtype=bool)) == pytest.approx(0.035)
    assert lasting_s(times[:1], np.ones(1, dtype=bool)) == 0.0


def test_reasons_that_differ_by_figures_are_told_once():
    reasons = ["0.6 m outside (a)", "", "0.6 m outside, for 0.8 s", "lost"]
    assert first_words(np.array(reasons)) == "0.6 m outside; lost"
