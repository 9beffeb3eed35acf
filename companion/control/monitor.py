"""The in-flight monitor: is the vehicle still the one that the controller was made for?

Four gauges, each a quotient of what is seen and what it is measured against, so that 1 is the
bound:

* `y_tilde`: rms of the predictor's error over its bound, the largest of the axes.  The bound is the
  controller's own (`InnerRecord.y_tilde_bound_m_s`);
* `sigma`: the mean of |σ̂| over a share of its projection's bound, the largest of the axes: what
  rests on the bound is no estimate any more;
* `slew`: rms of the rate of the commanded tilt over a floor and a multiple of what the desired
  trajectory itself asks for.  A loop that has lost its stability shakes the command first;
* `delay`: the mean of the measured loop delay beyond the one that the controller was made for, over
  a margin.

A gauge that has nothing to measure, or nothing to measure it against, is NaN and never speaks.

From the gauges a level: `descend` while one has been above its bound for a while, straight to the
last level where one is far above; back up only after a long calm, a few times at most, and never
again once an ascent has failed.  After each change the gauges begin anew: the new controller is
judged by its own deeds.

Pure: memory and what a tick says in, memory and verdict out.  It commands nothing; the supervisor's
part of the flight acts on the verdict.
"""

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from companion.control.interfaces import InnerRecord

_SLEW_FILTER_S = 0.05
"""The command is smoothed by this before its rate is taken: noise of the state shakes single
samples of it, a loop without stability does not shake faster than the vehicle can turn."""
_NEVER_S = -math.inf


@dataclass(frozen=True, slots=True)
class MonitorLimits:
    """What the gauges are measured against, and how patient the monitor is."""

    smoothing_s: float = 0.4
    """Time constant of the gauges' means."""
    y_tilde_share: float = 1.0
    """Of the controller's bound of |ỹ|."""
    sigma_share: float = 0.95
    """Of the projection's bound."""
    slew_floor_rad_s: float = 1.0
    slew_factor: float = 1.5
    """On the slew that the desired trajectory asks for."""
    delay_made_for_s: float = math.nan
    """Loop delay that the controller was made for; NaN if none is stated."""
    delay_margin_s: float = 0.05
    severe: float = 1.6
    """A gauge above this leads straight to the last level."""
    calm: float = 0.75
    """All gauges must be below this for calm."""
    alarm_after_s: float = 0.15
    """So long a gauge must be above its bound before anything is done."""
    ascend_after_s: float = 5.0
    """So long all must be calm before the way up."""
    ascents: int = 2
    """Ways up in a flight, at most."""
    failed_within_s: float = 10.0
    """An ascent after which the way leads down again within this has failed: there is no other."""


class Gauges(NamedTuple):
    """Quotients of what is seen and its bound; NaN where there is nothing to say."""

    y_tilde: float
    sigma: float
    slew: float
    delay: float

    @property
    def worst(self) -> float:
        """The largest; 0 if none has anything to say."""
        worst = 0.0
        for value in self:
            if value > worst:  # a NaN is not
                worst = value
        return worst

    def largest(self, other: "Gauges") -> "Gauges":
        """The larger of two, one by one; what is known wins over what is not."""
        return Gauges(
            *(b if math.isnan(a) or b > a else a for a, b in zip(self, other, strict=True))
        )

    def above(self, limit: float) -> tuple[str, ...]:
        """What stands above a limit, for a person."""
        names = ("ỹ", "σ̂", "setpoint slew", "delay")
        return tuple(
            f"{name} {value:.1f} × its bound"
            for name, value in zip(names, self, strict=True)
            if value > limit
        )


NO_GAUGES = Gauges(math.nan, math.nan, math.nan, math.nan)


# Seen, Smoothed, MonitorMemory and MonitorVerdict are made at every tick, and frozen
# they take several times as long to make: change none.
@dataclass(slots=True)
class Seen:
    """What a tick says to the monitor."""

    time_s: float
    """Autopilot's."""
    inner: InnerRecord
    roll_rad: float
    """Commanded."""
    pitch_rad: float
    """Commanded."""
    loop_delay_s: float
    desired_slew_rad_s: float
    """Rate of the tilt that the desired trajectory itself asks for; 0 if it is not known."""


