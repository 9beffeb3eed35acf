"""Streams, delays, losses, signatures, judged."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.preflight.finding import Verdict, worst
from companion.preflight.link import judge_link
from companion.preflight.streams import NEEDS, judge_streams
from tests.companion.preflight.healthy import PLAN, PX4, STATE, STATUS, finding_of


def streams(*facts, **plan):
    return judge_streams(facts, replace(PLAN, **plan))


def link(identity=PX4.identity, plan=PLAN, **values):
    return judge_link(replace(PX4.link, **values), identity, plan)


@pytest.mark.parametrize(
    ("setpoint", "rate_hz", "asked_hz", "verdict"),
    [
        ("attitude", 29.0, 30.0, "refusal"),
        ("attitude", 30.0, 30.0, "warning"),
        ("attitude", 50.0, 50.0, "ok"),
        ("attitude", 69.0, 100.0, "warning"),
        ("attitude", 71.0, 100.0, "ok"),
        ("rates", 49.0, 100.0, "refusal"),
        ("rates", 79.0, 100.0, "warning"),
        ("rates", 81.0, 100.0, "ok"),
    ],
)
def test_the_states_rate_against_what_the_setpoints_need(setpoint, rate_hz, asked_hz, verdict):
    state = replace(STATE, measured_hz=rate_hz, asked_hz=asked_hz, longest_gap_s=1.1 / rate_hz)
    (found, _) = streams(state, STATUS, setpoint=setpoint)
    assert found.verdict == verdict
    assert f"{rate_hz:.0f} Hz, {asked_hz:g} Hz asked for" in found.found


@given(st.sampled_from(sorted(NEEDS)), st.floats(1.0, 300.0), st.floats(1.0, 300.0))
@settings(deadline=None, derandomize=True)
def test_a_faster_state_is_never_judged_worse(setpoint, one_hz, other_hz):
    verdicts = [
        worst(streams(replace(STATE, measured_hz=hz, jitter_s=0.0), setpoint=setpoint)).weight
        for hz in sorted((one_hz, other_hz))
    ]
    assert verdicts[0] >= verdicts[1]


def test_no_state_at_all():
    assert finding_of(streams(STATUS), "state").verdict == "refusal"


def test_a_state_that_is_granted_and_silent():
    silent = replace(STATE, measured_hz=0.0, count=0, longest_gap_s=3.0, jitter_s=math.nan)
    found = finding_of(streams(silent), "ODOMETRY")
    assert found.verdict == "refusal"
    assert "none in 3.0 s" in found.found


def test_gaps_longer_than_the_state_may_be_old_are_a_warning():
    found = finding_of(streams(replace(STATE, longest_gap_s=0.15)), "ODOMETRY")
    assert found.verdict == "warning"
    assert "longest gap 150 ms" in found.found


def test_bunches_are_noted():
    assert finding_of(streams(replace(STATE, jitter_s=0.006)), "ODOMETRY").verdict == "note"


def test_other_streams_that_are_slow_are_named_if_that_can_be_told():
    slow = replace(STATUS, measured_hz=1.0, count=3)
    rare = replace(STATUS, name="BATTERY_STATUS", asked_hz=0.5, measured_hz=0.0, count=0)
    findings = streams(STATE, slow, rare)
    assert finding_of(findings, "SYS_STATUS").verdict == "warning"
    assert finding_of(findings, "other streams").found == "1 of 2 come as asked for"


@pytest.mark.parametrize(
    ("round_trips_s", "verdict", "words"),
    [
        ((), "refusal", "never answered"),
        ((0.03, 0.031, 0.032), "ok", "31.0 ms there and back (30.0 to 32.0"),
        ((0.049, 0.05), "ok", "there and back"),
        ((0.051, 0.052), "warning", "tried with at most 20 ms more"),
        ((0.03, 0.03, 0.19), "warning", "levels out"),
        ((0.21, 0.2, 0.22), "refusal", "no setpoint would be sent"),
    ],
)
def test_the_delay_there_and_back(round_trips_s, verdict, words):
    found = finding_of(link(round_trips_s=round_trips_s), "delay")
    assert found.verdict == verdict
    assert words in found.sentence


def test_a_vehicle_that_states_no_delay_is_not_compared_with_it():
    found = link(plan=replace(PLAN, loop_delay_s=None), round_trips_s=(0.08, 0.08))
    assert finding_of(found, "delay").verdict == "ok"


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=32), st.floats(1.0, 3.0))
@settings(deadline=None, derandomize=True)
def test_a_slower_link_is_never_judged_better(round_trips_s, factor):
    plan = replace(PLAN, state_rate_hz=100.0)
    slower = tuple(factor * trip for trip in round_trips_s)
    before = finding_of(link(plan=plan, round_trips_s=tuple(round_trips_s)), "delay").verdict
    after = finding_of(link(plan=plan, round_trips_s=slower), "delay").verdict
    assert after.weight >= before.weight


@pytest.mark.parametrize(("rate", "verdict"), [(1.00001, "ok"), (0.988, "note"), (5.0, "note")])
def test_the_boot_clocks_drift(rate, verdict):
    assert finding_of(link(clock_rate=rate), "clock").verdict == verdict


def test_a_clock_that_is_not_known():
    assert "nan" not in finding_of(link(clock_offset_s=math.nan), "clock").found


@pytest.mark.parametrize(
    ("received", "lost", "verdict"),
    [
        (0, 0, "ok"),
        (10, 10, "ok"),
        (990, 10, "ok"),
        (970, 30, "warning"),
        (690, 310, "warning"),
        (590, 410, "refusal"),
    ],
)
def test_losses(received, lost, verdict):
    assert finding_of(link(received=received, lost=lost), "loss").verdict == verdict


@pytest.mark.parametrize(
    ("values", "verdict", "words"),
    [
        ({"local": True}, "ok", "does not leave this computer"),
        ({"local": False}, "note", "whoever reaches this link"),
        ({"vehicle_signs": True}, "refusal", "has no key"),
        ({"we_sign": True}, "ok", "on"),
        ({"we_sign": True, "rejected": 3}, "warning", "3 packets were not taken"),
    ],
)
def test_signing(values, verdict, words):
    found = finding_of(link(**values), "signing")
    assert found.verdict == verdict
    assert words in found.found


def test_others_on_the_link_are_told_apart():
    identity = replace(
        PX4.identity,
        other_vehicles=("system 2, component 1 (MAV_AUTOPILOT 3)",),
        other_senders=("system 255, component 190",),
    )
    findings = link(identity)
    assert finding_of(findings, "other vehicles").verdict is Verdict.WARNING
    assert finding_of(findings, "others on the link").verdict is Verdict.NOTE
