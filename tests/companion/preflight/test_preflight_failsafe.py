"""What the autopilots do without the companion, judged."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.preflight.failsafe_ardupilot import judge_ardupilot_failsafe
from companion.preflight.failsafe_px4 import judge_px4_failsafe
from companion.preflight.finding import Verdict, changes_of, worst
from tests.companion.preflight.healthy import ARDUPILOT, PX4, finding_of

GOOD_PX4 = dict(PX4.parameters)
GOOD_ARDUPILOT = dict(ARDUPILOT.parameters)
seconds = st.floats(0.0, 60.0)


def px4(clock_rate=1.0, **values):
    return judge_px4_failsafe({**GOOD_PX4, **values}, clock_rate)


def ardupilot(our_system_id=1, **values):
    merged = {**GOOD_ARDUPILOT, **values}
    kept = {name: value for name, value in merged.items() if value is not None}
    return judge_ardupilot_failsafe(kept, our_system_id)


@pytest.mark.parametrize(
    ("loss_s", "verdict"),
    [
        (0.0, "refusal"),
        (0.05, "refusal"),
        (0.2, "note"),
        (0.3, "ok"),
        (1.0, "ok"),
        (1.5, "ok"),
        (1.6, "warning"),
        (60.0, "warning"),
    ],
)
def test_the_time_until_px4_acts(loss_s, verdict):
    assert finding_of(px4(COM_OF_LOSS_T=loss_s), "COM_OF_LOSS_T").verdict == verdict


def test_a_simulation_that_runs_fast_has_stretched_the_time():
    assert finding_of(px4(5.0, COM_OF_LOSS_T=5.0), "COM_OF_LOSS_T").verdict == "ok"
    assert finding_of(px4(1.0, COM_OF_LOSS_T=5.0), "COM_OF_LOSS_T").verdict == "warning"


@given(seconds)
@settings(deadline=None, derandomize=True)
def test_the_change_of_the_time_is_itself_fine(loss_s):
    found = finding_of(px4(COM_OF_LOSS_T=loss_s), "COM_OF_LOSS_T")
    assert (found.change is not None) == (found.verdict in ("warning", "refusal"))
    if found.change is not None:
        assert found.change.old == loss_s
        again = finding_of(px4(COM_OF_LOSS_T=found.change.new), "COM_OF_LOSS_T")
        assert again.verdict is Verdict.OK


@pytest.mark.parametrize(
    ("action", "verdict", "words"),
    [
        (0, "ok", "without sticks it sinks, lands and disarms"),
        (1, "warning", "drifts with the wind"),
        (2, "warning", "falls out of the air"),
        (3, "note", "return"),
        (4, "ok", "land"),
        (5, "ok", "hold"),
        (6, "refusal", "the motors stop in the air"),
        (7, "refusal", "the motors stop in the air"),
        (99, "warning", "not known"),
    ],
)
def test_what_px4_does_then_in_words(action, verdict, words):
    found = finding_of(px4(COM_OBL_RC_ACT=float(action)), "COM_OBL_RC_ACT")
    assert found.verdict == verdict
    assert words in found.found
    if found.change is not None:
        assert finding_of(px4(COM_OBL_RC_ACT=found.change.new), "COM_OBL_RC_ACT").verdict == "ok"


def test_what_px4_does_not_tell_is_a_warning():
    findings = judge_px4_failsafe({}, 1.0)
    assert [f.subject for f in findings] == ["COM_OF_LOSS_T", "COM_OBL_RC_ACT"]
    assert {f.verdict for f in findings} == {Verdict.WARNING}


def test_px4_watching_for_a_ground_station_is_noted():
    assert finding_of(px4(NAV_DLL_ACT=2.0), "NAV_DLL_ACT").verdict == "note"
    assert not [f for f in px4(NAV_DLL_ACT=0.0) if f.subject == "NAV_DLL_ACT"]


@pytest.mark.parametrize(
    ("override", "words"), [(1.0, "does not end OFFBOARD"), (3.0, "ends OFFBOARD")]
)
def test_whether_the_sticks_take_over(override, words):
    assert words in finding_of(px4(COM_RC_OVERRIDE=override), "COM_RC_OVERRIDE").found


def test_ardupilots_defaults_catch_no_dead_companion_and_it_is_said_what_to_set():
    findings = ardupilot(GUID_TIMEOUT=3.0, FS_GCS_ENABLE=0.0, MAV_GCS_SYSID=255.0)
    timeout = finding_of(findings, "GUID_TIMEOUT")
    assert timeout.verdict == "warning"
    assert "for as long, then the vehicle levels and drifts" in timeout.found
    assert "Set 0.5 s or less" in timeout.advice
    watch = finding_of(findings, "FS_GCS_ENABLE")
    assert watch.verdict == "warning"
    assert "nothing catches a dead companion" in watch.found
    assert watch.advice == "Set FS_GCS_ENABLE 5: land, and MAV_GCS_SYSID 1, ours."
    # The system is set before the failsafe is switched on: else it would act at once.
    assert [(c.name, c.new) for c in changes_of(findings)] == [
        ("GUID_TIMEOUT", 0.5),
        ("MAV_GCS_SYSID", 1.0),
        ("FS_GCS_ENABLE", 5.0),
    ]


@given(
    timeout_s=seconds,
    enable=st.integers(0, 7),
    watched=st.integers(1, 255),
    ours=st.integers(1, 250),
)
@settings(deadline=None, derandomize=True)
def test_with_all_changes_made_ardupilot_catches_a_dead_companion(timeout_s, enable, watched, ours):
    values = {
        "GUID_TIMEOUT": timeout_s,
        "FS_GCS_ENABLE": float(enable),
        "MAV_GCS_SYSID": float(watched),
    }
    findings = ardupilot(ours, **values)
    fixed = values | {change.name: change.new for change in changes_of(findings)}
    assert worst(ardupilot(ours, **fixed)).weight <= Verdict.NOTE.weight
    assert not changes_of(ardupilot(ours, **fixed))
    assert fixed["GUID_TIMEOUT"] <= 0.5 + 1e-6
    assert fixed["FS_GCS_ENABLE"] != 0.0
    assert fixed["MAV_GCS_SYSID"] == ours


def test_the_older_name_of_the_watched_system_is_used_where_it_is_the_name():
    findings = ardupilot(MAV_GCS_SYSID=None, SYSID_MYGCS=255.0)
    assert finding_of(findings, "SYSID_MYGCS").change.new == 1.0


def test_a_range_of_watched_systems_may_hold_ours():
    values = {"MAV_GCS_SYSID": 1.0, "MAV_GCS_SYSID_HI": 10.0}
    assert not [f for f in ardupilot(7, **values) if f.subject == "MAV_GCS_SYSID"]
    assert finding_of(ardupilot(11, **values), "MAV_GCS_SYSID").verdict == "warning"


def test_what_ardupilot_does_not_tell_is_a_warning():
    findings = judge_ardupilot_failsafe({}, 1)
    assert [(f.subject, f.verdict) for f in findings] == [
        ("GUID_TIMEOUT", "warning"),
        ("FS_GCS_ENABLE", "warning"),
    ]


def test_returning_home_is_noted_since_it_may_be_indoors():
    assert finding_of(ardupilot(FS_GCS_ENABLE=1.0), "FS_GCS_ENABLE").verdict == "note"


def test_a_float_of_32_bits_that_is_nearly_half_a_second_passes():
    assert finding_of(ardupilot(GUID_TIMEOUT=0.5000000298), "GUID_TIMEOUT").verdict == "ok"
