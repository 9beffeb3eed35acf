"""The room's motion capture: the true pose of the vehicle, noisy and late, as UDP/JSON.

One JSON object for each frame of the cameras, in a datagram of its own:

    {"body": "drone", "t": 12.34, "position": [x, y, z], "attitude": [w, x, y, z]}

Metres and seconds; z is up, and the axes of the room are the simulation's (ENU); the attitude turns
the body (FLU) into the room; t is the time of the exposure by the cameras' own clock, which is not
the autopilot's.
"""

import json
from dataclasses import dataclass
from math import radians
from typing import NamedTuple

import numpy as np

from sitl_shim.plant.state import PlantState

_SEED_STREAM = 6
"""Beside those of plant, wind, estimator, commander and fusion."""
_BLOCK = 256


@dataclass(frozen=True, slots=True)
class CameraOptions:
    """What the cameras are like: by default those of a good room."""

    body: str = "drone"
    rate_hz: float = 100.0
    delay_s: float = 0.008
    """From the exposure until the pose leaves the cameras' computer."""
    position_noise_m: float = 0.0005
    attitude_noise_deg: float = 0.1
    clock_offset_s: float = 1000.0
    """How far the cameras' clock is ahead of the boot's."""


class Frame(NamedTuple):
    """A datagram of the cameras."""

    due_s: float
    """Simulated time at which it leaves."""
    data: bytes


class MocapCamera:
    """Looks at the vehicle.

    Args:
        options: what the cameras are like.
        seed: draws their noise.
    """

    def __init__(self, options: CameraOptions, *, seed: int) -> None:
        self._options = options
        self._generator = np.random.default_rng(
            np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM,))
        )
        self._draws: list[list[float]] = []
        self._frames = 0

    def look(self, state: PlantState) -> Frame | None:
        """The frame that is exposed now, if one is; to be asked at every step."""
        options = self._options
        if state.time_s < self._frames / options.rate_hz - 1e-9:
            return None
        self._frames += 1
        if not self._draws:
            self._draws = self._generator.standard_normal((_BLOCK, 6)).tolist()
        n = self._draws.pop()
        sigma, half = options.position_noise_m, 0.5 * radians(options.attitude_noise_deg)
        x, y, z = state.position_enu_m
        w, i, j, k = state.attitude_flu_to_enu
        a, b, c = half * n[3], half * n[4], half * n[5]
        # A small rotation about the body's axes; what it does to the norm is below 1e-5.
        attitude = (
            w - i * a - j * b - k * c,
            i + w * a + j * c - k * b,
            j + w * b + k * a - i * c,
            k + w * c + i * b - j * a,
        )
        message = {
            "body": options.body,
            "t": round(state.time_s + options.clock_offset_s, 6),
            "position": [x + sigma * n[0], y + sigma * n[1], z + sigma * n[2]],
            "attitude": attitude,
        }
        return Frame(state.time_s + options.delay_s, json.dumps(message).encode())
