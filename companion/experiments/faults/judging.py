"""Whether a flight kept what its row promises, and what every flight promises.

Every flight: no tilt beyond the vehicle's limit; no setpoint that is not finite, bounded and fresh;
none, and no command, after somebody else has taken over; nothing armed twice.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.experiments.faults.endings import (
    ending_of,
    largest,
    slide_m_s,
    touchdown_m_s,
)
from companion.experiments.faults.evidence import Evidence, Said, TruePath
from companion.experiments.faults.table import Promise
from companion.experiments.faults.wire_log import Commanded

_FARTHEST_M = 50.0
"""From home; what is farther has flown away."""
_TRUE_TILT_MORE_RAD = math.radians(10.0)
"""So far the true tilt swings beyond the limit of what is commanded."""
_TILT_TOLERANCE_RAD = math.radians(0.1)
"""Of float32, and of the two angles' order."""
_LARGEST_RATE_RAD_S = 12.0
_OBEYED_WITHIN_S = 0.03
"""Three ticks: what is on its way when somebody takes over."""
_TRUTH_LATE_S = 0.03
"""The truth of a moment arrives up to so much later than what the vehicle sends in it."""
_DISARMING = ("disarm", "reboot")
"""Events of the truth after which the vehicle is not armed."""
_LEVEL_RAD = math.radians(0.01)


@dataclass(frozen=True, slots=True)
class Limits:
    """What a flight's configuration says."""

    tilt_rad: float
    state_age_s: float
    """The oldest state that setpoints may be based on, unless they are level."""


