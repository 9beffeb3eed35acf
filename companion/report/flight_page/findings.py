"""What stands out in a flight's records, and from when on it is told: pure functions of arrays.

Each finding says what, how long or how often, and the threshold it is told from.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from companion.report.flight_data import Array, Ticks
from companion.report.flight_page.story import Message, Said, Story
from companion.report.pages.glance import Level

_LEAST_S = 0.2
"""What lasted shorter in all is not told: a step at the engagement, say."""
_GAP_PERIODS = 3.5
_LATE_SHARE = 5e-3
_R_MAX_SHARE = 0.5
_DEADLINE_MS = 5.0
_SAME = 1e-9
_THRUST_NEAR = 0.002
_AUTOPILOT = "the autopilot says: "
_MOST_MESSAGES = 4


@dataclass(frozen=True, slots=True)
class Limits:
    """Of vehicle and supervisor, as the flight was told."""

    tilt_deg: float
    minimum_thrust: float
    maximum_thrust: float
    state_age_s: float


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that stands out."""

    level: Level
    text: str
    """A sentence."""
    told_from: str
    """The threshold, and why it is one."""


def find(story: Story, result: Mapping[str, Any], limits: Limits) -> tuple[Finding, ...]:
    """All that stands out, the weightiest first.

    Args:
        story: the records.
        result: as `result_object` makes it.
        limits: as the flight was told.
    """
    ticks, said = story.data.ticks, story.said
    found = [
        *fallbacks(ticks, said),
        *lost_samples(ticks, said, limits),
        *saturated_tilt(ticks, limits),
        *saturated_thrust(ticks, limits),
        *held_estimates(ticks),
        *monitor_states(ticks, said),
        *hand_overs(result),
        *clipped_plans(result),
        *late_setpoints(result),
        *unread_packets(result),
        *autopilot_messages(story.messages),
    ]
    order = ("bad", "half", "none", "good")
    return tuple(sorted(found, key=lambda finding: order.index(finding.level)))


def fallbacks(ticks: Ticks, said: Said) -> list[Finding]:
    """Setpoints that no plan of the controller stood behind, with the supervisor's reasons."""
    if not ticks.on_fallback.any():
        return []
    lasted_s = lasting_s(ticks.time_s, ticks.on_fallback)
    kinds = Counter(k.replace("_", " ") for k in said.fallback[ticks.on_fallback] if k)
    why = first_words(said.reason[ticks.on_fallback])
    text = f"{_times(ticks.on_fallback)} on a fallback, {lasted_s:.2f} s in all"
    if kinds:
        text += f" ({', '.join(kinds)})"
    if why:
        text += f". The supervisor said: {why}"
    return [
        Finding(
            "half", _sentence(text), "Told always: on a fallback the trajectory is not tracked."
        )
    ]


def lost_samples(ticks: Ticks, said: Said, limits: Limits) -> list[Finding]:
    """Gaps between the samples of the state that were flown on."""
    times = ticks.time_s[ticks.phase != "silence"]
    steps = np.diff(times)
    steps = steps[steps > 0.0]
    if len(steps) < 2:
        return []
    period_s = float(np.median(steps))
    gaps = steps[steps > _GAP_PERIODS * period_s]
    if not len(gaps):
        return []
    longest_s = float(gaps.max())
    missing = int(np.round(gaps / period_s - 1.0).sum())
    text = (
        f"States were missing {len(gaps)} {_plural(len(gaps), 'time')}: about {missing} samples "
        f"of one in {period_s * 1e3:.0f} ms, for {longest_s * 1e3:.0f} ms at the longest"
    )
    oldest = said.state_age_s[np.isfinite(said.state_age_s)]
    if len(oldest) and oldest.max() > limits.state_age_s:
        text += f"; the newest one was up to {oldest.max() * 1e3:.0f} ms old"
    level: Level = "half" if longest_s > limits.state_age_s else "none"
    return [
        Finding(
            level,
            _sentence(text),
            f"Told from a gap of {_GAP_PERIODS:g} periods; from {limits.state_age_s * 1e3:.0f} ms "
            "(supervisor.state_age_limit_s) nothing is tracked.",
        )
    ]


def saturated_tilt(ticks: Ticks, limits: Limits) -> list[Finding]:
    """The controller asked for more tilt than it was given."""
    asked, given = ticks.u[:, :2], ticks.applied_u[:, :2]
    cut = np.asarray((np.abs(asked - given) > _SAME).any(axis=1))
    return _clipped(
        ticks.time_s,
        cut,
        f"The tilt command was cut off for {{}}: the controller asked for more than the limits "
        f"allow (the vehicle's {limits.tilt_deg:g}°)",
    )


def saturated_thrust(ticks: Ticks, limits: Limits) -> list[Finding]:
    """Thrust at one of its ends while a controller flew; or a climb rate that was cut off."""
    flown = np.isfinite(ticks.u).all(axis=1)
    found = []
    # Without a hover thrust the field is a climb rate, whose ends are those of u.
    is_thrust = flown & np.isfinite(ticks.hover_thrust)
    for end, name in ((limits.maximum_thrust, "highest"), (limits.minimum_thrust, "lowest")):
        sign = 1.0 if name == "highest" else -1.0
        at_end = is_thrust & (sign * (ticks.thrust - end) > -_THRUST_NEAR)
        found += _clipped(
            ticks.time_s, at_end, f"Thrust stood at its {name} value, {end:g}, for {{}}"
        )
    cut = flown & (np.abs(ticks.u[:, 2] - ticks.applied_u[:, 2]) > _SAME)
    found += _clipped(ticks.time_s, cut, "The climb rate asked for was cut off for {}")
    return found


