"""The stack of controllers: an outer one, an inner one, and the maps to a setpoint.

The outer controller gives the position reference r2, the inner one below gives u, and the tilt,
yaw and thrust maps make an attitude and a thrust of it.  The named frameworks are pairs:

==========  ===================================  ==============
name        outer                                inner
==========  ===================================  ==============
`mpc-l1`    MPC over D(s)                        L1
`pid-l1`    PID, no preview                      L1
`lqr-l1`    LQR with integral, no preview        L1
`l1`        none: r2 = y2*                       L1
`mpc-pid`   MPC over an identified model         PID
`pid`       none: r2 = y2*                       PID
==========  ===================================  ==============

A stack is pure: memory and input in, memory, command and record out.  It reads no clock; every
tick carries its times in.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from companion.control import delay, tilt, yaw
from companion.control.attitude import AttitudeGains
from companion.control.interfaces import (
    AdaptationMean,
    InnerController,
    InnerRecord,
    OuterController,
    OuterRecord,
)
from companion.control.reference_model import Array, PositionModel
from companion.control.thrust_laws import ThrustLaw
from companion.frames import (
    Quaternion,
    Vector3,
    euler_from_quaternion,
    quaternion_from_euler,
    tilt_cosine,
    yaw_of,
)
from companion.vehicle_state import VehicleState

_TIME_DIGITS = 4
"""Intervals are taken to 0.1 ms: the laws are exact for any, and keep what they reckoned for each,
which a clock that jitters by microseconds would spoil."""

Reference = Callable[[Array], Array]
"""Desired positions (samples, 3), ENU m, at autopilot times (samples,), s."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What the vehicle may be asked for, whatever the laws want."""

    tilt_rad: float
    climb_m_s: float
    descent_m_s: float


# Tick, StackMemory, Command and StackRecord are made at every tick, and frozen
# they take several times as long to make: change none.
@dataclass(slots=True)
class Tick:
    """One sample of the state, with all that the stack may know about its time."""

    state: VehicleState
    loop_delay_s: float
    """From the sample's time until a command decided on it acts on the vehicle, s."""
    desired_yaw_rad: float
    track_s: float = -math.inf
    """Since the trajectory began, s; negative before."""


@dataclass(slots=True)
class StackMemory:
    """What a stack carries from tick to tick."""

    sample_s: float
    outer: Any
    outer_ran_s: float
    """Autopilot time of the outer controller's last run."""
    outer_due_s: float
    """Autopilot time from which on the outer controller runs again."""
    applied: tuple[delay.AppliedReference, ...]
    inner: Any
    thrust: Any
    yaw_rad: float
    """Commanded yaw, ENU."""


@dataclass(slots=True)
class Command:
    """What goes to the vehicle: an attitude and a thrust."""

    attitude_flu_to_enu: Quaternion
    thrust: float
    """Thrust field of the autopilot, 0..1, of the meaning that the stack was made for."""


@dataclass(slots=True)
class StackRecord:
    """Why the command is what it is."""

    r2_m: Array
    inner: InnerRecord
    applied_u: Array
    roll_rad: float
    pitch_rad: float
    hover_thrust: float
    """Estimated; NaN where the autopilot holds the height by itself."""
    outer: OuterRecord | None
    """None at a tick at which the outer controller did not run."""
    segment: str = ""
    """Part of an experiment that is flown; empty in an ordinary flight."""
    left: str = ""
    """Why the part of an experiment whose time it is is not flown, in a sentence; mostly empty."""


