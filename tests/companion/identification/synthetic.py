"""Recordings of a vehicle that is known to the last figure."""

import math
from dataclasses import dataclass, replace

import numpy as np

from companion.control.thrust import GRAVITY_M_S2
from companion.frames import quaternion_from_euler
from companion.identification.recording import Array, Recording
from companion.identification.signals import (
    GRID_S,
    accumulated,
    delayed,
    held,
    sampled,
    second_order,
)
from companion.thrust_meaning import COLLECTIVE, ThrustMeaning

CLIMB_RATE = ThrustMeaning("climb_rate", 2.5, 1.5)
PARTS = (
    ("hover", 6.0),
    ("roll", 8.0),
    ("hold", 1.0),
    ("pitch", 8.0),
    ("hold", 1.0),
    ("thrust", 8.0),
    ("climb", 9.0),
    ("swing", 12.0),
)


@dataclass(frozen=True)
class Truth:
    """What is to be found."""

    omega_rad_s: float = 11.0
    zeta: float = 0.8
    dead_time_s: float = 0.045
    gain: float = 0.98
    lag_s: float = 0.040
    lift_dead_time_s: float = 0.030
    hover_thrust: float = 0.52
    climb_omega_rad_s: float = 4.0
    climb_zeta: float = 0.7
    climb_dead_time_s: float = 0.10
    tilt_gain: float = 0.95
    linear_drag_1_s: float = 0.30
    quadratic_drag_1_m: float = 0.04
    trim_roll_rad: float = 0.010
    trim_pitch_rad: float = -0.006
    loop_delay_s: float = 0.030
    jitter_s: float = 0.002


@dataclass(frozen=True)
class Noise:
    """One sigma each; the walk is that of the velocity, m/s²/√Hz, and bounded."""

    position_m: float = 0.0
    velocity_m_s: float = 0.0
    walk_m_s2_sqrt_hz: float = 0.0
    tilt_rad: float = 0.0


MOCAP = Noise(1e-3, 1.5e-2, 0.0, 1e-3)
GNSS = Noise(2e-3, 1e-2, 0.3, 4e-4)


def record(truth: Truth, noise: Noise, seed: int, meaning: ThrustMeaning = COLLECTIVE) -> Recording:
    """A flight of that vehicle: the commands do not react to the noise."""
    draws = np.random.default_rng(np.random.SeedSequence(seed))
    duration_s = sum(length for _, length in PARTS)
    times = _times(draws, duration_s)
    names, since_s = _parts(times)
    roll, pitch = _tilt(names == "roll", since_s), _tilt(names == "pitch", since_s)
    swing = names == "swing"
    roll = roll + np.where(swing, 0.2 * np.sin(2.0 * math.pi * since_s / 5.6), 0.0)
    pitch = pitch + np.where(swing, 0.2 * np.sin(2.0 * math.pi * since_s / 4.5), 0.0)
    climb = np.where(names == "climb", _steps(since_s, 0.5, 0.9), 0.0)
    wave = np.where(names == "thrust", _steps(since_s, 0.3, 0.22), 0.0)
    wave = wave + np.where(names == "climb", 0.5 * _steps(since_s, 0.3, 0.9), 0.0)
    thrust = truth.hover_thrust * (1.0 + wave)

    end_s = float(times[-1])
    answers = [_attitude(truth, held(times, angle, end_s)) for angle in (roll, pitch)]
    tilts = [
        sampled(answer, times) + noise.tilt_rad * draws.standard_normal(len(times))
        for answer in answers
    ]
    velocity = np.stack(
        [
            *_horizontal(truth, answers, times),
            _vertical(truth, held(times, thrust, end_s), held(times, climb, end_s), times, meaning),
        ],
        axis=1,
    )
    steps = np.diff(times, prepend=0.0)[:, None]
    position = np.cumsum(velocity * steps, axis=0)
    walks = np.stack([_walk(draws, times, noise.walk_m_s2_sqrt_hz) for _ in range(3)], axis=1)
    count = (len(times), 3)
    delays = truth.loop_delay_s + truth.jitter_s * draws.standard_normal(len(times))
    return Recording(
        time_s=times + 100.0,
        received_s=times + 7.0,
        loop_delay_s=delays,
        position_enu_m=position + noise.position_m * draws.standard_normal(count),
        velocity_enu_m_s=velocity + walks + noise.velocity_m_s * draws.standard_normal(count),
        attitude_flu_to_enu=np.array(
            [quaternion_from_euler(r, p, 0.0) for r, p in zip(*tilts, strict=True)]
        ),
        rate_flu_rad_s=np.full(count, math.nan),
        roll_rad=roll,
        pitch_rad=pitch,
        yaw_rad=np.zeros(len(times)),
        thrust=thrust if meaning.kind != "climb_rate" else np.full(len(times), 0.5),
        reported_thrust=np.full(len(times), math.nan),
        climb_rate_m_s=climb,
        segment=names,
        thrust_meaning=meaning,
        autopilot="px4",
    )


