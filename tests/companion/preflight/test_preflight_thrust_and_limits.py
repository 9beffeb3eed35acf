"""Thrust, fences, battery, estimate and the vehicle's state, judged."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.preflight.battery import judge_battery
from companion.preflight.estimator import judge_estimator
from companion.preflight.facts import BatteryFacts, EstimatorFacts
from companion.preflight.fence import judge_autopilot_fence, judge_trajectory
from companion.preflight.finding import Verdict, accepting, changes_of, worst
from companion.preflight.judgement import judge, mend, parameters_to_read
from companion.preflight.thrust import judge_ardupilot_thrust, judge_px4_thrust
from companion.preflight.vehicle import judge_vehicle
from companion.thrust_meaning import ThrustMeaning
from tests.companion.preflight.healthy import (
    ARDUPILOT,
    PLAN,
    PX4,
    STATE,
    finding_of,
    with_parameters,
)

VERTICAL, THROTTLE = ThrustMeaning("vertical"), ThrustMeaning("collective")


def as_throttle(meaning, **values):
    options = {"GUID_OPTIONS": 8.0, **values}
    return replace(with_parameters(ARDUPILOT, **options), thrust=meaning)


def estimate(identity=PX4.identity, **values):
    return judge_estimator(replace(PX4.estimator, **values), identity)


@pytest.mark.parametrize("facts", [PX4, ARDUPILOT], ids=["px4", "ardupilot"])
def test_with_nothing_wrong_nothing_is_said_to_be(facts):
    findings = judge(facts, PLAN)
    assert {f.verdict for f in findings} == {Verdict.OK}
    assert changes_of(findings) == []
    assert len({f.subject for f in findings}) == len(findings)


def test_what_a_flight_waits_for_itself_is_not_judged_before_it():
    unready = replace(PX4, estimator=EstimatorFacts(0, {}, home=False, ready=False))
    assert worst(judge(unready, PLAN)) is Verdict.WARNING
    assert worst(judge(unready, PLAN, settled=False)) is Verdict.OK


def test_every_parameter_that_may_be_set_is_one_that_is_read():
    bad = with_parameters(
        ARDUPILOT, GUID_TIMEOUT=3.0, FS_GCS_ENABLE=0.0, MAV_GCS_SYSID=255.0, WPNAV_SPEED_UP=50.0
    )
    bad = replace(bad, thrust=ThrustMeaning("climb_rate", 0.5, 1.5))
    names = {change.name for change in changes_of(judge(bad, PLAN))}
    assert names == {"GUID_TIMEOUT", "FS_GCS_ENABLE", "MAV_GCS_SYSID", "WPNAV_SPEED_UP"}
    assert names < set(parameters_to_read("ardupilot", with_mocap=False))


@pytest.mark.parametrize(
    ("meaning", "words"),
    [
        (ThrustMeaning("climb_rate", 2.5, 1.5), "climb rate, from 1.5 m/s down to 2.5 m/s up"),
        (VERTICAL, "ArduPilot makes up for the tilt (ATC_ANGLE_BOOST), the companion does not"),
        (THROTTLE, "the companion makes up for the tilt (ATC_ANGLE_BOOST is off)"),
    ],
)
def test_the_thrust_fields_meaning_in_words(meaning, words):
    found = finding_of(
        judge_ardupilot_thrust(replace(ARDUPILOT, thrust=meaning), PLAN), "GUID_OPTIONS"
    )
    assert words in found.found
    assert found.verdict is Verdict.OK


def test_a_meaning_that_cannot_be_flown_is_a_refusal_with_its_reason():
    facts = replace(ARDUPILOT, thrust="it does not say what GUID_OPTIONS is")
    found = finding_of(judge_ardupilot_thrust(facts, PLAN), "thrust")
    assert found.verdict is Verdict.REFUSAL
    assert "it does not say what GUID_OPTIONS is" in found.found


@pytest.mark.parametrize(
    ("facts", "wanted", "new"),
    [(ARDUPILOT, "thrust", 8.0), (as_throttle(VERTICAL, GUID_OPTIONS=9.0), "climb_rate", 1.0)],
)
def test_another_meaning_than_the_wanted_one_is_a_refusal_and_can_be_set(facts, wanted, new):
    plan = replace(PLAN, thrust_field=wanted)
    found = finding_of(judge_ardupilot_thrust(facts, plan), "GUID_OPTIONS")
    assert found.verdict is Verdict.REFUSAL
    assert found.change.new == new


def test_px4_can_give_no_climb_rate():
    plan = replace(PLAN, thrust_field="climb_rate")
    assert worst(judge_px4_thrust(PX4, plan)) is Verdict.REFUSAL


@pytest.mark.parametrize(("name", "new"), [("WPNAV_SPEED_UP", 150.0), ("WP_SPD_UP", 1.5)])
def test_a_climb_rate_smaller_than_the_vehicles_is_named_in_its_own_unit(name, new):
    unit = 100.0 if name == "WPNAV_SPEED_UP" else 1.0
    facts = with_parameters(ARDUPILOT, **{"WPNAV_SPEED_UP": None, name: 1.0 * unit})
    facts = replace(facts, thrust=ThrustMeaning("climb_rate", 1.0, 1.5))
    found = finding_of(judge_ardupilot_thrust(facts, PLAN), name)
    assert found.verdict is Verdict.WARNING
    assert found.change.new == pytest.approx(new)


@pytest.mark.parametrize(
    ("hover", "verdict"),
    [(0.5, "ok"), (0.43, "ok"), (0.57, "ok"), (0.42, "warning"), (0.6, "warning")],
)
def test_hover_thrust_against_the_vehicles_file(hover, verdict):
    px4 = judge_px4_thrust(with_parameters(PX4, MPC_THR_HOVER=hover), PLAN)
    assert finding_of(px4, "MPC_THR_HOVER").verdict == verdict
    ardupilot = judge_ardupilot_thrust(as_throttle(VERTICAL, MOT_THST_HOVER=hover), PLAN)
    assert finding_of(ardupilot, "MOT_THST_HOVER").verdict == verdict


def test_for_a_climb_rate_the_hover_thrust_does_not_matter():
    facts = with_parameters(ARDUPILOT, MOT_THST_HOVER=0.1)
    assert worst(judge_ardupilot_thrust(facts, PLAN)) is Verdict.OK


@pytest.mark.parametrize(("name", "value"), [("ANGLE_MAX", 3000.0), ("ATC_ANGLE_MAX", 30.0)])
def test_ardupilots_tilt_limit_does_not_apply_and_it_is_said(name, value):
    facts = with_parameters(ARDUPILOT, **{"ANGLE_MAX": None, name: value})
    found = finding_of(judge_ardupilot_thrust(facts, PLAN), name)
    assert found.found.startswith("30°, which ArduPilot does not apply to attitude setpoints")
    assert "35°" in found.found


def test_a_trajectory_that_does_not_fit_is_refused_in_its_own_words():
    findings = judge_trajectory(replace(PLAN, problems=("too fast", "too far")))
    assert [(f.found, f.verdict) for f in findings] == [
        ("too fast", "refusal"),
        ("too far", "refusal"),
    ]


@pytest.mark.parametrize(
    ("facts", "parameters", "subject", "verdict"),
    [
        (PX4, {"GF_MAX_HOR_DIST": 2.4}, "GF_MAX_HOR_DIST", "refusal"),
        (PX4, {"GF_MAX_HOR_DIST": 2.6}, "GF_MAX_HOR_DIST", "ok"),
        (PX4, {"GF_MAX_VER_DIST": 3.4}, "GF_MAX_VER_DIST", "refusal"),
        (PX4, {"GF_MAX_VER_DIST": 2.0, "GF_ACTION": 0.0}, "GF_ACTION", "ok"),
        (ARDUPILOT, {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 1.0, "FENCE_ALT_MAX": 3.0},
         "FENCE_ALT_MAX", "refusal"),
        (ARDUPILOT, {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 2.0, "FENCE_RADIUS": 300.0},
         "FENCE_RADIUS", "ok"),
        (ARDUPILOT, {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0}, "FENCE_TYPE", "note"),
        (ARDUPILOT, {"FENCE_TYPE": 2.0, "FENCE_RADIUS": 1.0}, "FENCE_ENABLE", "ok"),
    ],
)  # fmt: skip
def test_the_autopilots_own_fence(facts, parameters, subject, verdict):
    findings = judge_autopilot_fence(with_parameters(facts, **parameters), PLAN)
    assert finding_of(findings, subject).verdict == verdict
    assert len(findings) == 1


@pytest.mark.parametrize(
    ("remaining", "verdict"),
    [(1.0, "ok"), (0.35, "ok"), (0.34, "warning"), (0.15, "warning"), (0.14, "refusal"),
     (math.nan, "warning")],
)  # fmt: skip
def test_the_battery(remaining, verdict):
    (found,) = judge_battery(BatteryFacts(remaining, math.nan), PLAN)
    assert found.verdict == verdict


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
@settings(deadline=None, derandomize=True)
def test_a_fuller_battery_is_never_judged_worse(one, other):
    low, high = (
        judge_battery(BatteryFacts(level, 16.0), PLAN)[0].verdict.weight
        for level in sorted((one, other))
    )
    assert low >= high


@pytest.mark.parametrize(
    ("values", "subject", "verdict", "words"),
    [
        ({"flags": None}, "estimate", "note", "does not say"),
        ({"flags": 0x3FF & ~0x18}, "estimate", "warning", "horizontal position"),
        ({"flags": 0xA7}, "estimate", "warning", "horizontal position"),
        ({"flags": 0x3FF & ~4}, "estimate", "warning", "vertical velocity"),
        ({"flags": 0x3FF | 0x400}, "estimate", "warning", "GNSS jumps"),
        ({"ratios": {"compass": 0.6, "height": 0.1}}, "innovations", "note", "0.60"),
        ({"ratios": {"compass": 1.2}}, "innovations", "warning", "(compass)"),
        ({"ratios": {"compass": math.nan, "height": 0.1}}, "innovations", "ok", "(height)"),
        ({"home": False}, "home", "note", "not set yet"),
        ({"ready": False, "missing": ("GPS",)}, "ready to arm", "warning", "waits for GPS"),
        ({"ready": None}, "ready to arm", "note", "cannot be told in loiter"),
    ],
)
def test_the_estimate_and_readiness(values, subject, verdict, words):
    found = finding_of(estimate(**values), subject)
    assert found.verdict == verdict
    assert words in found.found


def test_ardupilots_flags_beyond_those_of_px4_are_not_taken_for_them():
    assert finding_of(estimate(ARDUPILOT.identity, flags=0x33F | 0x400), "estimate").verdict == "ok"


@pytest.mark.parametrize(
    ("values", "subject", "verdict"),
    [
        ({"armed": True}, "state", "refusal"),
        ({"landed_state": 2}, "state", "refusal"),
        ({"landed_state": 0}, "state", "ok"),
        ({"capabilities": 0}, "autopilot", "refusal"),
        ({"capabilities": None}, "autopilot", "note"),
    ],
)
def test_the_vehicle_as_it_stands(values, subject, verdict):
    found = judge_vehicle(replace(PX4.identity, **values))
    assert finding_of(found, subject).verdict == verdict


def test_a_refusal_that_is_accepted_warns_and_others_stay():
    facts = replace(
        with_parameters(PX4, COM_OBL_RC_ACT=7.0),
        streams=(replace(STATE, measured_hz=10.0),),
    )
    findings = accepting(judge(facts, PLAN), ["COM_OBL_RC_ACT"])
    assert finding_of(findings, "COM_OBL_RC_ACT").verdict is Verdict.WARNING
    assert finding_of(findings, "ODOMETRY").verdict is Verdict.REFUSAL


@pytest.mark.parametrize(
    ("facts", "fitting"),
    [
        (PX4, {"EKF2_EV_CTRL": 15.0, "EKF2_GPS_CTRL": 0.0, "EKF2_HGT_REF": 3.0}),
        (
            ARDUPILOT,
            {"VISO_TYPE": 1.0, "EK3_SRC1_POSXY": 6.0, "EK3_SRC1_POSZ": 6.0, "EK3_SRC1_YAW": 6.0,
             "EK3_SRC1_VELXY": 0.0, "EK3_SRC1_VELZ": 0.0},
        ),
    ],
)  # fmt: skip
def test_with_motion_capture_the_estimator_must_be_set_to_use_it(facts, fitting):
    plan = replace(PLAN, mocap=True)
    autopilot = facts.identity.autopilot
    assert set(fitting) <= set(parameters_to_read(autopilot, with_mocap=True))
    assert worst(judge(with_parameters(facts, **fitting), plan)) is Verdict.OK
    for name, value in fitting.items():
        wrong = with_parameters(facts, **fitting | {name: value + 1.0 if value < 8 else 0.0})
        found = finding_of(judge(wrong, plan), name)
        assert found.verdict is Verdict.WARNING
        assert found.change is None or found.change.new == value
    unread = {f.subject: f.verdict for f in judge(facts, plan)}
    assert all(unread[name] is Verdict.WARNING for name in fitting)
    assert worst(judge(facts, PLAN)) is Verdict.OK


def meaning_of(parameters):
    """As ArduPilot's, shortened."""
    if int(parameters["GUID_OPTIONS"]) & 8:
        return VERTICAL
    return ThrustMeaning("climb_rate", parameters["WPNAV_SPEED_UP"] / 100.0, 1.5)


