import io
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from companion.config.models import MissionConfig
from companion.config.resolve import load_flight
from companion.flight.conduct import Outcome
from companion.flight.records import CHANNELS
from companion.mavlink.codec import Packer, encode
from companion.mavlink.messages import COMPONENT_TRUTH
from companion.recording.flight_log import FlightLog
from companion.report.aftermath import score_and_draw
from companion.report.flight_data import truth_from_packets
from companion.report.recovery import MARGIN_M, STAYS_S, recovery
from companion.report.result import result_object
from companion.report.summary import print_summary
from tests.companion.report.test_report_flight_data import control, odometry

EVENT_S = 10.0
TIMES = np.arange(0.0, 20.0, 0.01)
BEFORE_M = 0.02


def told(time_s, name, value, component=COMPONENT_TRUTH):
    return Packer(1, component).pack(
        encode("NAMED_VALUE_FLOAT", time_boot_ms=round(time_s * 1e3), value=value, name=name)
    )


def errors(height=0.0, east=0.0):
    """An error that is 2 cm before the event, in height and to the north, and as given after it."""
    after = EVENT_S <= TIMES
    error = np.zeros((len(TIMES), 3))
    error[:, 1] = np.where(after, 0.0, BEFORE_M)
    error[:, 0] = np.where(after, east, 0.0)
    error[:, 2] = np.where(after, height, -BEFORE_M)
    return error


def pulse(end_s, size_m):
    return np.where(EVENT_S + end_s > TIMES, size_m, 0.0)


def test_its_peaks_are_those_after_the_event_and_its_bounds_those_before():
    found = recovery(TIMES, errors(height=-pulse(1.0, 0.3), east=pulse(0.5, 0.2)), EVENT_S)
    assert found.peak_height_m == pytest.approx(0.3)
    assert found.peak_horizontal_m == pytest.approx(0.2)
    assert found.before_height_m == pytest.approx(BEFORE_M)
    assert found.before_horizontal_m == pytest.approx(BEFORE_M)


@settings(deadline=None, derandomize=True)
@given(
    height_s=st.floats(0.1, 6.0),
    east_s=st.floats(0.1, 6.0),
)
def test_it_is_over_when_the_later_of_height_and_side_is_back(height_s, east_s):
    found = recovery(TIMES, errors(pulse(height_s, 0.3), pulse(east_s, 0.2)), EVENT_S)
    assert found.recovery_s == pytest.approx(max(height_s, east_s), abs=0.011)


def test_an_error_within_the_bounds_takes_no_time():
    found = recovery(TIMES, errors(height=BEFORE_M + 0.99 * MARGIN_M), EVENT_S)
    assert found.recovery_s == 0.0
    assert found.peak_height_m == pytest.approx(BEFORE_M + 0.99 * MARGIN_M)


def test_an_error_that_swings_out_again_is_not_back_until_it_stays():
    swings = np.where(np.abs(np.sin(TIMES - EVENT_S)) > 0.5, 0.2, 0.0)
    calm_from = EVENT_S + 5.0
    found = recovery(TIMES, errors(east=np.where(calm_from > TIMES, swings, 0.0)), EVENT_S)
    assert 4.0 < found.recovery_s <= 5.0


def test_an_error_that_never_comes_back_takes_for_ever():
    assert recovery(TIMES, errors(height=0.2), EVENT_S).recovery_s == math.inf
    late = pulse(20.0 - EVENT_S - 0.5 * STAYS_S, 0.2)
    assert recovery(TIMES, errors(height=late), EVENT_S).recovery_s == math.inf


def test_what_begins_late_counts_too_while_the_error_was_not_back_long_enough():
    begins = np.where((TIMES > EVENT_S + 1.0) & (EVENT_S + 2.0 > TIMES), 0.2, 0.0)
    assert recovery(TIMES, errors(east=begins), EVENT_S).recovery_s == pytest.approx(2.0, abs=0.02)


def test_a_hard_turn_long_after_it_is_no_part_of_it():
    turn = np.where(TIMES > 18.0, 0.2, 0.0)
    found = recovery(TIMES, errors(east=pulse(1.0, 0.2) + turn), EVENT_S)
    assert found.recovery_s == pytest.approx(1.0, abs=0.011)


@pytest.mark.parametrize("begins_s", [3.1, 4.0, 6.9])
@pytest.mark.parametrize("early_m", [0.0, 0.2])
def test_a_vehicle_that_diverges_late_and_never_returns_is_not_back(begins_s, early_m):
    late = np.where(EVENT_S + begins_s < TIMES, TIMES - EVENT_S - begins_s + 0.1, 0.0)
    found = recovery(TIMES, errors(east=pulse(0.05, early_m) + late), EVENT_S)
    assert found.recovery_s == math.inf
    assert found.peak_horizontal_m > 3.0


