"""Plays an excitation in the place of a controller: on one command, with the hold on the rest.

It is driven as any stack is, so the same supervisor, limits and log are around it.  Pure: memory
and tick in, memory, command and record out.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from companion.control import tilt, yaw
from companion.control.attitude import AttitudeGains
from companion.control.frameworks import Command, Limits, Reference, Stack, StackRecord, Tick
from companion.control.interfaces import AdaptationMean, InnerRecord
from companion.control.pid import PidMemory
from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2
from companion.control.thrust_laws import (
    ClimbRateField,
    CollectiveThrust,
    ThrustLaw,
    VerticalThrust,
)
from companion.frames import Vector3, euler_from_quaternion, quaternion_from_euler, tilt_cosine
from companion.identification.excitation import Box, Part, Program
from companion.identification.hold import within_reach
from companion.vehicle_state import VehicleState

HOLD = "hold"
"""The segment of samples at which nothing is excited."""

_TIME_DIGITS = 4
_BEGINS_WITHIN_S = 0.1
"""A part is not begun later than this: a restart in its midst has missed it."""
_STOPS_S = (1.0, 1.0, 0.35)
"""The hold stops a moving vehicle within about its velocity times these (x, y, z)."""
_LEAVE_AT = 0.95
"""Share of the box beyond which a stop must not be foreseen."""
_OFF_THE_WAY = 0.4
"""Share of the box by which a swinging vehicle may be off its way."""
_BENEATH = 0.4
"""Share of the hold that stays on beneath a tilt that is played."""
_LEAD_S = 0.2
"""The swing's push is commanded ahead by about what multirotors take to tilt."""
_LEADS_OUT = (
    "the vehicle would have stopped at the edge of its box or beyond; a larger --box or calmer air "
    "helps"
)
_ASTRAY = "the vehicle was far off the swing's way; calmer air or a larger --box helps"
_LATE = (
    "the hold had to begin anew, as no state that could be flown on had come for a while; a link "
    "and a computer without such gaps help"
)
_TILTS = ("roll", "pitch", "swing")
_LIFT_CLIMB_1_S, _LIFT_HEIGHT_1_S2 = 1.0, 0.3
"""Of the weak hold beneath a thrust that is played; a firmer one brings an estimate's wander in."""


@dataclass(frozen=True, slots=True)
class ExcitationMemory:
    """What is carried from tick to tick."""

    sample_s: float
    hold: PidMemory
    thrust: Any
    """Of the thrust law."""
    yaw_rad: float
    """Commanded, ENU."""
    part: int | None = None
    """Which is being played, or was left early in its time; None in a pause."""
    left: str = ""
    """Why that part was left, or missed, in a sentence; empty if it was not."""
    trim_rad: tuple[float, float] = (0.0, 0.0)
    """Roll and pitch about which it is played."""


@dataclass(frozen=True, slots=True)
class _Played:
    """A part, and how long it has been played."""

    part: Part
    since_s: float


