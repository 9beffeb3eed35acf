"""Plays an excitation in the place of a controller: open loop on one command, the hold on the rest.

It is driven as any stack is, so the same supervisor, limits and log are around it.  Pure: memory
and tick in, memory, command and record out.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from companion.control import tilt, yaw
from companion.control.attitude import AttitudeGains
from companion.control.frameworks import Command, Reference, Stack, StackRecord, Tick
from companion.control.interfaces import InnerRecord
from companion.control.pid import PidMemory
from companion.control.reference_model import Array
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
_STOPS_S = (1.0, 1.0, 0.5)
"""The hold stops a moving vehicle within about its velocity times these (x, y, z)."""
_LEAVE_AT = 0.95
"""Share of the box beyond which a stop must not be foreseen."""


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
    left: bool = False
    """That part was left, or missed."""
    trim_rad: tuple[float, float] = (0.0, 0.0)
    """Roll and pitch about which it is played."""


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
    def attitude_loop(self) -> AttitudeGains | None:
        """None: attitudes are what is identified."""
        return self.hold.attitude_loop

    def about(self, anchor_enu_m: Vector3) -> "ExcitationStack":
        """The same: its box lies about the hover point, wherever that is."""
        return self

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
        memory, part, level = self._now(memory, tick.track_s, state, wanted)

        hold, u = self._held(memory, part, state, wanted, dt)
        if not math.isfinite(sum(u) + level + tick.desired_yaw_rad):
            raise ValueError(f"not finite: u {u}, level {level}, yaw {tick.desired_yaw_rad}")
        yaw_rad = euler_from_quaternion(state.attitude_flu_to_enu)[2]
        yaw_command = yaw.step(self.hold.yaw, memory.yaw_rad, tick.desired_yaw_rad, yaw_rad, dt)
        limit = self.hold.limits
        roll, pitch = tilt.roll_pitch_from_u(
            *tilt.limit_tilt(u[0], u[1], limit.tilt_rad), yaw_command
        )
        climb = u[2]
        axis = "none" if part is None else part.axis
        if axis == "roll":
            roll = memory.trim_rad[0] + level
        elif axis == "pitch":
            pitch = memory.trim_rad[1] + level
        elif axis == "climb":
            climb = level
        u_x, u_y = tilt.limit_tilt(
            *tilt.u_from_roll_pitch(roll, pitch, yaw_command), limit.tilt_rad
        )
        roll, pitch = tilt.roll_pitch_from_u(u_x, u_y, yaw_command)
        climb = max(-limit.descent_m_s, min(limit.climb_m_s, climb))
        if axis == "lift":
            climb = 0.0
        lift = level if axis == "lift" else None
        thrust_memory, field = self._thrust(memory.thrust, climb, lift, state, dt)

        applied = np.array([u_x, u_y, climb])
        advanced = replace(
            memory,
            sample_s=memory.sample_s + dt,
            hold=self.hold.inner.with_applied(hold, applied) if part is None else hold,
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
            segment=HOLD if part is None else part.name,
        )
        return advanced, Command(quaternion_from_euler(roll, pitch, yaw_command), field), record

    def _now(
        self, memory: ExcitationMemory, track_s: float, state: VehicleState, wanted: Array
    ) -> tuple[ExcitationMemory, Part | None, float]:
        """The part that is played at this tick, None for the hold alone, and its level."""
        index = self.program.at(track_s)
        if index is None:
            return replace(memory, part=None, left=False), None, 0.0
        since_s = track_s - self.program.begins_s[index]
        part: Part | None = self.program.parts[index]
        assert part is not None
        if part.axis == "lift" and isinstance(self.thrust, ClimbRateField):
            part = part.over_climb_rate
        if part is None or since_s >= part.duration_s:
            return replace(memory, part=index, left=True), None, 0.0
        if memory.part != index:
            late = part.axis != "none" and since_s > _BEGINS_WITHIN_S
            trim = self._trim_rad(memory)
            memory = replace(memory, part=index, left=late, trim_rad=trim)
        if not memory.left and part.axis != "none" and self._leads_out(state, wanted):
            memory = replace(memory, left=True)
        return (memory, None, 0.0) if memory.left else (memory, part, part.level(since_s))

    def _trim_rad(self, memory: ExcitationMemory) -> tuple[float, float]:
        """Roll and pitch that the hold has found to balance wind and bias."""
        u_x, u_y, _ = (float(c) for c in memory.hold.integral)
        level = tilt.limit_tilt(u_x, u_y, self.hold.limits.tilt_rad)
        return tilt.roll_pitch_from_u(*level, memory.yaw_rad)

    def _leads_out(self, state: VehicleState, wanted: Array) -> bool:
        """True if the vehicle would stop at the box's edge, or beyond it, if it were held now."""
        x, y, z = (
            position + within_s * velocity - float(reference)
            for position, velocity, reference, within_s in zip(
                state.position_enu_m, state.velocity_enu_m_s, wanted, _STOPS_S, strict=True
            )
        )
        horizontal = max(abs(x), abs(y)) > _LEAVE_AT * self.box.horizontal_m
        return horizontal or abs(z) > _LEAVE_AT * self.box.vertical_m

    def _held(
        self,
        memory: ExcitationMemory,
        part: Part | None,
        state: VehicleState,
        wanted: Array,
        dt: float,
    ) -> tuple[PidMemory, tuple[float, float, float]]:
        """The hold's u, and its memory; of a tilt that is not its own it learns nothing."""
        position = np.array(state.position_enu_m)
        near = np.array(
            [within_reach(r, p) for r, p in zip(wanted.tolist(), position.tolist(), strict=True)]
        )
        before: PidMemory = memory.hold
        advanced, record = self.hold.inner.step(
            before, near, position, np.array(state.velocity_enu_m_s), dt
        )
        if part is not None and part.axis in ("roll", "pitch"):
            advanced = replace(advanced, integral=before.integral, held_integral=before.integral)
        u_x, u_y, u_z = record.u.tolist()
        return advanced, (u_x, u_y, u_z)

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
            return advanced, field
        return law.step(memory, climb_m_s, climb_rate, cosine, dt)
