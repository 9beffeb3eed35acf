"""The loop's delay and its jitter, and the hover thrust where the thrust field does not tell it."""

import math

import numpy as np

from companion.identification.estimates import Estimate, UnidentifiedError
from companion.identification.parts import Rows, require
from companion.identification.recording import Array, Recording

_BLOCKS = 20
_STUDENT_95 = 2.09
"""Of 19 degrees of freedom."""
_NORMAL_95 = 1.96
_LEAST_REPORTED = 50


def fit_loop_delay(recording: Recording) -> tuple[Estimate, Estimate]:
    """Mean of the loop's delay, and its standard deviation from sample to sample.

    Raises:
        UnidentifiedError: it was not measured.
    """
    delays = recording.loop_delay_s[np.isfinite(recording.loop_delay_s)]
    if len(delays) < 2 * _BLOCKS:
        raise UnidentifiedError(
            "the loop's delay was not measured: TIMESYNC went unanswered. See that the link lets "
            "it through"
        )
    jitter = float(np.std(delays))
    relative = 1.0 / math.sqrt(2.0 * len(delays))
    return (
        Estimate(float(np.mean(delays)), _of_blocks(delays), "s"),
        Estimate(jitter, _NORMAL_95 * relative * jitter, "s"),
    )


def fit_reported_hover_thrust(recording: Recording) -> Estimate | None:
    """Mean of the thrust that the autopilot reports in the hover; None if it reports none.

    The autopilot holds the climb rate at 0 meanwhile, so its mean is that of the weight.

    Raises:
        UnidentifiedError: the hover is missing.
    """
    rows = require(recording, "hover")
    rows = rows[np.isfinite(recording.reported_thrust[rows])]
    if len(rows) < _LEAST_REPORTED:
        return None
    thrust = recording.reported_thrust[rows]
    vertical = thrust * _cosines(recording, rows)
    return Estimate(float(np.mean(vertical)), _of_blocks(vertical), "")


def _cosines(recording: Recording, rows: Rows) -> Array:
    _, x, y, _ = recording.attitude_flu_to_enu[rows].T
    cosines: Array = 1.0 - 2.0 * (x * x + y * y)
    return cosines


def _of_blocks(samples: Array) -> float:
    """Half-width of the 95 % interval of a mean, of blocks as if independent (Carlstein 1986)."""
    means = np.array([float(np.mean(block)) for block in np.array_split(samples, _BLOCKS)])
    spread = float(np.std(means, ddof=1)) / math.sqrt(_BLOCKS)
    return _STUDENT_95 * spread
