"""Whether what was asked for arrives: often enough, and evenly."""

import math
from dataclasses import dataclass

from companion.preflight.facts import Plan, StreamFacts
from companion.preflight.finding import Finding, Verdict

SLOW_SHARE = 0.7
"""Below this share of what was asked for, a stream is slow."""
_ENOUGH = 5
"""So many messages must have been due for a rate to mean something."""
_UNEVEN_SHARE = 0.5
_AT_CHANGES = "CURRENT_MODE"
"""Comes when the mode changes, and now and then: a short interval only lets it come at once."""


@dataclass(frozen=True, slots=True)
class Need:
    """How often a setpoint type needs the state, Hz."""

    least_hz: float
    """Below this there is no flight."""
    good_hz: float
    """Below this it flies worse than it could."""


NEEDS = {"attitude": Need(30.0, 50.0), "rates": Need(50.0, 80.0)}
"""With body rates the companion closes the attitude loop itself, a faster one."""


def judge_streams(streams: tuple[StreamFacts, ...], plan: Plan, remedy: str = "") -> list[Finding]:
    """A finding for each stream of the state, and for others that do not come as asked.

    Args:
        streams: as they came.
        plan: what is to be flown.
        remedy: what to do about slow ones on this autopilot, without a full stop.
    """
    remedy = remedy or "Use a faster link or fewer streams on it"
    findings = [_state(stream, plan, remedy) for stream in streams if stream.is_state]
    if not findings:
        findings.append(
            Finding(
                "state",
                "the autopilot streams no position and attitude",
                Verdict.REFUSAL,
                "Check that the estimator has a position, and the link's direction.",
            )
        )
    others = [stream for stream in streams if not stream.is_state]
    slow = [stream for stream in others if stream.name != _AT_CHANGES and _is_slow(stream)]
    findings += [
        Finding(
            stream.name,
            _described(stream),
            Verdict.WARNING if stream.required else Verdict.NOTE,
            f"{remedy}.",
        )
        for stream in slow
    ]
    good = len(others) - len(slow)
    if good:
        findings.append(Finding("other streams", f"{good} of {len(others)} come as asked for"))
    return findings


def _state(stream: StreamFacts, plan: Plan, remedy: str) -> Finding:
    need = NEEDS[plan.setpoint]
    found = _described(stream)
    if stream.count == 0:
        return Finding(
            stream.name,
            found,
            Verdict.REFUSAL,
            "Wait until the estimator has a position (ArduPilot streams none before); else check "
            "the link's direction.",
        )
    if stream.measured_hz < need.least_hz:
        return Finding(
            stream.name,
            found,
            Verdict.REFUSAL,
            f"{plan.setpoint.capitalize()} setpoints need {need.least_hz:g} Hz at least. {remedy}.",
        )
    if stream.measured_hz < need.good_hz:
        return Finding(
            stream.name,
            found,
            Verdict.WARNING,
            f"{plan.setpoint.capitalize()} setpoints want {need.good_hz:g} Hz. {remedy}.",
        )
    if _is_slow(stream):
        return Finding(
            stream.name,
            found,
            Verdict.WARNING,
            f"It comes slower than it was asked for. {remedy}; or ask for less by state_rate_hz.",
        )
    if stream.longest_gap_s > plan.state_age_limit_s:
        return Finding(
            stream.name,
            found,
            Verdict.WARNING,
            f"No state older than {plan.state_age_limit_s * 1e3:.0f} ms is flown on "
            "(supervisor.state_age_limit_s): each such gap makes the vehicle level out. "
            "Find what holds the link or this computer up.",
        )
    if stream.jitter_s > _UNEVEN_SHARE / stream.measured_hz:
        return Finding(
            stream.name, found, Verdict.NOTE, "It comes in bunches: buffers on the way add delay."
        )
    return Finding(stream.name, found)


def _is_slow(stream: StreamFacts) -> bool:
    """True if enough should have come to tell, and too little did."""
    due = stream.asked_hz * stream.window_s
    return due >= _ENOUGH and stream.measured_hz < SLOW_SHARE * stream.asked_hz


def _described(stream: StreamFacts) -> str:
    asked = f"{stream.asked_hz:g} Hz asked for"
    if stream.count == 0:
        return f"none in {stream.window_s:.1f} s, {asked}"
    text = f"{stream.measured_hz:.0f} Hz, {asked}; longest gap {stream.longest_gap_s * 1e3:.0f} ms"
    if not math.isnan(stream.jitter_s):
        text += f", jitter {stream.jitter_s * 1e3:.1f} ms"
    return text
