"""Steps of the estimate: what a reset of the estimator, or a glitch, does to the vehicle's place.

The vehicle has not moved; what is known of its place has.  A step that is small enough is followed
without a bump: the controller goes on in a frame that is shifted by the step, so that none of its
laws notices, and in that frame the reference slides to where the estimate now says that it belongs,
slowly enough to be tracked, and with the preview that a plan needs.  Steps that come to more than
that since the engagement end tracking, unless the estimate comes back: of two places that far apart
one is wrong, and which one nobody here can tell.  So do steps without end, however small.

A heading that steps is taken as it comes.  Its error turns every acceleration that is commanded
and takes the phase margin by as much: beyond some degrees the loops swing for ever.

An estimator may announce a step (ODOMETRY's `reset_counter`); one that does not betrays it by a
place that its velocity does not lead to.

Pure: memory and a sample in, memory and verdict out.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from companion.control.reference_model import Array
from companion.frames import Vector3, wrap_angle_rad, yaw_of
from companion.vehicle_state import VehicleState

Positions = Callable[[Array], Array]

_NONE: Vector3 = (0.0, 0.0, 0.0)
_NOTICED_M = 0.10
"""A smaller step is not told from the noise of an estimate, unless it is announced."""
_WORTH_M = 0.02
"""A smaller step does no harm as it is."""
_NOTICED_M_S = 1.0
_NOTICED_RAD = math.radians(5.0)
_LARGEST_M_S = 3.0
_LARGEST_RAD = math.radians(11.0)
"""All steps of the heading since the engagement, added up."""
_WORTH_RAD = math.radians(3.0)
_TURNING_RAD_S = 6.0
_TURNING_ANNOUNCED_RAD_S = 1.0
"""By so much the rates may miss the heading's change while the vehicle tilts."""
_ACCELERATION_M_S2 = 20.0
"""No vehicle of this kind accelerates harder: a velocity changes by so much without a step."""
_LEVEL_M_S2 = 5.0
"""The same of one that flies level, as it does while no samples come."""
_GAP_S = 0.1
"""Samples that are further apart than this have such a silence between them."""
_LONGEST_GAP_S = 1.0
"""After a longer silence nothing is known of where it must be: only announced steps are seen."""
_SLIDE_M_S = 0.3
_SHORTEST_SLIDE_S = 1.5
_MOST_STEPS = 20
"""An estimate whose place, velocity or heading steps more often is not one to fly on."""
_PREVIEW_S = 1.5
"""A plan sees so far ahead: a slide begins beyond it, so that no plan has a kink."""
_PEAK_SPEED = 1.875
"""Greatest slope of the smooth step over a unit of time."""


@dataclass(frozen=True, slots=True)
class Slide:
    """A step that is being followed."""

    shift_m: Vector3
    """The step, ENU."""
    begun_s: float
    """By the autopilot's clock."""
    lasts_s: float

    def done(self, times_s: Array) -> Array:
        """Shares (samples,) of the step that are done at times, 0 … 1: smooth, of 5th order."""
        s = np.clip((times_s - self.begun_s) / self.lasts_s, 0.0, 1.0)
        shares: Array = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
        return shares


# Made at every tick, and frozen it takes several times as long to make: change none.
@dataclass(slots=True)
class Footing:
    """What is remembered of the estimate from sample to sample."""

    newest: VehicleState | None = None
    shift_m: Vector3 = _NONE
    """Steps that were followed, added up, ENU: by so much the controller's frame is shifted."""
    slides: tuple[Slide, ...] = ()
    """By which they were, oldest first: one after the other, as their speeds would add up."""
    steps: int = 0
    """Steps of the place that were followed."""
    steps_m_s: int = 0
    turned_rad: float = 0.0
    steps_rad: int = 0
    """The same of the velocity, and of the heading with the sum of what it has stepped by."""
    astray_m: Vector3 = _NONE
    """Steps of the place that are not followed, added up, ENU."""
    astray_m_s: Vector3 = _NONE
    astray_rad: float = 0.0
    """The same of velocity and heading."""

    @property
    def sound(self) -> bool:
        """Nothing is astray, and there have not been too many steps."""
        return (
            self.astray_m == _NONE
            and self.astray_m_s == _NONE
            and self.astray_rad == 0.0
            and self.steps <= _MOST_STEPS
            and self.steps_m_s <= _MOST_STEPS
            and self.steps_rad <= _MOST_STEPS
        )


