"""The state estimate of the simulated autopilot: the truth with an estimator's errors."""

from collections import deque
from dataclasses import dataclass
from math import cos, exp, radians, sin, sqrt

import numpy as np

from sitl_shim.frames import Quaternion, Vector3
from sitl_shim.plant.state import PlantState
from sitl_shim.plant.vehicle import GRAVITY_M_S2, VehicleModel
from sitl_shim.sensors.drift import DriftStep, drift_step
from sitl_shim.sensors.profile import SensorProfile

_SEED_STREAM = 3
_BLOCK = 512
_DRAWS = 24


@dataclass(frozen=True, slots=True)
class Estimate:
    """What the autopilot believes.  World ENU, body FLU."""

    time_s: float
    """Of the estimate (not of its oldest ingredient)."""
    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    attitude_flu_to_enu: Quaternion
    """(w, x, y, z), body to world."""
    rate_flu_rad_s: Vector3
    acceleration_enu_m_s2: Vector3
    """Kinematic: 0 at rest."""


class Estimator:
    """Turns the truth into an estimate, once per step of the plant."""

    def __init__(self, profile: SensorProfile, vehicle: VehicleModel, *, seed: int) -> None:
        """Draw the constants of this seed.

        Args:
            profile: sizes of the errors.
            vehicle: its trim spread is a constant error of roll and pitch.
            seed: draws everything random here.
        """
        generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM,)))
        self._generator = generator
        self._noise: list[list[float]] = []
        self._index = 0
        self._profile = profile
        self._at_rest_thrust_n = 0.05 * vehicle.mass_kg * GRAVITY_M_S2

        error = profile.attitude
        trim = vehicle.spread.trim_deg
        spread = (
            error.bias_spread_deg[0] + trim,
            error.bias_spread_deg[1] + trim,
            error.bias_spread_deg[2],
        )
        uniform = generator.uniform(-1.0, 1.0, 6).tolist()
        self._bias = tuple(
            radians(b + s * u) for b, s, u in zip(error.bias_deg, spread, uniform[:3], strict=True)
        )
        self._attitude_noise = tuple(radians(value) for value in error.noise_deg)
        self._wander_size = tuple(radians(value) for value in error.wander_deg)
        self._wanders = any(error.wander_deg)
        self._yaw_is_true = not (
            any((error.bias_deg[2], spread[2], error.wander_deg[2], error.noise_deg[2]))
        )
        self._rate_bias = tuple(
            b * u for b, u in zip(profile.rate_bias_spread_rad_s, uniform[3:], strict=True)
        )
        start = generator.standard_normal(9).tolist()
        self._wander = tuple(s * n for s, n in zip(self._wander_size, start[:3], strict=True))
        self._drift_position: Vector3 = (0.0, 0.0, 0.0)
        self._drift_velocity: Vector3 = (0.0, 0.0, 0.0)
        if profile.drift is not None:
            x, y, z = (s * n for s, n in zip(profile.drift.position_m, start[3:6], strict=True))
            self._drift_position = (x, y, z)
        self._step_s = 0.0
        self._drift_steps: tuple[DriftStep, DriftStep, DriftStep] | None = None
        self._wander_decay = 1.0
        self._wander_kick = 0.0
        self._last_time_s: float | None = None
        self._delays = profile.pose_delay_s > 0.0 or profile.pose_rate_hz > 0.0
        self._past: deque[tuple[float, Vector3, Vector3]] = deque()
        self._held: tuple[Vector3, Vector3] | None = None
        self._next_pose_s = 0.0

    def update(self, state: PlantState) -> Estimate:
        """The estimate of a state; to be called for each step of the plant, in order."""
        if self._index >= len(self._noise):
            self._noise = self._generator.standard_normal((_BLOCK, _DRAWS)).tolist()
            self._index = 0
        noise = self._noise[self._index]
        self._index += 1
        if self._last_time_s is not None:
            step_s = state.time_s - self._last_time_s
            if abs(step_s - self._step_s) > 1e-9:
                self._set_step(step_s)
            self._advance(state, noise)
        self._last_time_s = state.time_s

        profile = self._profile
        (gx, gy, gz), (sx, sy, sz) = self._rate_bias, profile.rate_noise_rad_s
        ax, ay, az = profile.acceleration_noise_m_s2
        p, q, r = state.rate_flu_rad_s
        accel_x, accel_y, accel_z = state.acceleration_enu_m_s2
        position, velocity = self._pose(state, noise)
        return Estimate(
            state.time_s,
            position,
            velocity,
            self._attitude(state.attitude_flu_to_enu, noise),
            (p + gx + sx * noise[9], q + gy + sy * noise[10], r + gz + sz * noise[11]),
            (accel_x + ax * noise[12], accel_y + ay * noise[13], accel_z + az * noise[14]),
        )

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

    def _advance(self, state: PlantState, noise: list[float]) -> None:
        """Move the slow errors on by one step."""
        if self._wanders:
            decay, kick = self._wander_decay, self._wander_kick
            (a, b, c), (sa, sb, sc) = self._wander, self._wander_size
            self._wander = (
                decay * a + kick * sa * noise[15],
                decay * b + kick * sb * noise[16],
                decay * c + kick * sc * noise[17],
            )
        if self._drift_steps is None:
            return
        if state.on_ground and sum(state.rotor_thrust_n) < self._at_rest_thrust_n:
            # A vehicle that stands still knows it (zero-velocity update).
            self._drift_velocity = (0.0, 0.0, 0.0)
            return
        (ex, ey, ez), (fx, fy, fz) = self._drift_position, self._drift_velocity
        x, y, z = self._drift_steps
        n0, n1, n2, n3, n4, n5 = noise[18:24]
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

    def _pose(self, state: PlantState, noise: list[float]) -> tuple[Vector3, Vector3]:
        """Position and velocity: late and held if so set, with noise and drift."""
        (x, y, z), (vx, vy, vz) = state.position_enu_m, state.velocity_enu_m_s
        if self._delays:
            past = self._past
            past.append((state.time_s, state.position_enu_m, state.velocity_enu_m_s))
            if self._held is not None and state.time_s < self._next_pose_s - 1e-9:
                return self._held
            due_s = state.time_s - self._profile.pose_delay_s + 1e-9
            while len(past) > 1 and past[1][0] <= due_s:
                past.popleft()
            _, (x, y, z), (vx, vy, vz) = past[0]
        (ex, ey, ez), (fx, fy, fz) = self._drift_position, self._drift_velocity
        px, py, pz = self._profile.position_noise_m
        qx, qy, qz = self._profile.velocity_noise_m_s
        pose = (
            (x + ex + px * noise[0], y + ey + py * noise[1], z + ez + pz * noise[2]),
            (vx + fx + qx * noise[3], vy + fy + qy * noise[4], vz + fz + qz * noise[5]),
        )
        if self._profile.pose_rate_hz > 0.0:
            self._held = pose
            self._next_pose_s += 1.0 / self._profile.pose_rate_hz
        return pose

    def _attitude(self, truth: Quaternion, noise: list[float]) -> Quaternion:
        """Yaw error about up, from the left; roll and pitch error about the body, from the right.

        Roll and pitch error are a rotation vector of a few degrees, taken to second order.
        """
        w, x, y, z = truth
        (br, bp, by), (wr, wp, wy) = self._bias, self._wander
        nr, np_, ny = self._attitude_noise
        half_roll = 0.5 * (br + wr + nr * noise[6])
        half_pitch = 0.5 * (bp + wp + np_ * noise[7])
        rest = 1.0 - 0.5 * (half_roll * half_roll + half_pitch * half_pitch)
        w, x, y, z = (
            w * rest - x * half_roll - y * half_pitch,
            x * rest + w * half_roll - z * half_pitch,
            y * rest + w * half_pitch + z * half_roll,
            z * rest + x * half_pitch - y * half_roll,
        )
        if not self._yaw_is_true:
            half_yaw = 0.5 * (by + wy + ny * noise[8])
            c, s = cos(half_yaw), sin(half_yaw)
            w, x, y, z = c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w
        scale = 1.0 / sqrt(w * w + x * x + y * y + z * z)
        return (w * scale, x * scale, y * scale, z * scale)
