"""A recording of a log's records."""

import math

import numpy as np
import pytest

from companion.frames import quaternion_from_euler
from companion.identification.estimates import UnidentifiedError
from companion.identification.from_records import recording_from_records

FACTS = {
    "autopilot": "px4",
    "thrust_kind": "collective",
    "thrust_climb_m_s": 0.0,
    "thrust_descent_m_s": 0.0,
}
TILT_RAD = 0.3


def tick(time_s, **changes):
    record = {
        "autopilot_time_s": time_s,
        "received_s": time_s + 5.0,
        "loop_delay_s": 0.03,
        "phase": "track",
        "rung": "track",
        "position_enu_m": [1.0, 2.0, 3.0],
        "velocity_enu_m_s": [0.1, 0.2, 0.3],
        "attitude_flu_to_enu": list(quaternion_from_euler(TILT_RAD, 0.0, 1.0)),
        "rate_flu_rad_s": [0.01, 0.02, 0.03],
        "attitude_setpoint_flu_to_enu": list(quaternion_from_euler(0.1, 0.0, 0.7)),
        "thrust": 0.5,
        "applied_u": [0.1, 0.2, 0.4],
        "roll_rad": 0.1,
        "pitch_rad": 0.2,
        "segment": "roll",
    }
    return record | changes


def test_each_column_comes_from_its_field():
    recording = recording_from_records([tick(1.0), tick(1.01, segment="hold")], [], [FACTS])
    assert recording.time_s.tolist() == [1.0, 1.01]
    assert recording.received_s.tolist() == [6.0, 6.01]
    assert recording.loop_delay_s.tolist() == [0.03, 0.03]
    assert recording.position_enu_m[0].tolist() == [1.0, 2.0, 3.0]
    assert recording.velocity_enu_m_s[0].tolist() == [0.1, 0.2, 0.3]
    assert recording.rate_flu_rad_s[0].tolist() == [0.01, 0.02, 0.03]
    assert (recording.roll_rad[0], recording.pitch_rad[0]) == (0.1, 0.2)
    assert recording.yaw_rad[0] == pytest.approx(0.7)
    assert (recording.thrust[0], recording.climb_rate_m_s[0]) == (0.5, 0.4)
    assert recording.segment.tolist() == ["roll", "hold"]
    assert np.isnan(recording.reported_thrust).all()
    assert recording.autopilot == "px4"


@pytest.mark.parametrize(
    "useless",
    [
        {"segment": ""},
        {"phase": "silence", "position_enu_m": [None] * 3},
        {"rung": "level"},
        {"roll_rad": None},
        {"position_enu_m": [None, 0.0, 0.0]},
    ],
)
def test_ticks_on_which_the_excitation_sent_nothing_are_left_out(useless):
    records = [tick(1.0), tick(1.01, **useless), tick(1.02)]
    recording = recording_from_records(records, [], [FACTS])
    assert recording.time_s.tolist() == [1.0, 1.02]


def test_parts_that_were_left_are_named_with_why():
    roll, swing = "the part 'roll' is not played: why", "the part 'swing' is not played: wind"
    records = [
        tick(1.0),
        tick(1.01, segment="hold", left=roll),
        tick(1.02, segment="hold", left=roll),
        tick(1.03, segment="hold", left=""),
        tick(1.04, segment="hold", left=swing),
    ]
    recording = recording_from_records(records, [], [FACTS])
    assert recording.left == (("roll", roll), ("swing", swing))
    assert recording_from_records([tick(1.0)], [], [FACTS]).left == ()


def test_a_rate_that_is_not_known_is_nan():
    recording = recording_from_records([tick(1.0, rate_flu_rad_s=[None] * 3)], [], [FACTS])
    assert np.isnan(recording.rate_flu_rad_s).all()


def test_the_thrust_is_the_newest_report_at_or_before_the_sample():
    reports = [{"autopilot_time_s": t, "thrust": v} for t, v in ((1.0, 0.4), (1.02, 0.6))]
    records = [tick(t) for t in (0.99, 1.0, 1.01, 1.02, 1.03)]
    recording = recording_from_records(records, reports, [FACTS])
    assert math.isnan(recording.reported_thrust[0])
    assert recording.reported_thrust[1:].tolist() == [0.4, 0.4, 0.6, 0.6]


def test_what_ardupilot_reports_is_made_to_lie_along_the_body():
    facts = FACTS | {"autopilot": "ardupilot", "thrust_kind": "climb_rate"}
    reports = [{"autopilot_time_s": 0.9, "thrust": 0.4}]
    recording = recording_from_records([tick(1.0)], reports, [facts])
    assert recording.reported_thrust[0] == pytest.approx(0.4 / math.cos(TILT_RAD))


def test_the_last_engagement_says_what_the_thrust_means():
    later = FACTS | {"thrust_kind": "climb_rate", "thrust_climb_m_s": 2.5}
    meaning = recording_from_records([tick(1.0)], [], [FACTS, later]).thrust_meaning
    assert (meaning.kind, meaning.climb_m_s) == ("climb_rate", 2.5)


def test_another_flights_log_is_told_to_be_none():
    with pytest.raises(UnidentifiedError, match="no record of an experiment"):
        recording_from_records([tick(1.0)], [], [])
    with pytest.raises(UnidentifiedError, match="before anything was played"):
        recording_from_records([tick(1.0, segment="")], [], [FACTS])
