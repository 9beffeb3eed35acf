"""The sentence at the top: did it track, and if not why; and where on the path something was."""

from dataclasses import replace

import numpy as np
import pytest

from companion.mavlink.truth_events import TruthEvent
from companion.report.flight_data import FlightData
from companion.report.flight_page.answer import answer, find_peak, tracked_s
from companion.report.flight_page.findings import Finding
from companion.report.flight_page.place import place_on_path
from companion.report.flight_page.story import Phase
from tests.companion.report.flight_page.made_up_story import SCORED_S, result, story
from tests.companion.report.synthetic_flight import circle, make_flight

TIMES = np.arange(0.0, 20.0, 0.01)


def with_peak(at_s, *, wind_m_s2=0.0, event=None):
    """10 mm off, but 57.6 mm at one time."""
    data = make_flight(true_offset_m=(0.01, 0.0, 0.0))
    truth = data.truth
    position = circle(truth.time_s) + np.array([0.01, 0.0, 0.0])
    k = int(np.argmin(np.abs(truth.time_s - at_s)))
    position[k] = circle(truth.time_s[k : k + 1])[0] + np.array([0.0, 0.0576, 0.0])
    events = () if event is None else (event,)
    wind = np.full(len(truth.time_s), wind_m_s2)
    truth = replace(truth, position_enu_m=position, wind_acceleration_m_s2=wind, events=events)
    return FlightData(data.ticks, truth)


def test_a_flight_that_tracked_says_how_well_and_where_it_was_worst():
    said = answer(result(), story(data=with_peak(17.292)), SCORED_S, ())
    assert said.level == "good"
    assert said.sentence == (
        "Tracked to 20.9 mm on average; the largest error, 57.6 mm, came at 12.3 s, in a left turn."
    )
    assert [(f.name, f.value) for f in said.figures[:3]] == [
        ("mean error", "20.9"),
        ("rms", "25.0"),
        ("largest", "57.6"),
    ]


def test_what_pushed_or_happened_there_is_told():
    windy = answer(result(), story(data=with_peak(17.292, wind_m_s2=1.31)), SCORED_S, ())
    assert windy.sentence.endswith("in a left turn where the air pushed with 1.3 m/s².")
    event = TruthEvent(16.5, "payload", 0.0)
    dropped = answer(result(), story(data=with_peak(17.292, event=event)), SCORED_S, ())
    assert dropped.sentence.endswith("in a left turn, after payload dropped.")
    long_ago = find_peak(with_peak(17.292, event=TruthEvent(6.0, "payload", 0.0)), SCORED_S)
    assert long_ago.event == ""


def test_a_loose_flight_and_one_of_which_something_stands_out_are_not_green():
    loose = answer(result(mean_tracking_error_m=0.24), story(), SCORED_S, ())
    assert loose.level == "half"
    assert loose.sentence.startswith("Flew the trajectory to its end, but 240 mm off on average")
    finding = Finding("half", "Thrust stood at its highest value.", "Told always.")
    remark = Finding("none", "2 setpoints were late.", "Told always.")
    assert answer(result(), story(), SCORED_S, (remark,)).level == "good"
    marked = answer(result(), story(), SCORED_S, (finding, remark))
    assert (marked.level, marked.reasons) == ("half", ("Thrust stood at its highest value.",))


ABORTED = {"outcome": "aborted", "completed": False, "mean_tracking_error_m": None}


def test_a_flight_that_broke_off_says_how_far_it_came_and_why():
    data = make_flight(end_s=13.0)
    said = answer(
        result(**ABORTED, note="The geofence was left; the autopilot has landed the vehicle."),
        story(data=data),
        SCORED_S,
        (),
    )
    assert said.level == "bad"
    assert said.sentence == (
        "Did not track to the end: 8.0 s of 20.0 s were flown, then the flight was aborted: "
        "The geofence was left; the autopilot has landed the vehicle."
    )


def test_a_flight_that_never_tracked_says_in_which_phase_it_ended():
    phases = (
        Phase("connect", "", 0.0, 2.0),
        Phase("approach", "", 2.0, 7.5),
        Phase("handed over", "no state", 7.5, 9.0),
    )
    data = make_flight(end_s=4.0)
    made = story(data=data, phases=phases)
    assert tracked_s(data, SCORED_S) is None
    assert tracked_s(make_flight(), SCORED_S) == SCORED_S
    said = answer(result(**ABORTED, note="no state for 0.8 s"), made, None, ())
    assert said.sentence == (
        "Did not track: the flight was aborted in the phase “approach”, 7.5 s after the log's "
        "beginning: no state for 0.8 s."
    )


def test_a_refused_flight_and_logs_that_can_not_be_read_have_a_sentence_too():
    refused = answer(result(**ABORTED | {"outcome": "refused"}, note="not ready"), None, None, ())
    assert (refused.level, refused.sentence) == ("bad", "Did not fly: not ready.")
    unknown = answer(result(mean_tracking_error_m=None), None, None, ())
    assert unknown.level == "none"
    assert unknown.sentence.endswith("the logs say nothing of the error.")
    broken = answer(result(**ABORTED, note="x"), None, None, ())
    assert broken.sentence == "Did not track: the flight was aborted: x."


def test_a_flight_that_tracked_and_did_not_end_as_planned_is_not_green():
    said = answer(result(outcome="aborted", note="The link was lost."), story(), SCORED_S, ())
    assert said.level == "bad"
    assert said.sentence.endswith("It did not end as planned: The link was lost.")


def line(velocity, acceleration=(0.0, 0.0, 0.0)):
    t = TIMES[:, None] - 10.0
    return t * np.array(velocity) + 0.5 * t**2 * np.array(acceleration)


@pytest.mark.parametrize(
    ("path", "place"),
    [
        (circle(TIMES), "in a left turn"),
        (circle(-TIMES), "in a right turn"),
        (line((1.0, 0.5, 0.1)), "on a straight"),
        (line((0.1, 0.0, 0.6)), "on the climb"),
        (line((0.0, 0.1, -0.6)), "on the descent"),
        (line((0.0, 0.0, 0.0)), "while it stood still"),
        (line((0.0, 0.0, 0.0), (2.0, 0.0, 0.0)), "where the path turns back"),
        (line((1.0, 0.0, 0.0), (1.5, 0.0, 0.0)), "while speeding up"),
        (line((1.0, 0.0, 0.0), (-1.5, 0.0, 0.0)), "while slowing down"),
    ],
)
def test_places_on_the_path_have_names(path, place):
    assert place_on_path(TIMES, path, 10.0) == place


def test_where_the_path_is_not_known_there_is_no_place():
    unknown = np.full((len(TIMES), 3), np.nan)
    assert place_on_path(TIMES, unknown, 10.0) == ""
    assert place_on_path(TIMES, circle(TIMES), 30.0) == ""
    assert place_on_path(TIMES, circle(TIMES), TIMES[-1]) == "in a left turn"