@dataclass(slots=True)
class Smoothed:
    """Means that the gauges are made of; NaN before there was anything."""

    y_tilde_square: float = math.nan
    """Of (ỹ / bound)²."""
    sigma: float = math.nan
    """Of |σ̂| / bound."""
    slew_square: float = 0.0
    """Of the rate of the smoothed command, (rad/s)²."""
    delay_s: float = math.nan
    roll_rad: float = math.nan
    """Command after its own filter."""
    pitch_rad: float = math.nan


@dataclass(slots=True)
class MonitorMemory:
    """What the monitor carries from tick to tick."""

    level: int = 0
    """0: as configured."""
    smoothed: Smoothed = field(default_factory=Smoothed)
    time_s: float = _NEVER_S
    """Of the last tick."""
    alarm_since_s: float | None = None
    severe_since_s: float | None = None
    calm_since_s: float | None = None
    ascents: int = 0
    ascended_s: float = _NEVER_S
    """Time of the last way up."""


@dataclass(slots=True)
class MonitorVerdict:
    """What the monitor makes of a tick."""

    level: int
    """At which the flight should go on; 0: as configured."""
    gauges: Gauges
    reasons: tuple[str, ...]
    """Why the level has just changed, or what stands above its bound; empty if nothing does."""
    alarm: bool
    """A gauge has been above its bound for long enough."""


def step(
    limits: MonitorLimits, memory: MonitorMemory, seen: Seen, lowest: int
) -> tuple[MonitorMemory, MonitorVerdict]:
    """Look at a tick.

    Args:
        limits: the monitor's.
        memory: of the tick before.
        seen: the tick.
        lowest: number of the last level that there is; 0 if there is only the one.
    """
    dt_s = seen.time_s - memory.time_s
    smoothed = _smooth(limits, memory.smoothed, seen, dt_s if math.isfinite(dt_s) else 0.0)
    gauges = _gauges(limits, smoothed, seen.desired_slew_rad_s)
    worst, now_s = gauges.worst, seen.time_s
    watched = MonitorMemory(
        level=memory.level,
        smoothed=smoothed,
        time_s=now_s,
        alarm_since_s=_since(memory.alarm_since_s, now_s, holds=worst > 1.0),
        severe_since_s=_since(memory.severe_since_s, now_s, holds=worst > limits.severe),
        calm_since_s=_since(memory.calm_since_s, now_s, holds=worst < limits.calm),
        ascents=memory.ascents,
        ascended_s=memory.ascended_s,
    )
    if worst <= 1.0 and memory.level == 0:
        return watched, MonitorVerdict(0, gauges, (), False)  # the usual tick
    alarm = _lasted(watched.alarm_since_s, now_s, limits.alarm_after_s)
    reasons = gauges.above(1.0) if alarm else ()
    if alarm and memory.level < lowest:
        severe = _lasted(watched.severe_since_s, now_s, limits.alarm_after_s)
        failed = now_s - memory.ascended_s < limits.failed_within_s
        level = lowest if severe or failed else memory.level + 1
        ascents = limits.ascents if failed else memory.ascents
        changed = at_level(replace(watched, ascents=ascents), level)
        return changed, MonitorVerdict(level, gauges, reasons, alarm)
    calm = _lasted(watched.calm_since_s, now_s, limits.ascend_after_s)
    if calm and memory.level > 0 and memory.ascents < limits.ascents:
        level = memory.level - 1
        changed = replace(at_level(watched, level), ascents=memory.ascents + 1, ascended_s=now_s)
        return changed, MonitorVerdict(level, gauges, _calm(limits), alarm)
    return watched, MonitorVerdict(memory.level, gauges, reasons, alarm)


def at_level(memory: MonitorMemory, level: int) -> MonitorMemory:
    """The memory at another level: what flies there is judged by its own deeds."""
    kept = Smoothed(delay_s=memory.smoothed.delay_s)
    return replace(
        memory,
        level=level,
        smoothed=kept,
        alarm_since_s=None,
        severe_since_s=None,
        calm_since_s=None,
    )


