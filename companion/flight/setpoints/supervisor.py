"""The ladder of fallbacks: what leaves the companion when something is not well.

Pure decisions: facts of a tick in, a rung and its reason out.  Rungs, from the top:

1. ``TRACK``: the controller's command.  (A failed solve is bridged inside the controller, by the
   shifted plan and then the clipped closed form; the supervisor counts how long.)
2. ``LEVEL``: level, thrust of hover, while the state is stale, the loop's delay too long, or the
   command unusable.
3. ``HAND_OVER``: the stream stops and the autopilot's own failsafe takes over.  There is no way
   back up from here but a person's *resume*.

Time on ``LEVEL`` is added up, and forgotten at a quarter of the speed while all is well: a fault
that comes and goes must end with the autopilot too, a single short one must not.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

_FORGETTING = 0.25
"""Seconds on LEVEL that a second on TRACK makes up for."""

_FENCE_MARGIN_M = 0.5
_DELAY_SMOOTHING_S = 0.3
"""A few samples that come late are no slow loop."""
_FAST_AGAIN = 0.8
"""Of the limit: below it the loop counts as fast again."""

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
    loop_delay_limit_s: float = math.inf
    """No controller flies on a loop that is slower in the mean."""
    jump_limit_m: float = math.inf
    """An estimate that steps further is not followed."""
    fence_low_m: tuple[float, float, float] = (-math.inf, -math.inf, -math.inf)
    """The geofence, ENU m: a vehicle that reports itself well outside is not flown on."""
    fence_high_m: tuple[float, float, float] = (math.inf, math.inf, math.inf)

    def about(self, anchor_enu_m: tuple[float, float, float]) -> "SupervisorLimits":
        """The same limits with the geofence about a point (ENU m)."""
        (lx, ly, lz), (hx, hy, hz), (x, y, z) = self.fence_low_m, self.fence_high_m, anchor_enu_m
        return replace(
            self, fence_low_m=(lx + x, ly + y, lz + z), fence_high_m=(hx + x, hy + y, hz + z)
        )

    def breach(self, position_enu_m: tuple[float, float, float]) -> str:
        """What is wrong with a position; empty if nothing.

        The MPC's bound is soft: a little outside is well.
        """
        (lx, ly, lz), (hx, hy, hz) = self.fence_low_m, self.fence_high_m
        x, y, z = position_enu_m
        beyond = max(lx - x, x - hx, ly - y, y - hy, lz - z, z - hz)
        return f"{beyond:.1f} m outside the geofence" if beyond > _FENCE_MARGIN_M else ""


class Facts(NamedTuple):
    """What a tick knows about itself."""

    now_s: float
    """Autopilot's time."""
    state_age_s: float
    """Since the newest usable sample arrived; 0 at the sample itself."""
    problem: str
    """What is wrong with the controller's command, or with the samples that came; empty if
    nothing is."""
    plan_solved: bool
    """The newest plan is an optimum, not a fallback for one."""
    loop_delay_s: float = math.nan
    """From the sample's time until a setpoint acts; NaN without a sample."""


class SupervisorMemory(NamedTuple):
    """What the ladder remembers between ticks."""

    rung: Rung = Rung.TRACK
    level_s: float = 0.0
    """Time on LEVEL, less what has been forgotten of it."""
    judged_s: float = -math.inf
    """Autopilot's time of the last tick."""
    unsolved_since_s: float | None = None
    reason: str = ""
    delay_s: float = 0.0
    """Mean of the loop's delay."""
    slow: bool = False
    """The loop counts as too slow."""


def judge(limits: SupervisorLimits, memory: SupervisorMemory, facts: Facts) -> SupervisorMemory:
    """Decide the rung for a tick; the reason says why it is not the top one."""
    if memory.rung is Rung.HAND_OVER:
        return memory
    # Ticks of samples and ticks of silence have clocks that differ by the jitter of the link.
    now = max(facts.now_s, memory.judged_s)
    passed = now - memory.judged_s if math.isfinite(memory.judged_s) else 0.0
    if memory.rung is Rung.LEVEL:
        level_s = memory.level_s + passed
    else:
        level_s = max(0.0, memory.level_s - _FORGETTING * passed)
    unsolved_since = None
    if not facts.plan_solved:
        unsolved_since = now if memory.unsolved_since_s is None else memory.unsolved_since_s

    delay_s = _mean_delay_s(memory, facts, passed)
    slow = delay_s > (_FAST_AGAIN if memory.slow else 1.0) * limits.loop_delay_limit_s
    stale = facts.state_age_s > limits.state_age_limit_s
    if stale:
        reason = f"no usable state for more than {limits.state_age_limit_s * 1e3:.0f} ms"
        if facts.problem:
            reason += f" ({facts.problem})"
    else:
        # While it starts again, what made it stop is still the reason.
        reason = memory.reason if facts.problem == RESTARTING else facts.problem
        if slow and facts.problem in ("", RESTARTING):
            reason = (
                f"a setpoint acts more than {limits.loop_delay_limit_s * 1e3:.0f} ms after the "
                "state that it was made of: the link is too slow, or this computer"
            )
    rung = Rung.LEVEL if stale or slow or facts.problem else Rung.TRACK
    # By its age as well: a clock that was set does not tell how long it has been.
    long_stale = facts.state_age_s > limits.state_age_limit_s + limits.hand_over_after_s
    if rung is Rung.LEVEL and (level_s > limits.hand_over_after_s or long_stale):
        rung = Rung.HAND_OVER
        reason = f"{reason}, for {limits.hand_over_after_s:g} s"
    if unsolved_since is not None and now - unsolved_since > limits.failed_solves_s:
        rung = Rung.HAND_OVER
        reason = f"no plan could be solved for {limits.failed_solves_s:g} s"
    return SupervisorMemory(rung, level_s, now, unsolved_since, reason, delay_s, slow)


def _mean_delay_s(memory: SupervisorMemory, facts: Facts, passed_s: float) -> float:
    if math.isnan(facts.loop_delay_s):
        return memory.delay_s
    share = 1.0 - math.exp(-passed_s / _DELAY_SMOOTHING_S)
    return memory.delay_s + share * (facts.loop_delay_s - memory.delay_s)
