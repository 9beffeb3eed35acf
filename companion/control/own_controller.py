"""A controller of one's own: what it is given, what it may ask for, and the stack around it.

It asks for an acceleration, or for an attitude with a thrust per mass.  The stack makes a specific
force of either, limits it as the vehicle's file says, and goes through the same yaw and thrust laws
as every other stack; so nothing that it asks for leaves unbounded.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from companion.control import yaw
from companion.control.attitude import AttitudeGains
from companion.control.frameworks import Command, Limits, Reference, StackRecord, Tick
from companion.control.interfaces import AdaptationMean, InnerRecord
from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2
from companion.control.thrust_laws import (
    ClimbRateField,
    CollectiveThrust,
    ThrustLaw,
    VerticalThrust,
)
from companion.frames import (
    Quaternion,
    Vector3,
    quaternion_from_euler,
    quaternion_normalise,
    rotate,
    tilt_cosine,
    yaw_of,
)
from companion.vehicle_state import VehicleState

_TIME_DIGITS = 4
_DIFFERENCE_S = 0.005
"""Derivatives of the reference are differences over this: some 0.1 mm/s² off on trajectory 5."""
_LEAST_LIFT_M_S2 = 0.1 * GRAVITY_M_S2
"""A vehicle is never asked to push downwards: its tilt would have no meaning."""
_CLIMB_TIME_S = 0.27
"""What an autopilot's own climb-rate loop takes: an acceleration is asked of it as a climb rate
that is this much ahead."""


@dataclass(frozen=True, slots=True)
class DesiredMotion:
    """Samples of the desired motion; each array is (samples, 3), ENU."""

    position_enu_m: Array
    """m."""
    velocity_enu_m_s: Array
    """m/s."""
    acceleration_enu_m_s2: Array
    """m/s², without gravity: 0 at rest."""


@dataclass(frozen=True, slots=True)
class Preview:
    """The desired motion from now on, as far ahead as one likes."""

    reference: Reference
    """Positions by the autopilot's clock."""
    now_s: float
    """On that clock."""

    def position(self, ahead_s: Array) -> Array:
        """Desired positions (samples, 3), ENU m, at times from now (samples,), s."""
        return self.reference(self.now_s + np.asarray(ahead_s, dtype=float))

    def motion(self, ahead_s: Array) -> DesiredMotion:
        """Desired positions with their derivatives at times from now (samples,), s."""
        times = self.now_s + np.asarray(ahead_s, dtype=float)
        step = _DIFFERENCE_S
        around = np.concatenate((times - step, times, times + step))
        before, now, after = self.reference(around).reshape(3, -1, 3)
        return DesiredMotion(
            now, (after - before) / (2.0 * step), (after - 2.0 * now + before) / step**2
        )


@dataclass(frozen=True, slots=True)
class ControlSample:
    """All that a controller of one's own is given at a sample of the state."""

    state: VehicleState
    """As the autopilot reports it: position, velocity (ENU), attitude (FLU to ENU), body rates."""
    dt_s: float
    """Since the sample before, 4 to 50 ms as a rule."""
    loop_delay_s: float
    """From the sample's time until what is asked for now acts on the vehicle, s."""
    desired_yaw_rad: float
    """Heading that the mission wants, counter-clockwise from east."""
    track_s: float
    """Since the trajectory began; negative in the approach and the hover before it."""
    reference: Preview
    """The desired motion, whatever the phase of the flight."""


@dataclass(frozen=True, slots=True)
class AccelerationSetpoint:
    """Asks for an acceleration."""

    acceleration_enu_m_s2: Vector3 | Array
    """Three numbers, beside gravity, which is made up for: (0, 0, 0) hovers."""
    yaw_rad: float | None = None
    """Heading, counter-clockwise from east; None: the one that the mission wants."""


@dataclass(frozen=True, slots=True)
class AttitudeSetpoint:
    """Asks for an attitude and a thrust."""

    attitude_flu_to_enu: Quaternion | Array
    """(w, x, y, z), body FLU to world ENU; its length does not matter."""
    specific_thrust_m_s2: float
    """Collective thrust over the vehicle's mass: 9.81 carries a level vehicle."""


Setpoint = AccelerationSetpoint | AttitudeSetpoint
"""What a controller of one's own may ask for."""


class Controller(Protocol):
    """A controller of one's own.

    `start` is called when it takes over, and again after every pause; then `step` at each sample
    of the state.  It may keep what it likes between samples.  It reads no clock and draws no
    unseeded random numbers, or its flights can't be repeated.
    """

    def start(self, state: VehicleState) -> None:
        """Begin at a state; forget whatever was before."""

    def step(self, sample: ControlSample) -> Setpoint:
        """What to ask for at a sample."""


@dataclass(frozen=True, slots=True)
class OwnMemory:
    """What is carried from tick to tick, beside what the controller keeps itself."""

    sample_s: float
    thrust: Any
    """Of the thrust law."""
    yaw_rad: float
    """Commanded, ENU."""