def test_an_oscillation_that_grows_is_not_back_whenever_it_passes_through():
    grown = np.where(EVENT_S + 4.0 < TIMES, np.sin(6.0 * TIMES) * (TIMES - EVENT_S), 0.0)
    assert recovery(TIMES, errors(height=grown), EVENT_S).recovery_s == math.inf


def test_a_record_that_ends_before_three_seconds_says_nothing():
    use = EVENT_S + 0.9 * STAYS_S > TIMES
    assert recovery(TIMES[use], errors()[use], EVENT_S).recovery_s == math.inf


def test_a_record_that_ends_before_the_scored_part_says_nothing():
    use = EVENT_S + 5.0 > TIMES
    short = (TIMES[use], errors(east=pulse(1.0, 0.2))[use], EVENT_S)
    assert recovery(*short).recovery_s == pytest.approx(1.0, abs=0.011)
    assert recovery(*short, end_s=EVENT_S + 5.1).recovery_s == pytest.approx(1.0, abs=0.011)
    assert recovery(*short, end_s=TIMES[-1]).recovery_s == math.inf


def test_a_flight_that_failed_is_not_back():
    found = recovery(TIMES, errors(east=pulse(1.0, 0.2)), EVENT_S, lost=True)
    assert found.recovery_s == math.inf
    assert found.peak_horizontal_m == pytest.approx(0.2)


@pytest.mark.parametrize("event_s", [-1.0, 25.0])
def test_there_are_no_figures_without_a_before_and_an_after(event_s):
    assert recovery(TIMES, errors(), event_s) is None


def test_samples_without_an_error_are_left_out():
    error = errors(height=pulse(1.0, 0.3))
    error[::7] = math.nan
    assert recovery(TIMES, error, EVENT_S).recovery_s == pytest.approx(1.0, abs=0.021)


def test_events_are_read_once_each_and_from_the_truth_alone():
    packets = [
        told(12.0, b"motor3", 0.9),
        told(10.0, b"payload", 0.0),
        told(12.0, b"motor3", 0.9),
        told(11.0, b"front", 6.0, component=1),
        told(13.0, b"front", math.nan),
    ]
    events = truth_from_packets(packets).events
    assert [(event.time_s, event.name) for event in events] == [(10.0, "payload"), (12.0, "motor3")]
    assert [event.text for event in events] == ["payload dropped", "motor 3 at 90% thrust"]


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        (b"payload", 0.1, "payload 0.1 kg"),
        (b"front", 6.0, "gust front, 6 m/s"),
        (b"something", 1.5, "something 1.5"),
    ],
)
def test_events_have_words(name, value, text):
    (event,) = truth_from_packets([told(10.0, name, value)]).events
    assert event.text == text


@pytest.mark.parametrize(("outcome", "back_s"), [("landed", 1.0), ("aborted", None)])
def test_a_flight_with_an_event_has_its_figures_and_a_picture(tmp_path, outcome, back_s):
    log = FlightLog(tmp_path, CHANNELS)
    for step in range(1200):
        time_s = 0.01 * step
        off_m = 0.2 if 4.0 <= time_s < 5.0 else 0.01
        log.record("control", time_s, control(time_s, thrust=0.5))
        log.frame_in(time_s, odometry(time_s, (0.0, 0.0, -off_m)))
    log.frame_in(12.0, told(4.0, b"payload", 0.0))
    log.close()
    flown = Outcome(outcome, True, "", (1.0, 11.0), 1200, 0, 0, None, None, 0.0, 12.0)

    result, trouble = score_and_draw(load_flight(None, {}, {}), flown, tmp_path, 1.0)

    assert trouble is None
    assert result["event"] == {
        "what": "payload dropped",
        "at_s": 3.0,
        "peak_height_error_m": pytest.approx(0.2),
        "peak_horizontal_error_m": 0.0,
        "recovery_s": back_s and pytest.approx(back_s, abs=0.02),
    }
    assert (tmp_path / "recovery.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("recovery_s", "end"),
    [
        (1.2, "back after 1.20 s"),
        (0.0, "never 30 mm worse than before"),
        (None, "not back before the end"),
    ],
)
def test_the_table_says_what_happened_and_how_it_ended(recovery_s, end):
    landed = Outcome("landed", True, "", (1.0, 11.0), 1200, 0, 0, None, None, 0.0, 12.0)
    event = {
        "what": "gust front, 6 m/s",
        "at_s": 3.04,
        "peak_height_error_m": 0.0123,
        "peak_horizontal_error_m": 0.206,
        "recovery_s": recovery_s,
    }
    result = result_object(MissionConfig(), landed, None, wall_s=1.0, log_dir=None, event=event)
    shown = io.StringIO()
    print_summary(Console(file=shown, width=150), result)
    line = f"gust front, 6 m/s at 3.0 s: 12 mm off in height, 206 sideways at most, {end}"
    assert line in shown.getvalue()
