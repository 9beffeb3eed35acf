"""From power to a position: what the estimator has when, what is said, what is announced.

Times of a running ArduCopter 4.7-dev (software in the loop), all multiplied by ``boot_scale``.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from sitl_shim.autopilot.interface import Announcement, EstimatorState, StatusText

READY_S = 2.45
"""Initialised; the mode switch is read, and overwrites whatever mode was asked for."""
SWITCHES_READ_S = 2.74
"""Until here base_mode has the bit of a controlled position."""
_EKF_STARTS_S, _TILT_S, _YAW_S = 4.454, 5.794, 5.894
_GPS_SEEN_S, _GPS_FIX_S = 9.824, 10.0
HOME_S = 20.014
_ELEVATION_S, _SECOND_ORIGIN_S = 20.044, 20.214
AHRS_HEALTHY_S = 22.5
GYROS_CONSISTENT_S = 22.8
_POSITION_S = (37.5, 41.7)
"""When the estimator begins to use GPS: somewhere in between."""
YAW_ERROR_RAD = -0.0426
"""About up: 2.44 degrees clockwise, until the estimator aligns itself in flight."""
_SEED_STREAM = 4
_WARNING, _INFO = 4, 6

_TEXTS: tuple[tuple[float, str], ...] = (
    (1.9, "Barometer 1 calibration complete"),
    (1.9, "Barometer 2 calibration complete"),
    (READY_S, "ArduPilot Ready"),
    (READY_S, "AHRS: DCM active"),
    (SWITCHES_READ_S, "RC7: SaveWaypoint LOW"),
    (_EKF_STARTS_S, "EKF3 IMU0 initialised"),
    (_EKF_STARTS_S, "EKF3 IMU1 initialised"),
    (_EKF_STARTS_S, "AHRS: EKF3 active"),
    (_TILT_S, "EKF3 IMU0 tilt alignment complete"),
    (_TILT_S, "EKF3 IMU1 tilt alignment complete"),
    (_YAW_S, "EKF3 IMU0 MAG0 initial yaw alignment complete"),
    (_YAW_S, "EKF3 IMU1 MAG0 initial yaw alignment complete"),
    (9.804, "GPS 1: probing for u-blox at 230400 baud"),
    (_GPS_SEEN_S, "GPS 1: detected u-blox"),
    (HOME_S, "EKF3 IMU0 origin set"),
    (_ELEVATION_S, "Field Elevation Set: {elevation}m"),
    (_SECOND_ORIGIN_S, "EKF3 IMU1 origin set"),
)
_USING_GPS = ("EKF3 IMU0 is using GPS", "EKF3 IMU1 is using GPS")
_STOPPED_AIDING = ("EKF3 IMU0 stopped aiding", "EKF3 IMU1 stopped aiding")
_ALIGNED = (
    "EKF3 IMU1 MAG0 in-flight yaw alignment complete",
    "EKF3 IMU0 MAG0 in-flight yaw alignment complete",
)

_STARTING, _UNALIGNED, _ATTITUDE_AND_HEIGHT, _POSITION = 0x400, 0x0, 0xA7, 0x33F
"""EKF_STATUS_FLAGS as they come one after the other."""


class Boot:
    """The timeline of one boot.

    Args:
        scale: all times are multiplied by it.
        seed: draws when the estimator begins to use GPS.
        airborne: everything is over already.
        elevation_m: of the field, for a text.
    """

    def __init__(self, *, scale: float, seed: int, airborne: bool, elevation_m: float) -> None:
        generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM,)))
        self._scale = scale
        self._booted = airborne
        position_s = float(generator.uniform(*_POSITION_S))
        said = [(at, text.format(elevation=round(elevation_m))) for at, text in _TEXTS]
        said += [(position_s, text) for text in _USING_GPS]
        self._texts = iter([] if airborne else said)
        self._next: tuple[float, str] | None = next(self._texts, None)
        self._changes = iter([] if airborne else _estimator_states(position_s))
        self._state = EstimatorState(_POSITION, 6, True, True, 0.0)
        self.position_lost = False
        self._next_change: tuple[float, EstimatorState] | None = None
        if not airborne:
            _, self._state = next(self._changes)
            self._next_change = next(self._changes, None)

    @property
    def estimator(self) -> EstimatorState:
        """How far the estimator has got: without a position it says what it said before GPS."""
        state = self._state
        if self.position_lost and state.position_known:
            return replace(state, flags=_ATTITUDE_AND_HEIGHT, position_known=False)
        return state

    def lose_position(self, lost: bool) -> list[StatusText]:
        """The estimator has no position any more, or again."""
        self.position_lost = lost
        if not self._state.position_known:
            return []
        if lost:
            return [StatusText(_WARNING, text) for text in _STOPPED_AIDING]
        return [StatusText(_INFO, text) for text in _USING_GPS]

    def passed(self, time_us: int, at_s: float) -> bool:
        """Whether a time of the timeline is over."""
        return self._booted or time_us >= at_s * self._scale * 1e6

    def step(self, time_us: int) -> tuple[list[StatusText], list[Announcement]]:
        """What is said and announced in this period; the estimator's state moves on."""
        texts: list[StatusText] = []
        while self._next is not None and self.passed(time_us, self._next[0]):
            texts.append(StatusText(_INFO, self._next[1]))
            self._next = next(self._texts, None)
        announcements: list[Announcement] = []
        while self._next_change is not None and self.passed(time_us, self._next_change[0]):
            if self._next_change[1].origin_known and not self._state.origin_known:
                announcements += [Announcement.ORIGIN, Announcement.HOME]
            self._state = self._next_change[1]
            self._next_change = next(self._changes, None)
        return texts, announcements

    def align_yaw(self) -> list[StatusText]:
        """The estimator aligns its heading in flight: it jumps."""
        if self._state.yaw_error_rad == 0.0:
            return []
        self._state = replace(self._state, yaw_error_rad=0.0)
        return [StatusText(_INFO, text) for text in _ALIGNED]


def _estimator_states(position_s: float) -> Iterator[tuple[float, EstimatorState]]:
    """From when on, and what: the estimator's flags, the fix, origin and position."""
    yaw = YAW_ERROR_RAD
    yield 0.0, EstimatorState(_STARTING, 0, False, False, yaw)
    yield _EKF_STARTS_S, EstimatorState(_UNALIGNED, 0, False, False, yaw)
    yield _YAW_S, EstimatorState(_ATTITUDE_AND_HEIGHT, 0, False, False, yaw)
    yield _GPS_SEEN_S, EstimatorState(_ATTITUDE_AND_HEIGHT, 1, False, False, yaw)
    yield _GPS_FIX_S, EstimatorState(_ATTITUDE_AND_HEIGHT, 6, False, False, yaw)
    yield HOME_S, EstimatorState(_ATTITUDE_AND_HEIGHT, 6, True, False, yaw)
    yield position_s, EstimatorState(_POSITION, 6, True, True, yaw)