@dataclass(frozen=True, slots=True)
class ExcitationStack:
    """A hold, and what is played over it."""

    hold: Stack
    """A PID stack without an outer controller, for the thrust field's meaning."""
    program: Program
    box: Box

    @property
    def thrust(self) -> ThrustLaw:
        """The hold's thrust law."""
        return self.hold.thrust

    @property
    def limits(self) -> Limits:
        """The vehicle's, as of the hold."""
        return self.hold.limits

    @property
    def attitude_loop(self) -> AttitudeGains | None:
        """None: attitudes are what is identified."""
        return self.hold.attitude_loop

    def about(self, anchor_enu_m: Vector3) -> "ExcitationStack":
        """The same: its box lies about the hover point, wherever that is."""
        return self

    def without_adaptation(self, mean: AdaptationMean) -> None:
        """Nothing adapts in it."""

    def start(
        self,
        state: VehicleState,
        thrust_memory: Any = None,  # noqa: ANN401 - the thrust law's own
        applied_u: Array | None = None,
    ) -> ExcitationMemory:
        """Memory with which the hold takes over at a state, without a bump; see `Stack.start`."""
        memory = self.hold.start(state, thrust_memory, applied_u)
        return ExcitationMemory(memory.sample_s, memory.inner, memory.thrust, memory.yaw_rad)

    def step(
        self, memory: ExcitationMemory, tick: Tick, reference: Reference
    ) -> tuple[ExcitationMemory, Command, StackRecord]:
        """Advance by one sample; see `Stack.step`.

        Raises:
            ValueError: time does not advance, or what comes in or out is not finite.
        """
        state = tick.state
        dt = round(state.time_s - memory.sample_s, _TIME_DIGITS)
        if dt <= 0.0:
            raise ValueError(f"time does not advance: {memory.sample_s} s, then {state.time_s} s")
        wanted = reference(np.array([state.time_s]))[0]
        memory, played = self._now(memory, tick.track_s, state, wanted)
        axis = "none" if played is None else played.part.axis
        level = 0.0 if played is None else played.part.level(played.since_s)

        hold, u = self._held(memory, played, state, wanted, dt)
        if not math.isfinite(sum(u) + level + tick.desired_yaw_rad):
            raise ValueError(f"not finite: u {u}, level {level}, yaw {tick.desired_yaw_rad}")
        yaw_rad = euler_from_quaternion(state.attitude_flu_to_enu)[2]
        yaw_command = yaw.step(self.hold.yaw, memory.yaw_rad, tick.desired_yaw_rad, yaw_rad, dt)
        limit = self.hold.limits
        roll, pitch = tilt.roll_pitch_from_u(
            *tilt.limit_tilt(u[0], u[1], limit.tilt_rad), yaw_command
        )
        if axis == "roll":
            roll = _beneath(memory.trim_rad[0], roll) + level
        elif axis == "pitch":
            pitch = _beneath(memory.trim_rad[1], pitch) + level
        u_x, u_y = tilt.limit_tilt(
            *tilt.u_from_roll_pitch(roll, pitch, yaw_command), limit.tilt_rad
        )
        roll, pitch = tilt.roll_pitch_from_u(u_x, u_y, yaw_command)
        climb, lift = u[2], None
        if axis == "climb":
            climb = level
        elif axis == "lift":
            _, _, up = state.position_enu_m
            sinking = -_LIFT_CLIMB_1_S * state.velocity_enu_m_s[2]
            climb, lift = 0.0, level + sinking + _LIFT_HEIGHT_1_S2 * (float(wanted[2]) - up)
        climb = max(-limit.descent_m_s, min(limit.climb_m_s, climb))
        thrust_memory, field = self._thrust(memory.thrust, climb, lift, state, dt)

        applied = np.array([u_x, u_y, climb])
        advanced = replace(
            memory,
            sample_s=memory.sample_s + dt,
            hold=self.hold.inner.with_applied(hold, applied) if played is None else hold,
            thrust=thrust_memory,
            yaw_rad=yaw_command,
        )
        nothing = np.full(3, np.nan)
        record = StackRecord(
            r2_m=wanted,
            inner=InnerRecord(np.array(u), nothing, nothing, nothing),
            applied_u=applied,
            roll_rad=roll,
            pitch_rad=pitch,
            hover_thrust=self.thrust.hover_thrust(thrust_memory),
            outer=None,
            segment=HOLD if played is None else played.part.name,
            left=memory.left,
        )
        return advanced, Command(quaternion_from_euler(roll, pitch, yaw_command), field), record

    def _now(
        self, memory: ExcitationMemory, track_s: float, state: VehicleState, wanted: Array
    ) -> tuple[ExcitationMemory, _Played | None]:
        """What is played at this tick; None for the hold alone."""
        index = self.program.at(track_s)
        if index is None:
            return replace(memory, part=None, left=""), None
        since_s = track_s - self.program.begins_s[index]
        part = self._over_this_field(self.program.parts[index])
        if part is None or since_s >= part.duration_s:
            left = memory.left if memory.part == index else ""
            return replace(memory, part=index, left=left), None
        if memory.part != index:
            late = part.axis != "none" and since_s > _BEGINS_WITHIN_S
            left = _left(part, since_s, _LATE) if late else ""
            memory = replace(memory, part=index, left=left, trim_rad=self._trim_rad(memory))
        if not memory.left:
            why = self._leads_out(part, since_s, state, wanted)
            memory = replace(memory, left=_left(part, since_s, why) if why else "")
        return memory, None if memory.left else _Played(part, since_s)

    def _over_this_field(self, part: Part) -> Part | None:
        """What is played of a part, by what the thrust field means."""
        if not isinstance(self.thrust, ClimbRateField):
            return part
        return part.over_climb_rate or (None if part.axis == "lift" else part)

    def _trim_rad(self, memory: ExcitationMemory) -> tuple[float, float]:
        """Roll and pitch that the hold has found to balance wind and bias."""
        u_x, u_y, _ = (float(c) for c in memory.hold.integral)
        level = tilt.limit_tilt(u_x, u_y, self.hold.limits.tilt_rad)
        return tilt.roll_pitch_from_u(*level, memory.yaw_rad)

    def _leads_out(self, part: Part, since_s: float, state: VehicleState, wanted: Array) -> str:
        """Why a part must be left: held now, the vehicle would stop at the box's edge, or beyond.

        Empty if it need not be.  One that swings turns round by what is played: it must be near
        its way.
        """
        if part.axis == "none":
            return ""
        off = [p - float(w) for p, w in zip(state.position_enu_m, wanted, strict=True)]
        x, y, z = (
            offset + within_s * velocity
            for offset, velocity, within_s in zip(
                off, state.velocity_enu_m_s, _STOPS_S, strict=True
            )
        )
        limit_m = _LEAVE_AT * self.box.horizontal_m
        if part.swing is not None:
            way_x, way_y = part.swing.position_m(since_s)
            x, y = off[0], off[1]
            astray_m = max(abs(x - way_x), abs(y - way_y))
            if astray_m > _OFF_THE_WAY * self.box.horizontal_m:
                return _ASTRAY
        if max(abs(x), abs(y)) > limit_m or abs(z) > _LEAVE_AT * self.box.vertical_m:
            return _LEADS_OUT
        return ""

    def _held(
        self,
        memory: ExcitationMemory,
        played: _Played | None,
        state: VehicleState,
        wanted: Array,
        dt: float,
    ) -> tuple[PidMemory, tuple[float, float, float]]:
        """The hold's u, and its memory; of a tilt that is not its own it learns nothing."""
        position, velocity = np.array(state.position_enu_m), np.array(state.velocity_enu_m_s)
        point, push = wanted, (0.0, 0.0)
        swing = None if played is None else played.part.swing
        if played is not None and swing is not None:
            (x, y), (v_x, v_y), _ = swing.motion(played.since_s)
            point = wanted + np.array((x, y, 0.0))
            velocity = velocity - np.array((v_x, v_y, 0.0))
            push = swing.motion(played.since_s + _LEAD_S)[2]
        near = np.array(
            [within_reach(r, p) for r, p in zip(point.tolist(), position.tolist(), strict=True)]
        )
        before: PidMemory = memory.hold
        advanced, record = self.hold.inner.step(before, near, position, velocity, dt)
        if played is not None and played.part.axis in _TILTS:
            advanced = replace(advanced, integral=before.integral, held_integral=before.integral)
        u_x, u_y, u_z = record.u.tolist()
        return advanced, (u_x + push[0] / GRAVITY_M_S2, u_y + push[1] / GRAVITY_M_S2, u_z)

    def _thrust(
        self,
        memory: Any,  # noqa: ANN401
        climb_m_s: float,
        lift_m_s2: float | None,
        state: VehicleState,
        dt: float,
    ) -> tuple[Any, float]:
        climb_rate, cosine = state.velocity_enu_m_s[2], tilt_cosine(state.attitude_flu_to_enu)
        law = self.thrust
        if lift_m_s2 is not None and isinstance(law, CollectiveThrust | VerticalThrust):
            advanced, field, _ = law.accelerate(memory, lift_m_s2, climb_rate, cosine, dt)
            # Its estimate of the hover thrust knows no lag: quick thrusts would lead it astray.
            known = {"hover_force": memory.hover_force, "hover_variance": memory.hover_variance}
            return replace(advanced, **known), field
        return law.step(memory, climb_m_s, climb_rate, cosine, dt)


def _left(part: Part, since_s: float, why: str) -> str:
    """What a person is told of a part that is left, or missed."""
    return (
        f"the part '{part.name}' is not played beyond {since_s:.1f} of its {part.duration_s:.1f} "
        f"s: {why}"
    )


def _beneath(trim_rad: float, held_rad: float) -> float:
    """What stays of the hold beneath a tilt that is played."""
    return trim_rad + _BENEATH * (held_rad - trim_rad)
