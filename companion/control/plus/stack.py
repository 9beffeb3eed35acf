"""MPC-L1+ as a stack: state in, attitude and thrust out.

At each sample:

1. `sensing.py`: the predictor takes the measured position and velocity and adapts σ̂; lag, drag,
   tilt gain and heading are learnt;
2. `_plan`: the state (position, velocity, acceleration by the measured tilt, its rate) is carried
   over the delay of the loop by the nominal plant under the inputs that are on their way; the
   preview MPC gives the input u beside the flat input u* of the desired trajectory from then on,
   from which the low-passed σ̂ is taken off;
3. `_limit`: u, within its limits, becomes an attitude and a thrust.

It is pure but for the solvers' warm start: memory and input in, memory, command and record out.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from companion.control import yaw
from companion.control.attitude import AttitudeGains
from companion.control.frameworks import Command, Limits, Reference, StackRecord, Tick
from companion.control.interfaces import AdaptationMean, InnerRecord, OuterRecord
from companion.control.plus import flatness, lag, measured, sensing
from companion.control.plus.mismatch import Pair
from companion.control.plus.nominal_plant import Acting, AxisState, carried
from companion.control.plus.planner import Planner, PlannerMemory
from companion.control.plus.sensing import LEAST_VERTICAL_M_S2, Sensed
from companion.control.plus.settings import PlusSettings
from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2
from companion.control.thrust_laws import AccelerationLaw, ThrustLaw
from companion.frames import Vector3, quaternion_from_euler, tilt_cosine, yaw_of
from companion.vehicle_state import VehicleState

_TIME_DIGITS = 4
_CARRY_SCALE_STEP = 0.1
_LONGEST_STEP_S = 0.03
"""A rate is not applied for longer, however long the samples have not come."""
_Y_TILDE_DEVIATIONS = 4.0
_NOT_KNOWN = np.full(3, math.nan)
_NOT_KNOWN.setflags(write=False)
_TILT_UNIT = np.array([GRAVITY_M_S2, GRAVITY_M_S2, 1.0])
"""Of accelerations, in the unit of u: sines of the tilt, and what the vertical input is."""


@dataclass(frozen=True, slots=True)
class PlusMemory:
    """What the stack carries from sample to sample."""

    sample_s: float
    sensed: Sensed
    deviation: Vector3 | None
    """w = u - u* of the last input; None before the first one of its own."""
    acting: tuple[Acting, ...]
    """Inputs that act, or are on their way."""
    tangent: Pair
    """Of the commanded tilt, by horizontal axis."""
    planner: PlannerMemory
    thrust: Any
    yaw_rad: float


@dataclass(frozen=True, slots=True)
class PlusStack:
    """MPC-L1+; the same interface as `companion.control.frameworks.Stack`."""

    settings: PlusSettings
    planner: Planner
    thrust: ThrustLaw
    """An `AccelerationLaw` where the plant's vertical interface is an acceleration."""
    yaw: yaw.YawGains
    limits: Limits
    attitude_loop: AttitudeGains | None = None
    anchor_enu_m: Vector3 = (0.0, 0.0, 0.0)

    def about(self, anchor_enu_m: Vector3) -> "PlusStack":
        """The same stack where its geofence lies about a point (ENU m)."""
        return replace(self, anchor_enu_m=anchor_enu_m)

    def without_adaptation(self, mean: AdaptationMean) -> "PlusStack":
        """The same stack with its adaptation switched off, σ̂ held at a mean."""
        x, y, z = (np.array(mean.sigma_hat) * _TILT_UNIT).tolist()
        return replace(self, settings=replace(self.settings, held_sigma=(x, y, z)))

    def start(
        self,
        state: VehicleState,
        thrust_memory: Any = None,  # noqa: ANN401 - the thrust law's own
        applied_u: Array | None = None,
    ) -> PlusMemory:
        """Memory with which the stack takes over at a state, without a bump.

        Args:
            state: where the vehicle is.
            thrust_memory: of the thrust law, from before; None if it has not run yet.
            applied_u: (3,) u that is in effect, as for `companion.control.frameworks.Stack.start`.
        """
        s = self.settings
        sensed = sensing.start(s, state)
        force = GRAVITY_M_S2 * s.plant.tilt_gain
        climb = state.velocity_enu_m_s[2]
        vertical = climb if s.plant.vertical.interface == "climb_rate" else 0.0
        u = np.array([*sensed.tilted, vertical])
        if applied_u is not None:
            sines = applied_u[:2]
            cosine = math.sqrt(max(0.1, 1.0 - float(sines @ sines)))
            asked = np.array([*(force * sines / cosine), applied_u[2]])
            u = np.where(np.isfinite(asked), asked, u)
        return PlusMemory(
            sample_s=state.time_s,
            sensed=sensed,
            deviation=None,
            acting=(Acting((state.time_s,) * 3, _triple(u)),),
            tangent=(float(u[0]) / force, float(u[1]) / force),
            planner=PlannerMemory(state.time_s, (math.nan,) * 3),
            thrust=self.thrust.start(climb, thrust_memory),
            yaw_rad=yaw_of(state.attitude_flu_to_enu),
        )

    def step(
        self, memory: PlusMemory, tick: Tick, reference: Reference
    ) -> tuple[PlusMemory, Command, StackRecord]:
        """Advance by one sample; `tick.state.time_s` must be later than the one before.

        Raises:
            ValueError: time does not advance, or what comes in or out of the laws is not finite.
        """
        state = tick.state
        dt = round(state.time_s - memory.sample_s, _TIME_DIGITS)
        if dt <= 0.0:
            raise ValueError(f"time does not advance: {memory.sample_s} s, then {state.time_s} s")
        now_s = memory.sample_s + dt  # what was rounded off comes back at the next sample
        sampled_s = (memory.sample_s, now_s)
        sensed, predicted = sensing.sense(
            self.settings, memory.sensed, memory.acting, state, sampled_s
        )
        s = self.settings
        sent_s = now_s + tick.loop_delay_s
        x_axis, y_axis, z_axis = s.plant.axes
        acts_s = (sent_s + x_axis.delay_s, sent_s + y_axis.delay_s, sent_s + z_axis.delay_s)
        u, flat_input, x, desired, planner, outer = self._plan(
            memory, sensed, now_s, acts_s, dt, reference
        )
        if not math.isfinite(sum(u) + tick.desired_yaw_rad):
            raise ValueError(f"not finite: u {u}, yaw {tick.desired_yaw_rad}")
        yaw_command = yaw.step(
            self.yaw, memory.yaw_rad, tick.desired_yaw_rad, yaw_of(state.attitude_flu_to_enu), dt
        )
        applied, tangent, direction, thrust, field = self._limit(memory, sensed, state, u, x, dt)
        roll, pitch = measured.roll_pitch(direction, yaw_command)
        advanced = PlusMemory(
            sample_s=now_s,
            sensed=sensed,
            deviation=_minus(applied, flat_input),
            acting=(*_still_acting(memory.acting, now_s), Acting(acts_s, applied)),
            tangent=tangent,
            planner=planner,
            thrust=thrust,
            yaw_rad=yaw_command,
        )
        u_record = np.array([direction[0], direction[1], applied[2]])
        cut = max(abs(got - asked) for got, asked in zip(applied, u, strict=True)) >= 1e-9
        record = StackRecord(
            r2_m=desired,
            inner=InnerRecord(
                u=_wanted(u, applied, u_record) if cut else u_record,
                r1_m_s=_NOT_KNOWN,
                y_tilde_m_s=predicted.y_tilde_m_s,
                sigma_hat=sensed.predictor.estimate[:, 2] / _TILT_UNIT,
                projecting=predicted.projecting,
                y_tilde_bound_m_s=_Y_TILDE_DEVIATIONS * predicted.y_tilde_deviation_m_s,
                sigma_bound=np.array(s.sigma_bound_m_s2) / _TILT_UNIT,
            ),
            applied_u=u_record,
            roll_rad=roll,
            pitch_rad=pitch,
            hover_thrust=self.thrust.hover_thrust(thrust),
            outer=outer,
        )
        command = Command(quaternion_from_euler(roll, pitch, yaw_command), field)
        return advanced, command, record

    def _plan(
        self,
        memory: PlusMemory,
        sensed: Sensed,
        now_s: float,
        acts_s: Vector3,
        dt: float,
        reference: Reference,
    ) -> tuple[Vector3, Vector3, list[AxisState], Array, PlannerMemory, OuterRecord | None]:
        """The inputs u and u*, the states of the axes when they act, what is desired now (3,).

        And the planner's memory and record.
        """
        s, planner = self.settings, self.planner
        scale = 1.0 if s.lag is None else lag.scale(s.lag, sensed.lag, s.plant.tilt.lag_s)
        drag = s.plant.linear_drag_1_s + sensed.learnt.drag_1_s
        plant = replace(s.plant.lagging(scale), linear_drag_1_s=drag)
        # Over the delay a plant of the nearest round lag will do; its matrices are kept.
        coarse = s.plant.lagging(round(scale / _CARRY_SCALE_STEP) * _CARRY_SCALE_STEP)
        seen = [
            (p, v, a, rate)
            for (p, v, _), (a, rate) in zip(
                sensed.predictor.estimate.tolist(), sensed.actuation, strict=True
            )
        ]
        sigma = np.array(sensed.sigma_low_passed)
        x = carried(coarse, seen, self._pushes(sensed), now_s, acts_s, memory.acting)

        looks = now_s >= memory.planner.due_s - 1e-6
        preview = planner.preview_times_s() if looks else planner.present_times_s()
        n = len(preview)
        times = np.empty(2 * n + 1)
        np.add(preview, acts_s[0], out=times[:n])
        np.add(preview, acts_s[2], out=times[n:-1])
        times[-1] = now_s
        desired = reference(times)
        preview_m = desired[:n].copy()
        preview_m[:, 2] = desired[n : 2 * n, 2]
        desired_state, flat_input = planner.flat_now(
            plant, preview_m[: 2 * flatness.AROUND + 1], sigma
        )
        deviation = memory.deviation
        if deviation is None:
            deviation = _minus(memory.acting[-1].u, flat_input)
        start = np.empty((3, 5))
        start[:, :4], start[:, 4] = x - desired_state, deviation
        rate = planner.rate(start, scale)
        planned, outer = memory.planner, None
        if looks:
            rates, outer = planner.look(start, plant, scale, sigma, preview_m, self.anchor_enu_m)
            planned = PlannerMemory(now_s + planner.horizon.step_s, rates)
        step_s = min(dt, _LONGEST_STEP_S)
        decided = [
            by_feedback if math.isnan(by_plan) else by_plan
            for by_feedback, by_plan in zip(rate.tolist(), planned.planned_rate, strict=True)
        ]
        (ux, uy, uz), (wx, wy, wz), (rx, ry, rz) = flat_input, deviation, decided
        u = (ux + wx + step_s * rx, uy + wy + step_s * ry, uz + wz + step_s * rz)
        return u, flat_input, x, desired[-1], planned, outer

    def _pushes(self, sensed: Sensed) -> list[float]:
        """Acceleration over the delay beside that of tilt, thrust and identified drag, by axis."""
        s, (vx, vy, vz) = self.settings, sensed.velocity
        speed = math.sqrt(vx * vx + vy * vy + vz * vz)
        drag = s.quadratic_drag_1_m * speed + sensed.learnt.drag_1_s
        return [
            sigma - drag * v if axis.interface == "acceleration" else sigma
            for sigma, v, axis in zip(
                sensed.sigma_low_passed, sensed.velocity, s.plant.axes, strict=True
            )
        ]

    def _limit(
        self,
        memory: PlusMemory,
        sensed: Sensed,
        state: VehicleState,
        u: Vector3,
        x: list[AxisState],
        dt: float,
    ) -> tuple[Vector3, Pair, Vector3, Any, float]:
        """What the limits leave of u, the tilt's tangent, its direction, and the thrust."""
        s = self.settings
        force = max(LEAST_VERTICAL_M_S2, GRAVITY_M_S2 + x[2][2]) * s.plant.tilt_gain
        applied_x, applied_y, wanted = u
        asked = sensed.learnt.asked(applied_x, applied_y)
        was_x, was_y = memory.tangent
        tangent_x, tangent_y = asked[0] / force, asked[1] / force
        length = math.hypot(tangent_x - was_x, tangent_y - was_y)
        most = s.tilt_rate_limit_rad_s * dt
        limited = length > most
        if limited:
            share = most / length
            tangent_x = was_x + share * (tangent_x - was_x)
            tangent_y = was_y + share * (tangent_y - was_y)
        length, most = math.hypot(tangent_x, tangent_y), math.tan(self.limits.tilt_rad)
        if length > most:
            share, limited = most / length, True
            tangent_x, tangent_y = share * tangent_x, share * tangent_y
        if limited:
            asked = (tangent_x * force, tangent_y * force)
            applied_x, applied_y = sensed.learnt.pushed(*asked)
        wanted = max(s.vertical_limit[0], min(s.vertical_limit[1], wanted))
        climb = state.velocity_enu_m_s[2]
        if s.plant.vertical.interface == "climb_rate":
            cosine = tilt_cosine(state.attitude_flu_to_enu)
            thrust, field = self.thrust.step(memory.thrust, wanted, climb, cosine, dt)
        else:
            law: AccelerationLaw = self.thrust  # type: ignore[assignment]
            then = math.hypot(x[0][2], x[1][2]) / force
            cosine = 1.0 / math.sqrt(1.0 + then * then)
            thrust, field, left = law.accelerate(memory.thrust, wanted, climb, cosine, dt)
            wanted = left
        direction = measured.thrust_direction(asked, force)
        return (applied_x, applied_y, wanted), (tangent_x, tangent_y), direction, thrust, field


def _wanted(u: Vector3, applied: Vector3, applied_u: Array) -> Array:
    """The u (3,) of the record: what was wanted on the axes that the limits have cut."""
    wanted = (u[0] / GRAVITY_M_S2, u[1] / GRAVITY_M_S2, u[2])
    kept = [abs(got - asked) < 1e-9 for got, asked in zip(applied, u, strict=True)]
    return np.where(kept, applied_u, wanted)


def _minus(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _triple(values: Array) -> Vector3:
    x, y, z = values.tolist()
    return x, y, z


def _still_acting(acting: tuple[Acting, ...], now_s: float) -> tuple[Acting, ...]:
    """Inputs without those that another one has replaced on every axis."""
    first = 0
    while first + 1 < len(acting) and max(acting[first + 1].from_s) <= now_s:
        first += 1
    return acting[first:]