def held_estimates(ticks: Ticks) -> list[Finding]:
    """The projection held σ̂ at its bound: the disturbance is larger than foreseen."""
    return _clipped(
        ticks.time_s,
        ticks.projecting,
        "σ̂ stood at its bound for {}: what pushes or slows the vehicle is more than the "
        "controller may make up for",
    )


def monitor_states(ticks: Ticks, said: Said) -> list[Finding]:
    """How long the in-flight monitor was not content."""
    uneasy = [s for s in dict.fromkeys(said.monitor.tolist()) if s not in ("", "nominal")]
    found = []
    for state in uneasy:
        lasted_s = lasting_s(ticks.time_s, said.monitor == state)
        found.append(
            Finding(
                "bad" if state == "failed" else "half",
                f"The in-flight monitor was at {state} for {lasted_s:.1f} s.",
                "Told always: it leaves nominal only when a gauge was beyond its bound "
                "(docs/monitor.md).",
            )
        )
    return found


def hand_overs(result: Mapping[str, Any]) -> list[Finding]:
    """Other controllers than asked for, and why."""
    return [
        Finding(
            "none" if change["cause"] == "switch" and change["handed_over"] else "half",
            _sentence(f"{change['t_s']:.1f} s after the trajectory's start: {change['text']}"),
            "Told always.",
        )
        for change in result["controller_changes"] or ()
    ]


def clipped_plans(result: Mapping[str, Any]) -> list[Finding]:
    """The MPC's bound on its input was active most of the time."""
    share = result["r_max_active_share"]
    if not share > _R_MAX_SHARE:
        return []
    return [
        Finding(
            "half",
            f"The bound r_max was active in {share:.0%} of the plans: the reference is clipped "
            "(controller.mpc.r_max_m_s2).",
            f"Told from {_R_MAX_SHARE:.0%}: now and then it is active in every hard turn.",
        )
    ]


def late_setpoints(result: Mapping[str, Any]) -> list[Finding]:
    """Setpoints that left too late, in real time."""
    missed, ticks = result["missed_deadlines"], result["ticks"]
    if not missed:
        return []
    share = missed / max(ticks, 1)
    return [
        Finding(
            "half" if share > _LATE_SHARE else "none",
            f"{missed} of {ticks} setpoints missed their deadline: no setpoint within "
            f"{_DEADLINE_MS:g} ms of a sample, or no sample within two periods.",
            f"Told always; more than one in {1 / _LATE_SHARE:.0f} is too many for a computer that "
            "flies (docs/real-time.md).",
        )
    ]


def unread_packets(result: Mapping[str, Any]) -> list[Finding]:
    """Packets whose signature was missing or wrong."""
    counts = result["rejected_packets"]
    if not counts or not any(counts.values()):
        return []
    listed = ", ".join(f"{count} {reason}" for reason, count in counts.items())
    return [
        Finding("half", f"Packets were not read for their signature: {listed}.", "Told always.")
    ]


def autopilot_messages(messages: Sequence[Message]) -> list[Finding]:
    """What the autopilot warned of."""
    grave = [m for m in messages if m.severity != "info" and m.text.startswith(_AUTOPILOT)]
    texts = list(dict.fromkeys(m.text.removeprefix(_AUTOPILOT) for m in grave))
    if not texts:
        return []
    told = "; ".join(texts[:_MOST_MESSAGES])
    more = f" (and {len(texts) - _MOST_MESSAGES} more)" if len(texts) > _MOST_MESSAGES else ""
    return [
        Finding(
            "half",
            _sentence(f"The autopilot said: {told}{more}"),
            "Told from MAVLink's severity WARNING on; all of it is in the list of messages.",
        )
    ]


def lasting_s(times_s: Array, marked: np.ndarray) -> float:
    """How long the marked samples lasted in all: each until the next one, a gap not counted."""
    if len(times_s) < 2:
        return 0.0
    steps = np.diff(times_s)
    longest = _GAP_PERIODS * float(np.median(steps))
    return float(np.minimum(steps, longest)[marked[:-1]].sum())


def first_words(reasons: np.ndarray) -> str:
    """The reasons, each once, without the figures that differ from tick to tick."""
    plain = [re.sub(r" \(.*?\)|, for [\d.]+ s$", "", str(reason)) for reason in reasons if reason]
    return "; ".join(dict.fromkeys(plain))


def _clipped(times_s: Array, marked: np.ndarray, text: str) -> list[Finding]:
    lasted_s = lasting_s(times_s, marked)
    if lasted_s < _LEAST_S:
        return []
    return [
        Finding(
            "half",
            _sentence(text.format(f"{lasted_s:.1f} s")),
            f"Told from {_LEAST_S:g} s in all: a limit that is touched for some samples does no "
            "harm.",
        )
    ]


def _times(marked: np.ndarray) -> str:
    starts = int(np.count_nonzero(np.diff(np.concatenate(([0], marked.astype(int)))) == 1))
    return "Once" if starts == 1 else f"{starts} times"


def _plural(count: int, word: str) -> str:
    return word if count == 1 else f"{word}s"


def _sentence(text: str) -> str:
    return text if text.endswith((".", "!", "?")) else f"{text}."
