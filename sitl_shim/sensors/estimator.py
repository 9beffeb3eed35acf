"""The state estimate of the simulated autopilot: the truth with an estimator's errors."""

from collections import deque
from dataclasses import dataclass
from math import exp, radians, sqrt

import numpy as np
import numpy.typing as npt

from sitl_shim.compiled import ROW, compiled, compiling
from sitl_shim.frames import Quaternion, Vector3
from sitl_shim.plant.state import PlantState
from sitl_shim.plant.vehicle import GRAVITY_M_S2, VehicleModel
from sitl_shim.sensors.drift import DriftStep, drift_step
from sitl_shim.sensors.errors import Noise, with_errors
from sitl_shim.sensors.profile import SensorProfile

_SEED_STREAM = 3
_BLOCK = 512
_DRAWS = 24

_Row = npt.NDArray[np.float64]


# Not frozen, as everything else is: one is made per tick, and freezing costs as much as the errors.
@dataclass(slots=True)
class Estimate:
    """What the autopilot believes; nobody changes one.  World ENU, body FLU."""

    time_s: float
    """Of the estimate (not of its oldest ingredient)."""
    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    attitude_flu_to_enu: Quaternion
    """(w, x, y, z), body to world."""
    rate_flu_rad_s: Vector3
    acceleration_enu_m_s2: Vector3
    """Kinematic: 0 at rest."""
    local_position_valid: bool = True
    """Whether anything tells where it is, or has until a moment ago."""
    global_position_valid: bool = True
    """Whether it knows where on Earth it is."""