@dataclass(frozen=True, slots=True)
class Stack:
    """An outer and an inner controller with the maps below them."""

    outer: OuterController
    inner: InnerController
    thrust: ThrustLaw
    yaw: yaw.YawGains
    limits: Limits
    attitude_loop: AttitudeGains | None = None
    """What makes body rates of the command's attitude; None leaves that to the autopilot."""

    def about(self, anchor_enu_m: Vector3) -> "Stack":
        """The same stack where its geofence, if it knows one, lies about a point (ENU m)."""
        return replace(self, outer=self.outer.about(np.array(anchor_enu_m)))

    def without_adaptation(self, mean: AdaptationMean) -> "Stack | None":
        """The same stack with its adaptation switched off, held at a mean; None if it has none."""
        inner = self.inner.held(mean)
        return None if inner is None else replace(self, inner=inner)

    def start(
        self,
        state: VehicleState,
        thrust_memory: Any = None,  # noqa: ANN401 - the thrust law's own
        applied_u: Array | None = None,
    ) -> StackMemory:
        """Memory with which the stack takes over at a state, without a bump.

        Args:
            state: where the vehicle is.
            thrust_memory: of the thrust law, from before; None if it has not run yet.
            applied_u: (3,) u that is in effect: what the stack that is relieved commanded last
                (`companion.control.handover`).  What is NaN of it, or all of it where None, is
                taken from the reported attitude and climb rate.
        """
        roll, pitch, yaw_rad = euler_from_quaternion(state.attitude_flu_to_enu)
        velocity = np.array(state.velocity_enu_m_s)
        u_x, u_y = tilt.u_from_roll_pitch(roll, pitch, yaw_rad)
        u = np.array([u_x, u_y, velocity[2]])
        if applied_u is not None:
            u = np.where(np.isfinite(applied_u), applied_u, u)
        # Where another stack is relieved, the loop of the thrust goes on as it is.
        thrust = thrust_memory
        if applied_u is None or thrust_memory is None:
            thrust = self.thrust.start(float(velocity[2]), thrust_memory)
        inner, r2 = self.inner.start(np.array(state.position_enu_m), velocity, u)
        return StackMemory(
            sample_s=state.time_s,
            outer=self.outer.start(r2),
            outer_ran_s=state.time_s,
            outer_due_s=state.time_s,
            applied=(delay.AppliedReference(state.time_s, r2),),
            inner=inner,
            thrust=thrust,
            yaw_rad=yaw_rad,
        )

    def step(
        self, memory: StackMemory, tick: Tick, reference: Reference
    ) -> tuple[StackMemory, Command, StackRecord]:
        """Advance by one sample; `tick.state.time_s` must be later than the one before.

        Raises:
            ValueError: time does not advance, or what comes in or out of the laws is not finite:
                limits would turn a NaN into their own value, full thrust for instance.
        """
        state = tick.state
        dt = round(state.time_s - memory.sample_s, _TIME_DIGITS)
        if dt <= 0.0:
            raise ValueError(f"time does not advance: {memory.sample_s} s, then {state.time_s} s")
        position = np.array(state.position_enu_m)
        velocity = np.array(state.velocity_enu_m_s)

        outer_record: OuterRecord | None = None
        if state.time_s >= memory.outer_due_s - 1e-6:
            memory, outer_record = self._plan(memory, tick, position, velocity, reference)
        r2 = memory.applied[-1].r2_m

        inner, inner_record = self.inner.step(memory.inner, r2, position, velocity, dt)
        u = u_x, u_y, u_z = inner_record.u.tolist()
        if not math.isfinite(u_x + u_y + u_z + sum(r2.tolist()) + tick.desired_yaw_rad):
            raise ValueError(f"not finite: u {inner_record.u}, r2 {r2}, yaw {tick.desired_yaw_rad}")
        u_x, u_y = tilt.limit_tilt(u_x, u_y, self.limits.tilt_rad)
        u_z = max(-self.limits.descent_m_s, min(self.limits.climb_m_s, u_z))
        # The very same where nothing was cut: then no law need look at what was.
        applied_u = inner_record.u if u == [u_x, u_y, u_z] else np.array([u_x, u_y, u_z])

        yaw_rad = yaw_of(state.attitude_flu_to_enu)
        yaw_command = yaw.step(self.yaw, memory.yaw_rad, tick.desired_yaw_rad, yaw_rad, dt)
        # The attitude setpoint carries the commanded yaw, so its tilt is one at that yaw.
        roll, pitch = tilt.roll_pitch_from_u(u_x, u_y, yaw_command)
        thrust_memory, thrust_field = self.thrust.step(
            memory.thrust,
            u_z,
            float(velocity[2]),
            tilt_cosine(state.attitude_flu_to_enu),
            dt,
        )
        advanced = StackMemory(
            sample_s=memory.sample_s + dt,  # what was rounded off comes back at the next sample
            outer=memory.outer,
            outer_ran_s=memory.outer_ran_s,
            outer_due_s=memory.outer_due_s,
            applied=memory.applied,
            inner=self.inner.with_applied(inner, applied_u),
            thrust=thrust_memory,
            yaw_rad=yaw_command,
        )
        command = Command(quaternion_from_euler(roll, pitch, yaw_command), thrust_field)
        record = StackRecord(
            r2_m=r2,
            inner=inner_record,
            applied_u=applied_u,
            roll_rad=roll,
            pitch_rad=pitch,
            hover_thrust=self.thrust.hover_thrust(thrust_memory),
            outer=outer_record,
        )
        return advanced, command, record

    def _plan(
        self,
        memory: StackMemory,
        tick: Tick,
        position: Array,
        velocity: Array,
        reference: Reference,
    ) -> tuple[StackMemory, OuterRecord]:
        """Run the outer controller: at the time at which what it decides acts, if it has a model.

        Then the state is carried over the delay by that model; without one, the controller sees
        the state as measured, and the reference of that time.
        """
        sample_s = tick.state.time_s
        acts_s = sample_s + tick.loop_delay_s
        sees_s = sample_s
        if self.outer.model is not None:
            sees_s = acts_s
            position, velocity = self._carry(
                self.outer.model, memory, position, velocity, sample_s, acts_s
            )
        preview = reference(sees_s + self.outer.preview_times_s)
        outer, r2, record = self.outer.step(
            memory.outer, position, velocity, preview, sample_s - memory.outer_ran_s
        )
        period = self.outer.period_s
        late = sample_s - memory.outer_due_s
        skipped = max(0, math.floor(late / period + 1e-6)) if period > 0.0 else 0
        due_s = memory.outer_due_s + (skipped + 1) * period if period > 0.0 else sample_s
        in_effect = [k for k, a in enumerate(memory.applied) if a.from_s <= sample_s]
        kept = memory.applied[in_effect[-1] if in_effect else 0 :]
        advanced = StackMemory(
            sample_s=memory.sample_s,
            outer=outer,
            outer_ran_s=sample_s,
            outer_due_s=due_s,
            applied=(*kept, delay.AppliedReference(acts_s, r2)),
            inner=memory.inner,
            thrust=memory.thrust,
            yaw_rad=memory.yaw_rad,
        )
        return advanced, record

    @staticmethod
    def _carry(
        model: PositionModel,
        memory: StackMemory,
        position: Array,
        velocity: Array,
        sample_s: float,
        acts_s: float,
    ) -> tuple[Array, Array]:
        return delay.carry(
            model.m, model.gain_k, position, velocity, sample_s, acts_s, memory.applied
        )