def test_setting_one_parameter_may_show_that_another_is_to_be_set():
    bad = as_throttle(VERTICAL, WPNAV_SPEED_UP=50.0)
    plan = replace(PLAN, thrust_field="climb_rate")
    changes, findings = mend(bad, plan, meaning_of)
    assert [(c.name, c.old, c.new) for c in changes] == [
        ("GUID_OPTIONS", 8.0, 0.0),
        ("WPNAV_SPEED_UP", 50.0, 150.0),
    ]
    assert worst(findings) is Verdict.OK


def test_setting_one_parameter_may_show_what_no_parameter_mends():
    plan = replace(PLAN, thrust_field="thrust")
    changes, findings = mend(with_parameters(ARDUPILOT, MOT_THST_HOVER=0.2), plan, meaning_of)
    assert [c.name for c in changes] == ["GUID_OPTIONS"]
    assert finding_of(findings, "MOT_THST_HOVER").verdict is Verdict.WARNING


def test_where_nothing_is_to_be_set_it_is_what_is_found_anyway():
    assert mend(ARDUPILOT, PLAN, meaning_of) == ([], judge(ARDUPILOT, PLAN))


@pytest.mark.parametrize(("certifiable", "hint"), [(True, True), (False, False)])
def test_what_else_can_be_said_of_the_controller_is_hinted_at(certifiable, hint):
    plan = replace(PLAN, controller="mpc-l1", vehicle="x500", certifiable=certifiable)
    found = finding_of(judge(PX4, plan), "controller").found
    assert found.startswith("mpc-l1 on x500")
    assert ("companion certify mpc-l1 --vehicle x500" in found) == hint