@dataclass(frozen=True, slots=True)
class Step:
    """What a sample shows."""

    problem: str = ""
    """Why nothing may be flown on the estimate; empty if it may."""
    remark: str = ""
    """For a person, of a step that is followed; empty if there is none."""
    restart: bool = False
    """The velocity has stepped: what the laws remember of it is not true any more."""


_NOTHING_SEEN = Step()


def step(footing: Footing, state: VehicleState, followed_m: float) -> tuple[Footing, Step]:
    """Look at a sample.

    Args:
        footing: of the sample before.
        state: the sample, later than that.
        followed_m: a larger step of the place is not followed.
    """
    before = footing.newest
    moved = Footing(
        state,
        footing.shift_m,
        footing.slides,
        footing.steps,
        footing.steps_m_s,
        footing.turned_rad,
        footing.steps_rad,
        footing.astray_m,
        footing.astray_m_s,
        footing.astray_rad,
    )
    passed_s = 0.0 if before is None else state.time_s - before.time_s
    if before is None or passed_s <= 0.0:
        return moved, _verdict(moved, followed_m)
    announced = state.reset_counter != before.reset_counter
    if passed_s > _LONGEST_GAP_S and not announced:
        return moved, _verdict(moved, followed_m)
    jump_m = _jump_m(before, state, passed_s)
    jump_m_s = _minus(state.velocity_enu_m_s, before.velocity_enu_m_s)
    turned = before.rate_flu_rad_s[2] * passed_s
    yaws = yaw_of(state.attitude_flu_to_enu) - yaw_of(before.attitude_flu_to_enu)
    jump_rad = wrap_angle_rad(yaws - turned)
    noticed_m, noticed_m_s, noticed_rad = _noticed(passed_s, announced)
    still = math.hypot(*jump_m) <= noticed_m
    still_m_s = math.hypot(*jump_m_s) <= noticed_m_s
    still_rad = abs(jump_rad) <= noticed_rad
    if still and still_m_s and still_rad and footing.sound:
        return moved, _NOTHING_SEEN
    if still:
        jump_m = _NONE
    if still_m_s:
        jump_m_s = _NONE
    if still_rad:
        jump_rad = 0.0
    moved = replace(
        moved,
        astray_m=_plus(footing.astray_m, jump_m),
        astray_m_s=_plus(footing.astray_m_s, jump_m_s),
        astray_rad=footing.astray_rad + jump_rad,
    )
    verdict = _verdict(moved, followed_m)
    if verdict.problem:
        return moved, verdict
    remark = _told(jump_m, jump_m_s, jump_rad, announced)
    moved = replace(
        moved,
        steps_m_s=moved.steps_m_s + (jump_m_s != _NONE),
        steps_rad=moved.steps_rad + (jump_rad != 0.0),
    )
    return _followed(moved), Step(remark=remark, restart=jump_m_s != _NONE)


def seen(footing: Footing, state: VehicleState) -> VehicleState:
    """The sample as the controller is to see it: in the shifted frame."""
    if not footing.slides:
        return state
    return replace(state, position_enu_m=_minus(state.position_enu_m, footing.shift_m))


def slid(footing: Footing, position: Positions) -> Positions:
    """The reference as the controller is to see it: in the shifted frame, sliding.

    Args:
        footing: of the sample.
        position: desired positions (samples, 3), ENU m, at times of the autopilot's clock.
    """
    if not footing.slides:
        return position

    def shifted(times_s: Array) -> Array:
        desired = position(times_s)
        for slide in footing.slides:
            desired = desired - slide.done(times_s)[:, None] * np.array(slide.shift_m)
        return desired

    return shifted


def _noticed(passed_s: float, announced: bool) -> tuple[float, float, float]:
    """What acceleration and turning that are not known of may have done is no step.

    Returns:
        The largest change of place (m), velocity (m/s) and heading (rad) beside what is known.
    """
    gap_s = min(passed_s, _GAP_S)
    # One change of acceleration within the time, at its middle, misleads the most: by a t² / 8.
    bent_m = 0.125 * max(_ACCELERATION_M_S2 * gap_s**2, _LEVEL_M_S2 * passed_s**2)
    faster_m_s = max(_ACCELERATION_M_S2 * gap_s, _LEVEL_M_S2 * passed_s)
    if announced:
        noticed_rad = _WORTH_RAD + _TURNING_ANNOUNCED_RAD_S * gap_s
        return _WORTH_M, _NOTICED_M_S + faster_m_s, noticed_rad
    noticed_rad = _NOTICED_RAD + _TURNING_RAD_S * gap_s
    return _NOTICED_M + bent_m, _NOTICED_M_S + faster_m_s, noticed_rad