def settled(limits: MonitorLimits, memory: MonitorMemory, level: int) -> MonitorMemory:
    """The memory at a level from which there is no way up, because what is above it has failed."""
    return replace(at_level(memory, level), ascents=limits.ascents)


def _calm(limits: MonitorLimits) -> tuple[str, ...]:
    return (f"calm for {limits.ascend_after_s:g} s",)


def _since(since_s: float | None, now_s: float, *, holds: bool) -> float | None:
    if not holds:
        return None
    return now_s if since_s is None else since_s


def _lasted(since_s: float | None, now_s: float, long_s: float) -> bool:
    return since_s is not None and now_s - since_s >= long_s - 1e-6


def _smooth(limits: MonitorLimits, before: Smoothed, seen: Seen, dt_s: float) -> Smoothed:
    share = 1.0 - math.exp(-dt_s / limits.smoothing_s)
    y_tilde, sigma = _quotients(seen.inner)
    delay_s = seen.loop_delay_s - limits.delay_made_for_s
    delay_s = 0.0 if delay_s < 0.0 else delay_s  # and not a number if none is stated
    # The command's rate, of the command behind its own filter.
    follow = 1.0 - math.exp(-dt_s / _SLEW_FILTER_S)
    roll = _mean(before.roll_rad, seen.roll_rad, follow)
    pitch = _mean(before.pitch_rad, seen.pitch_rad, follow)
    slew_square = before.slew_square
    if dt_s > 0.0 and math.isfinite(before.roll_rad):
        rate = math.hypot(roll - before.roll_rad, pitch - before.pitch_rad) / dt_s
        slew_square += share * (rate * rate - slew_square)
    return Smoothed(
        # From nothing: a single sample is no rms.
        y_tilde_square=_mean(before.y_tilde_square, y_tilde * y_tilde, share, 0.0),
        sigma=_mean(before.sigma, sigma, share, 0.0),
        slew_square=slew_square,
        delay_s=_mean(before.delay_s, delay_s, share),
        roll_rad=roll,
        pitch_rad=pitch,
    )


def _mean(before: float, new: float, share: float, begin: float = math.nan) -> float:
    """The mean moved by a share towards a new value; what is not finite is passed over."""
    if not math.isfinite(new):
        return before
    if not math.isfinite(before):
        if not math.isfinite(begin):
            return new
        before = begin
    return before + share * (new - before)


def _quotients(inner: InnerRecord) -> tuple[float, float]:
    """|ỹ| and |σ̂| over their bounds, the largest of the axes; NaN where nothing is known."""
    return (
        _largest(inner.y_tilde_m_s.tolist(), inner.y_tilde_bound_m_s.tolist()),
        _largest(inner.sigma_hat.tolist(), inner.sigma_bound.tolist()),
    )


def _largest(values: list[float], bounds: list[float]) -> float:
    largest = -1.0
    for value, bound in zip(values, bounds, strict=True):
        if bound > 0.0:
            quotient = abs(value) / bound
            if largest < quotient < math.inf:
                largest = quotient
    return largest if largest >= 0.0 else math.nan


def _gauges(limits: MonitorLimits, smoothed: Smoothed, desired_slew_rad_s: float) -> Gauges:
    slew_bound = slew_bound_rad_s(limits, desired_slew_rad_s)
    return Gauges(
        y_tilde=math.sqrt(smoothed.y_tilde_square) / limits.y_tilde_share,
        sigma=smoothed.sigma / limits.sigma_share,
        slew=math.sqrt(smoothed.slew_square) / slew_bound,
        delay=smoothed.delay_s / limits.delay_margin_s,
    )


def slew_bound_rad_s(limits: MonitorLimits, desired_slew_rad_s: float) -> float:
    """What the rms of the command's rate is measured against."""
    return limits.slew_floor_rad_s + limits.slew_factor * desired_slew_rad_s