def without(recording: Recording, part: str) -> Recording:
    """The same without a part."""
    return recording.rows(recording.segment != part)


def with_columns(recording: Recording, **columns: Array) -> Recording:
    """The same with other columns."""
    return replace(recording, **columns)  # type: ignore[arg-type]


def _times(draws: np.random.Generator, duration_s: float) -> Array:
    """100 Hz on a grid of 4 ms, as an autopilot that loops at 250 Hz samples."""
    ideal = np.arange(0.0, duration_s, 0.010)
    times = np.round(ideal / 0.004) * 0.004
    late = 0.004 * (draws.random(len(times)) < 0.05)
    return np.unique(np.round(times + late, 6))


def _parts(times: Array) -> tuple[Array, Array]:
    ends = np.cumsum([length for _, length in PARTS])
    index = np.clip(np.searchsorted(ends, times, side="right"), 0, len(PARTS) - 1)
    begins = ends - np.array([length for _, length in PARTS])
    names = np.array([name for name, _ in PARTS])[index]
    return names, times - begins[index]


def _steps(since_s: Array, size: float, half_s: float) -> Array:
    """+, 0, -, 0, -, 0, +, 0 for a climb; the same serves as a wave."""
    levels = np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0, 0.0])
    return size * levels[(since_s / half_s).astype(int) % len(levels)]


def _tilt(rows: Array, since_s: Array) -> Array:
    levels = np.array([1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0])
    return np.where(rows, math.radians(8.0) * levels[(since_s / 0.5).astype(int) % 8], 0.0)


def _attitude(truth: Truth, commanded: Array) -> Array:
    return truth.gain * delayed(
        second_order(commanded, truth.omega_rad_s, truth.zeta), truth.dead_time_s
    )


def _horizontal(truth: Truth, answers: list[Array], times: Array) -> list[Array]:
    roll, pitch = answers
    push_x = truth.tilt_gain * GRAVITY_M_S2 * np.tan(pitch)
    push_y = -truth.tilt_gain * GRAVITY_M_S2 * np.tan(roll) / np.cos(pitch)
    push_x = push_x - GRAVITY_M_S2 * math.tan(truth.trim_pitch_rad)
    push_y = push_y + GRAVITY_M_S2 * math.tan(truth.trim_roll_rad)
    x = y = 0.0
    moved = np.zeros((len(push_x), 2))
    for k, (ax, ay) in enumerate(zip(push_x.tolist(), push_y.tolist(), strict=True)):
        moved[k] = x, y
        drag = truth.linear_drag_1_s + truth.quadratic_drag_1_m * math.hypot(x, y)
        x += GRID_S * (ax - drag * x)
        y += GRID_S * (ay - drag * y)
    return [sampled(moved[:, 0], times), sampled(moved[:, 1], times)]


def _vertical(
    truth: Truth, thrust: Array, climb: Array, times: Array, meaning: ThrustMeaning
) -> Array:
    if meaning.kind == "climb_rate":
        answer = second_order(climb, truth.climb_omega_rad_s, truth.climb_zeta)
        return sampled(delayed(answer, truth.climb_dead_time_s), times)
    fast_s = 1.0 / 250.0
    omega = 1.0 / math.sqrt(truth.lag_s * fast_s)
    zeta = 0.5 * (truth.lag_s + fast_s) * omega
    force = delayed(second_order(thrust, omega, zeta), truth.lift_dead_time_s)
    pushed = accumulated(GRAVITY_M_S2 * (force / truth.hover_thrust - 1.0), 0.3)
    return sampled(pushed, times)


def _walk(draws: np.random.Generator, times: Array, density: float) -> Array:
    """Velocity of a damped oscillation that white acceleration drives."""
    kicks = density * math.sqrt(0.002) * draws.standard_normal(round(times[-1] / 0.002) + 2)
    error = rate = 0.0
    moved = np.zeros(len(kicks))
    for k, kick in enumerate(kicks.tolist()):
        moved[k] = rate
        rate += 0.002 * (-1.4 * 1.2 * rate - 1.44 * error) + kick
        error += 0.002 * rate
    return moved[np.round(times / 0.002).astype(int)]