@dataclass(frozen=True, slots=True)
class OwnStack:
    """A controller of one's own under the limits and the maps of a vehicle: a `FlightStack`."""

    controller: Controller
    thrust: ThrustLaw
    yaw: yaw.YawGains
    limits: Limits
    vertical_limit_m_s2: float
    """Largest vertical acceleration, either way."""
    attitude_loop: AttitudeGains | None = None

    def about(self, anchor_enu_m: Vector3) -> "OwnStack":
        """The same: it knows no geofence."""
        return self

    def without_adaptation(self, mean: AdaptationMean) -> None:
        """What adapts in it is its own affair."""

    def start(
        self,
        state: VehicleState,
        thrust_memory: Any = None,  # noqa: ANN401 - the thrust law's own
        applied_u: Array | None = None,
    ) -> OwnMemory:
        """Memory with which the controller takes over at a state; see `FlightStack.start`."""
        self.controller.start(replace(state))
        thrust = thrust_memory
        if applied_u is None or thrust_memory is None:
            thrust = self.thrust.start(state.velocity_enu_m_s[2], thrust_memory)
        return OwnMemory(state.time_s, thrust, yaw_of(state.attitude_flu_to_enu))

    def step(
        self, memory: OwnMemory, tick: Tick, reference: Reference
    ) -> tuple[OwnMemory, Command, StackRecord]:
        """Advance by one sample; see `FlightStack.step`.

        Raises:
            ValueError: time does not advance, or what the controller asks for is not finite.
            TypeError: it asks for something that is no setpoint.
        """
        state = tick.state
        dt = round(state.time_s - memory.sample_s, _TIME_DIGITS)
        if dt <= 0.0:
            raise ValueError(f"time does not advance: {memory.sample_s} s, then {state.time_s} s")
        preview = Preview(reference, state.time_s)
        sample = ControlSample(
            replace(state), dt, tick.loop_delay_s, tick.desired_yaw_rad, tick.track_s, preview
        )
        setpoint = self.controller.step(sample)
        asked, wanted_yaw = _specific_force(setpoint, tick.desired_yaw_rad)
        if not math.isfinite(sum(asked) + wanted_yaw):
            raise ValueError(f"not finite: {setpoint}")
        force = self._limited(asked)
        measured_yaw = yaw_of(state.attitude_flu_to_enu)
        yaw_command = yaw.step(self.yaw, memory.yaw_rad, wanted_yaw, measured_yaw, dt)
        roll, pitch = _roll_pitch(force, yaw_command)
        thrust_memory, field = self._thrust(memory.thrust, force[2] - GRAVITY_M_S2, state, dt)
        nothing = np.full(3, math.nan)
        record = StackRecord(
            r2_m=preview.position(np.zeros(1))[0],
            inner=InnerRecord(_sines(asked), nothing, nothing, nothing),
            applied_u=_sines(force),
            roll_rad=roll,
            pitch_rad=pitch,
            hover_thrust=self.thrust.hover_thrust(thrust_memory),
            outer=None,
        )
        advanced = OwnMemory(memory.sample_s + dt, thrust_memory, yaw_command)
        return advanced, Command(quaternion_from_euler(roll, pitch, yaw_command), field), record

    def _limited(self, force: Vector3) -> Vector3:
        """A specific force (ENU, m/s²) within the limits of tilt and vertical acceleration."""
        x, y, z = force
        most = self.vertical_limit_m_s2
        z = max(_LEAST_LIFT_M_S2, GRAVITY_M_S2 + max(-most, min(most, z - GRAVITY_M_S2)))
        across, widest = math.hypot(x, y), z * math.tan(self.limits.tilt_rad)
        share = widest / across if across > widest else 1.0
        return share * x, share * y, z

    def _thrust(
        self,
        memory: Any,  # noqa: ANN401
        acceleration_m_s2: float,
        state: VehicleState,
        dt_s: float,
    ) -> tuple[Any, float]:
        """The thrust field for a vertical acceleration, by what the autopilot makes of it."""
        law, climb = self.thrust, state.velocity_enu_m_s[2]
        cosine = tilt_cosine(state.attitude_flu_to_enu)
        if isinstance(law, CollectiveThrust | VerticalThrust):
            advanced, field, _ = law.accelerate(memory, acceleration_m_s2, climb, cosine, dt_s)
            return advanced, field
        assert isinstance(law, ClimbRateField)
        limits = self.limits
        wanted = climb + _CLIMB_TIME_S * acceleration_m_s2
        wanted = max(-limits.descent_m_s, min(limits.climb_m_s, wanted))
        return law.step(memory, wanted, climb, cosine, dt_s)


def _specific_force(setpoint: Setpoint, desired_yaw_rad: float) -> tuple[Vector3, float]:
    """Thrust over mass (ENU, m/s²) and heading (rad) that a setpoint asks for.

    Raises:
        TypeError: it is none.
        ValueError: its quaternion has no direction.
    """
    if isinstance(setpoint, AccelerationSetpoint):
        x, y, z = (float(c) for c in setpoint.acceleration_enu_m_s2)
        yaw_rad = desired_yaw_rad if setpoint.yaw_rad is None else float(setpoint.yaw_rad)
        return (x, y, z + GRAVITY_M_S2), yaw_rad
    if isinstance(setpoint, AttitudeSetpoint):
        w, i, j, k = (float(c) for c in setpoint.attitude_flu_to_enu)
        attitude = quaternion_normalise((w, i, j, k))
        force = rotate(attitude, (0.0, 0.0, float(setpoint.specific_thrust_m_s2)))
        return force, yaw_of(attitude)
    raise TypeError(
        f"a controller gives an AccelerationSetpoint or an AttitudeSetpoint, not {setpoint!r}"
    )


def _sines(force: Vector3) -> Array:
    """The u (3,) of a record: sines of the tilt to east and north; there is no climb rate."""
    x, y, z = force
    size = math.sqrt(x * x + y * y + z * z) or 1.0
    return np.array([x / size, y / size, math.nan])


def _roll_pitch(force: Vector3, yaw_rad: float) -> tuple[float, float]:
    """Roll and pitch (rad, FLU) at a heading that point the thrust along a force (ENU)."""
    x, y, z = force
    sine, cosine = math.sin(yaw_rad), math.cos(yaw_rad)
    forward, left = cosine * x + sine * y, cosine * y - sine * x
    size = math.sqrt(x * x + y * y + z * z)
    return -math.asin(left / size), math.atan2(forward, z)