@dataclass(frozen=True, slots=True)
class Measured:
    """Figures of a flight; NaN where there is nothing to say."""

    ending: str
    """One of the endings that rows promise, or `drifting`, `not flown`."""
    began_s: float
    """Of the fault, since the flight's first packet."""
    detected_after_s: float
    detected_by: str
    said_after_s: float
    """What the row says will be said, since the fault began."""
    handed_over_after_s: float
    """Since the fault began."""
    largest_tilt_deg: float
    """That was commanded."""
    true_tilt_deg: float
    flown_tilt_deg: float
    """The true one, as long as the companion flew."""
    touchdown_m_s: float
    slide_m_s: float
    """Sideways, as it met the ground."""
    oldest_state_s: float
    """Behind a setpoint that was not level."""
    late_setpoints: int
    """After a takeover."""
    late_commands: int
    """That are about motion, after somebody else has taken over."""
    arm_commands: int
    arm_again: int
    """Of these, how many after it was known to be armed, or after it has truly disarmed."""
    mean_error_mm: float
    worst_error_mm: float
    from_home_m: float
    """Horizontally, where it ended, from where it stood."""
    farthest_m: float
    """Horizontally, at most."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """Of one flight."""

    broken: tuple[str, ...]
    """A sentence for each promise that was not kept; empty if all were."""
    measured: Measured

    @property
    def passed(self) -> bool:
        """Whether all was kept."""
        return not self.broken


def judge(promise: Promise, evidence: Evidence, limits: Limits) -> Judgement:
    """Judge a flight.

    Args:
        promise: of its row.
        evidence: the flight.
        limits: of its configuration.
    """
    measured = measure(promise, evidence)
    broken = [*_of_all(evidence, limits, measured), *_of_the_row(promise, evidence, measured)]
    return Judgement(tuple(broken), measured)


def measure(promise: Promise, evidence: Evidence) -> Measured:
    """The figures of a flight."""
    began_s = _began_s(promise, evidence)
    detected = _detected(promise, evidence, began_s)
    named = _named(promise, evidence, began_s)
    sent, path, tracked = evidence.sent, evidence.path, evidence.tracked
    tilted = sent.tilt_rad >= _LEVEL_RAD
    scored = tracked.error_m[tracked.scored]
    first_s = float(path.time_s[0]) if len(path.time_s) else 0.0
    return Measured(
        ending=ending_of(evidence),
        began_s=began_s - first_s,
        detected_after_s=math.nan if detected is None else max(0.0, detected.time_s - began_s),
        detected_by="" if detected is None else detected.text,
        said_after_s=math.nan if named is None else max(0.0, named.time_s - began_s),
        handed_over_after_s=_handed_over_after_s(evidence, began_s),
        largest_tilt_deg=math.degrees(largest(sent.tilt_rad)),
        true_tilt_deg=math.degrees(largest(path.tilt_rad)),
        flown_tilt_deg=math.degrees(_flown_tilt_rad(evidence)),
        touchdown_m_s=touchdown_m_s(path),
        slide_m_s=slide_m_s(path),
        oldest_state_s=largest(sent.state_age_s[tilted]),
        late_setpoints=_late_setpoints(evidence),
        late_commands=len(_late_commands(evidence)),
        arm_commands=len(evidence.arm_commands_s),
        arm_again=_arm_again(evidence),
        mean_error_mm=float(scored.mean()) * 1e3 if len(scored) else math.nan,
        worst_error_mm=largest(scored) * 1e3,
        from_home_m=_from_home_m(path),
        farthest_m=_farthest_m(path),
    )


def _of_all(evidence: Evidence, limits: Limits, measured: Measured) -> list[str]:
    """What every flight promises."""
    sent = evidence.sent
    broken = []
    if not sent.finite.all():
        broken.append(f"{int((~sent.finite).sum())} setpoints are not finite")
    bounded = (sent.thrust >= 0.0) & (sent.thrust <= 1.0) & (sent.rate_rad_s <= _LARGEST_RATE_RAD_S)
    if not bounded[sent.finite].all():
        broken.append("a thrust or a body rate is out of bounds")
    if measured.largest_tilt_deg > math.degrees(limits.tilt_rad + _TILT_TOLERANCE_RAD):
        broken.append(
            f"a tilt of {measured.largest_tilt_deg:.1f}° was commanded, and "
            f"{math.degrees(limits.tilt_rad):.1f}° is the limit"
        )
    if measured.flown_tilt_deg > math.degrees(limits.tilt_rad + _TRUE_TILT_MORE_RAD):
        broken.append(
            f"it tilted by {measured.flown_tilt_deg:.1f}° while the companion flew it, and "
            f"{math.degrees(limits.tilt_rad):.1f}° is the limit"
        )
    if measured.farthest_m > _FARTHEST_M:
        broken.append(
            f"it went {measured.farthest_m:.0f} m from home, and {_FARTHEST_M:g} m is far"
        )
    if measured.oldest_state_s > limits.state_age_s:
        broken.append(
            f"a setpoint was based on a state {measured.oldest_state_s * 1e3:.0f} ms old, and "
            f"{limits.state_age_s * 1e3:.0f} ms is the limit"
        )
    if measured.late_setpoints:
        broken.append(f"{measured.late_setpoints} setpoints were sent after a takeover")
    late = _late_commands(evidence)
    if late:
        names = ", ".join(sorted({command.label for command in late}))
        broken.append(f"{len(late)} commands were sent after a takeover: {names}")
    if measured.arm_again:
        broken.append(f"it was commanded to arm again, {measured.arm_again} times")
    return broken


def _of_the_row(promise: Promise, evidence: Evidence, measured: Measured) -> list[str]:
    broken = []
    if measured.ending not in promise.endings:
        told = " or ".join(promise.endings)
        broken.append(f"it ended as '{measured.ending}', not {told} ({evidence.note or 'no note'})")
    if promise.completed is not None and promise.completed != evidence.completed:
        broken.append(
            "the trajectory was " + ("not " if promise.completed else "") + "flown to its end"
        )
    began_s = _began_s(promise, evidence)
    if promise.begins is not None and math.isnan(began_s):
        broken.append(f"the fault did not begin: the truth tells of no '{promise.begins}'")
    seen = measured.detected_after_s if promise.says is None else measured.said_after_s
    for limit, value, what in (
        (promise.within_s, seen, "seen" if promise.says is None else f"told of '{promise.says}'"),
        (promise.handed_over_within_s, measured.handed_over_after_s, "handed over"),
    ):
        if limit is not None and not value <= limit:
            told = "never" if math.isnan(value) else f"after {value:.2f} s"
            broken.append(f"it was {what} {told}, not within {limit:g} s")
    since_s = -math.inf if math.isnan(began_s) else began_s - _TRUTH_LATE_S
    for text, of_autopilot in ((promise.says, False), (promise.autopilot_says, True)):
        if text is not None and not _was_said(evidence, text, since_s, of_autopilot=of_autopilot):
            who = "the autopilot" if of_autopilot else "the companion"
            broken.append(f"{who} did not say '{text}'")
    for limit, value, what in (
        (promise.mean_error_mm, measured.mean_error_mm, "mean"),
        (promise.worst_error_mm, measured.worst_error_mm, "worst"),
    ):
        if limit is not None and not value <= limit:
            broken.append(f"the {what} error is {value:.0f} mm, not at most {limit:g} mm")
    return broken


_AUTOPILOT = "the autopilot says: "
_HANDED_OVER = "handed over"
"""The phase."""


def _was_said(evidence: Evidence, text: str, since_s: float, *, of_autopilot: bool) -> bool:
    return any(
        text in said.text and said.time_s >= since_s
        for said in evidence.said
        if said.text.startswith(_AUTOPILOT) == of_autopilot
    )


def _began_s(promise: Promise, evidence: Evidence) -> float:
    times = [begun.time_s for begun in evidence.begun if begun.name == promise.begins]
    return min(times) if times else math.nan


def _detected(promise: Promise, evidence: Evidence, began_s: float) -> Said | None:
    """The first word about a fault: a warning, an error, or what the row says will be said.

    None if the row does not promise that it is seen.
    """
    if promise.within_s is None and promise.says is None:
        return None
    for said in evidence.said:
        early = math.isnan(began_s) or said.time_s < began_s - _TRUTH_LATE_S
        if early or said.text.startswith(_AUTOPILOT):
            continue
        promised = promise.says is not None and promise.says in said.text
        if promised or said.severity in ("warning", "error"):
            return said
    return None


def _named(promise: Promise, evidence: Evidence, began_s: float) -> Said | None:
    """The first text about a fault that is what the row says will be said."""
    if promise.says is None or math.isnan(began_s):
        return None
    for said in evidence.said:
        early = said.time_s < began_s - _TRUTH_LATE_S
        if not early and promise.says in said.text and not said.text.startswith(_AUTOPILOT):
            return said
    return None


def _handed_over_after_s(evidence: Evidence, began_s: float) -> float:
    for time_s, name in evidence.phases:
        if name == _HANDED_OVER and time_s >= began_s - _TRUTH_LATE_S:
            return max(0.0, time_s - began_s)
    return math.nan


def _late_setpoints(evidence: Evidence) -> int:
    if evidence.taken_over_s is None:
        return 0
    return int((evidence.sent.time_s > evidence.taken_over_s + _OBEYED_WITHIN_S).sum())


def _late_commands(evidence: Evidence) -> list[Commanded]:
    """After the vehicle was in a mode that the companion had not commanded."""
    if evidence.others_s is None:
        return []
    since_s = evidence.others_s + _OBEYED_WITHIN_S
    return [c for c in evidence.commands if c.moves and c.time_s > since_s]


def _arm_again(evidence: Evidence) -> int:
    """Commands to arm what is known to be armed, or what somebody has disarmed, known or not.

    What is repeated because its answer was lost arms a second time if the vehicle has been
    disarmed meanwhile; so it ends where a heartbeat says that it is armed.
    """
    since_s = [begun.time_s for begun in evidence.begun if begun.name in _DISARMING]
    if evidence.armed_s is not None:
        since_s.append(evidence.armed_s + _OBEYED_WITHIN_S)
    if evidence.disarmed_s is not None:
        since_s.append(evidence.disarmed_s)
    return sum(time_s > min(since_s, default=math.inf) for time_s in evidence.arm_commands_s)


def _flown_tilt_rad(evidence: Evidence) -> float:
    """The largest true tilt until the vehicle was another's, or its motors stood."""
    over_s = [begun.time_s for begun in evidence.begun if begun.name in _DISARMING]
    over_s += [time_s for time_s, name in evidence.phases if name == _HANDED_OVER]
    over_s.append(evidence.ended_s)
    if evidence.taken_over_s is not None:
        over_s.append(evidence.taken_over_s)
    return largest(evidence.path.tilt_rad[evidence.path.time_s <= min(over_s)])


def _farthest_m(path: TruePath) -> float:
    if not len(path.time_s):
        return math.nan
    away = path.position_enu_m - path.position_enu_m[0]
    return largest(np.hypot(away[:, 0], away[:, 1]))


def _from_home_m(path: TruePath) -> float:
    if not len(path.time_s):
        return math.nan
    away = path.position_enu_m[-1] - path.position_enu_m[0]
    return math.hypot(away[0], away[1])