def _jump_m(before: VehicleState, state: VehicleState, passed_s: float) -> Vector3:
    """By how much the place is not where the velocities lead."""
    (x, y, z), (to_x, to_y, to_z) = before.position_enu_m, state.position_enu_m
    (vx, vy, vz), (to_vx, to_vy, to_vz) = before.velocity_enu_m_s, state.velocity_enu_m_s
    half_s = 0.5 * passed_s
    return (
        to_x - (x + half_s * (vx + to_vx)),
        to_y - (y + half_s * (vy + to_vy)),
        to_z - (z + half_s * (vz + to_vz)),
    )


def _followed(footing: Footing) -> Footing:
    """From now on what is astray is followed."""
    state, step_m = footing.newest, footing.astray_m
    assert state is not None
    footing = replace(
        footing,
        astray_m=_NONE,
        astray_m_s=_NONE,
        astray_rad=0.0,
        turned_rad=footing.turned_rad + footing.astray_rad,
    )
    if step_m == _NONE:
        return footing
    return replace(
        footing,
        shift_m=_plus(footing.shift_m, step_m),
        slides=_with_slide(footing.slides, step_m, state.time_s),
        steps=footing.steps + 1,
    )


def _with_slide(slides: tuple[Slide, ...], step_m: Vector3, now_s: float) -> tuple[Slide, ...]:
    """The slides and one by a step, behind the one in progress; those that wait become one."""
    while slides and slides[-1].begun_s > now_s:
        step_m = _plus(slides[-1].shift_m, step_m)
        slides = slides[:-1]
    begun_s = now_s + _PREVIEW_S
    if slides:
        begun_s = max(begun_s, slides[-1].begun_s + slides[-1].lasts_s)
    lasts_s = max(_SHORTEST_SLIDE_S, _PEAK_SPEED * math.hypot(*step_m) / _SLIDE_M_S)
    return (*slides, Slide(step_m, begun_s, lasts_s))


def _verdict(footing: Footing, followed_m: float) -> Step:
    """Why the estimate cannot be followed, if it cannot."""
    astray_m_s = math.hypot(*footing.astray_m_s)
    shift_m = math.hypot(*_plus(footing.shift_m, footing.astray_m))
    turned_rad = abs(footing.turned_rad + footing.astray_rad)
    problem = ""
    if footing.astray_m != _NONE and shift_m > followed_m:
        problem = f"the estimate of the position jumped by {shift_m:.1f} m"
    elif footing.steps > _MOST_STEPS:
        problem = f"the estimate of the position jumped {footing.steps} times"
    elif astray_m_s > _LARGEST_M_S:
        problem = f"the estimate of the velocity jumped by {astray_m_s:.1f} m/s"
    elif footing.steps_m_s > _MOST_STEPS:
        problem = f"the estimate of the velocity jumped {footing.steps_m_s} times"
    elif footing.astray_rad != 0.0 and turned_rad > _LARGEST_RAD:
        turn_deg = math.degrees(turned_rad)
        problem = f"the estimate of the heading jumped by {turn_deg:.0f} degrees"
    elif footing.steps_rad > _MOST_STEPS:
        problem = f"the estimate of the heading jumped {footing.steps_rad} times"
    return Step(problem=problem)


def _told(jump_m: Vector3, jump_m_s: Vector3, jump_rad: float, announced: bool) -> str:
    """What a person is told of a step that is followed; small ones are not worth it."""
    parts = []
    if jump_m != _NONE:
        parts.append(f"position by {math.hypot(*jump_m):.2f} m")
    if jump_m_s != _NONE:
        parts.append(f"velocity by {math.hypot(*jump_m_s):.1f} m/s")
    if jump_rad != 0.0:
        parts.append(f"heading by {math.degrees(abs(jump_rad)):.0f} degrees")
    if not parts:
        return ""
    how = "announced" if announced else "unannounced"
    return f"the estimate jumped ({how}): {', '.join(parts)}; it is followed smoothly"


def _plus(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _minus(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