class Estimator:
    """Turns the truth into an estimate, once per step of the plant."""

    def __init__(self, profile: SensorProfile, vehicle: VehicleModel, *, seed: int) -> None:
        """Draw the constants of this seed.

        Args:
            profile: sizes of the errors.
            vehicle: its trim spread is a constant error of roll and pitch, unless the profile
                leaves it out.
            seed: draws everything random here.
        """
        self._generator = np.random.default_rng(
            np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM,))
        )
        self._profile = profile
        self._at_rest_thrust_n = 0.05 * vehicle.mass_kg * GRAVITY_M_S2
        self._with_errors = compiled(with_errors, ROW, 3, 3, 4, 3, 3, 3, 3, 3)
        self._scale, self._offset = self._white_part(profile, vehicle.spread.trim_deg)
        self._as_rows = compiling()
        self._noise: list[Noise] = []
        self._index = 0

        error = profile.attitude
        start = self._generator.standard_normal(3).tolist()
        wander = [0.5 * radians(value) for value in error.wander_deg]
        self._half_wander_size: Vector3 = (wander[0], wander[1], wander[2])
        self._half_wander: Vector3 = (
            wander[0] * start[0],
            wander[1] * start[1],
            wander[2] * start[2],
        )
        self._wanders = any(wander)
        # No drift at first: the local frame has its origin where the estimator starts.
        self._drift_position: Vector3 = (0.0, 0.0, 0.0)
        self._drift_velocity: Vector3 = (0.0, 0.0, 0.0)
        self._step_s = 0.0
        self._drift_steps: tuple[DriftStep, DriftStep, DriftStep] | None = None
        self._wander_decay = 1.0
        self._wander_kick = 0.0
        self._last_time_s: float | None = None
        self._delays = profile.pose_delay_s > 0.0 or profile.pose_rate_hz > 0.0
        self._past: deque[tuple[float, Vector3, Vector3]] = deque()
        self._held: tuple[Vector3, Vector3] | None = None
        self._next_pose_s = 0.0

    def _white_part(self, profile: SensorProfile, trim_deg: float) -> tuple[_Row, _Row]:
        """Deviation and mean of what is drawn anew in each update, in the order of its use."""
        error = profile.attitude
        uniform = self._generator.uniform(-1.0, 1.0, 6)
        trim = (trim_deg, trim_deg, 0.0) if error.with_trim else (0.0, 0.0, 0.0)
        spread = np.add(error.bias_spread_deg, trim)
        scale, offset = np.ones(_DRAWS), np.zeros(_DRAWS)
        scale[0:3] = profile.position_noise_m
        scale[3:6] = profile.velocity_noise_m_s
        scale[6:9] = 0.5 * np.radians(error.noise_deg)  # half angles, as quaternions want them
        offset[6:9] = 0.5 * np.radians(np.array(error.bias_deg) + spread * uniform[:3])
        scale[9:12] = profile.rate_noise_rad_s
        offset[9:12] = profile.rate_bias_spread_rad_s * uniform[3:]
        scale[12:15] = profile.acceleration_noise_m_s2
        return scale, offset

    def update(self, state: PlantState) -> Estimate:
        """The estimate of a state; to be called for each step of the plant, in order."""
        index = self._index
        if index >= len(self._noise):
            white = self._generator.standard_normal((_BLOCK, _DRAWS)) * self._scale + self._offset
            # Machine code takes rows of an array as they are; plain Python is faster with tuples.
            self._noise = list(white) if self._as_rows else list(map(tuple, white.tolist()))
            index = 0
        noise = self._noise[index]
        self._index = index + 1
        time_s = state.time_s
        if self._last_time_s is not None:
            step_s = time_s - self._last_time_s
            if abs(step_s - self._step_s) > 1e-9:
                self._set_step(step_s)
            if self._wanders:
                self._advance_wander(noise[15:18])
            if self._drift_steps is not None:
                self._advance_drift(self._drift_steps, state, noise[18:24])
        self._last_time_s = time_s

        delays = self._delays
        position, velocity = (
            self._late_pose(state) if delays else (state.position_enu_m, state.velocity_enu_m_s)
        )
        position, velocity, attitude, rate, acceleration = self._with_errors(
            noise,
            position,
            velocity,
            state.attitude_flu_to_enu,
            state.rate_flu_rad_s,
            state.acceleration_enu_m_s2,
            self._half_wander,
            self._drift_position,
            self._drift_velocity,
        )
        if delays:
            position, velocity = self._hold(time_s, (position, velocity))
        return Estimate(time_s, position, velocity, attitude, rate, acceleration)

    def _set_step(self, step_s: float) -> None:
        self._step_s = step_s
        drift = self._profile.drift
        if drift is not None:
            x, y, z = (
                drift_step(p, v, drift.damping, step_s)
                for p, v in zip(drift.position_m, drift.velocity_m_s, strict=True)
            )
            self._drift_steps = (x, y, z)
        self._wander_decay = exp(-step_s / self._profile.attitude.wander_time_s)
        self._wander_kick = sqrt(1.0 - self._wander_decay**2)

    def _advance_wander(self, noise: Noise) -> None:
        first, second, third = map(float, noise)
        decay, kick = self._wander_decay, self._wander_kick
        (a, b, c), (sa, sb, sc) = self._half_wander, self._half_wander_size
        self._half_wander = (
            decay * a + kick * sa * first,
            decay * b + kick * sb * second,
            decay * c + kick * sc * third,
        )

    def _advance_drift(
        self, steps: tuple[DriftStep, DriftStep, DriftStep], state: PlantState, noise: Noise
    ) -> None:
        if state.on_ground and sum(state.rotor_thrust_n) < self._at_rest_thrust_n:
            # A vehicle that stands still knows it (zero-velocity update).
            self._drift_velocity = (0.0, 0.0, 0.0)
            return
        (ex, ey, ez), (fx, fy, fz) = self._drift_position, self._drift_velocity
        x, y, z = steps
        n0, n1, n2, n3, n4, n5 = map(float, noise)
        self._drift_position = (
            x[0] * ex + x[1] * fx + x[4] * n0,
            y[0] * ey + y[1] * fy + y[4] * n1,
            z[0] * ez + z[1] * fz + z[4] * n2,
        )
        self._drift_velocity = (
            x[2] * ex + x[3] * fx + x[5] * n0 + x[6] * n3,
            y[2] * ey + y[3] * fy + y[5] * n1 + y[6] * n4,
            z[2] * ez + z[3] * fz + z[5] * n2 + z[6] * n5,
        )

    def _late_pose(self, state: PlantState) -> tuple[Vector3, Vector3]:
        """True position and velocity of a while ago."""
        past = self._past
        past.append((state.time_s, state.position_enu_m, state.velocity_enu_m_s))
        due_s = state.time_s - self._profile.pose_delay_s + 1e-9
        while len(past) > 1 and past[1][0] <= due_s:
            past.popleft()
        _, position, velocity = past[0]
        return position, velocity

    def _hold(self, time_s: float, pose: tuple[Vector3, Vector3]) -> tuple[Vector3, Vector3]:
        """The pose, if a new one is due; else the last that was."""
        if self._held is not None and time_s < self._next_pose_s - 1e-9:
            return self._held
        if self._profile.pose_rate_hz > 0.0:
            self._held = pose
            self._next_pose_s += 1.0 / self._profile.pose_rate_hz
        return pose
