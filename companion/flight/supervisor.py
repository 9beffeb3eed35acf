"""The ladder of fallbacks: what leaves the companion when something is not well.

Pure decisions: facts of a tick in, a rung and its reason out.  Rungs, from the top:

1. ``TRACK``: the controller's command.  (A failed solve is bridged inside the controller, by the
   shifted plan and then the clipped closed form; the supervisor counts how long.)
2. ``LEVEL``: level, thrust of hover, while the state is stale or the command unusable.
3. ``HAND_OVER``: the stream stops and the autopilot's own failsafe takes over.  There is no way
   back up from here but a person's *resume*.
"""

from dataclasses import dataclass, replace
from enum import Enum

RESTARTING = "restarting"
"""The problem of a tick at which the controller starts again: it has no command yet."""


class Rung(Enum):
    """What is sent."""

    TRACK = "track"
    LEVEL = "level"
    HAND_OVER = "hand over"


@dataclass(frozen=True, slots=True)
class SupervisorLimits:
    """When a rung is left; times in seconds of the autopilot's clock."""

    state_age_limit_s: float
    hand_over_after_s: float
    failed_solves_s: float


@dataclass(frozen=True, slots=True)
class Facts:
    """What a tick knows about itself."""

    now_s: float
    """Autopilot's time."""
    state_age_s: float
    """Since the newest usable sample arrived; 0 at the sample itself."""
    problem: str
    """What is wrong with the controller's command; empty if it may be sent."""
    plan_solved: bool
    """The newest plan is an optimum, not a fallback for one."""


@dataclass(frozen=True, slots=True)
class SupervisorMemory:
    """What the ladder remembers between ticks."""

    rung: Rung = Rung.TRACK
    level_since_s: float | None = None
    unsolved_since_s: float | None = None
    reason: str = ""


def judge(limits: SupervisorLimits, memory: SupervisorMemory, facts: Facts) -> SupervisorMemory:
    """Decide the rung for a tick; the reason says why it is not the top one."""
    if memory.rung is Rung.HAND_OVER:
        return memory
    unsolved_since = None
    if not facts.plan_solved:
        unsolved_since = facts.now_s if memory.unsolved_since_s is None else memory.unsolved_since_s
        if facts.now_s - unsolved_since > limits.failed_solves_s:
            return replace(
                memory,
                rung=Rung.HAND_OVER,
                reason=f"no plan could be solved for {limits.failed_solves_s:g} s",
            )
    stale = facts.state_age_s > limits.state_age_limit_s
    if not stale and not facts.problem:
        return SupervisorMemory(Rung.TRACK, None, unsolved_since, "")
    if stale:
        reason = f"no usable state for more than {limits.state_age_limit_s * 1e3:.0f} ms"
    else:
        reason = memory.reason if facts.problem == RESTARTING else facts.problem
    since = facts.now_s if memory.level_since_s is None else memory.level_since_s
    if facts.now_s - since > limits.hand_over_after_s:
        return SupervisorMemory(
            Rung.HAND_OVER, since, unsolved_since, f"{reason}, for {limits.hand_over_after_s:g} s"
        )
    return SupervisorMemory(Rung.LEVEL, since, unsolved_since, reason)
