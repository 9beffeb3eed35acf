"""Relieving one controller by another in flight, without a bump.

The new controller starts from the state and from what the old one had commanded
(`Stack.start`).  What is left of a difference between the two commands fades out: at the hand-over
itself exactly the old command is repeated.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.control import tilt
from companion.control.frameworks import Command, StackRecord
from companion.control.interfaces import AdaptationMean
from companion.control.reference_model import Array
from companion.frames import Vector3, euler_from_quaternion, quaternion_from_euler

FADE_S = 0.3
"""Of a hand-over that was asked for."""
QUICK_FADE_S = 0.2
"""Of one away from a controller that does not do."""
_MEAN_S = 2.0


@dataclass(frozen=True, slots=True)
class Fade:
    """The command of a controller that was relieved, on its way out."""

    begun_s: float
    """Autopilot's time of the hand-over."""
    length_s: float
    forward: float
    """Sine of its pitch."""
    left: float
    """Sine of its roll, with the sign changed."""
    yaw_rad: float
    thrust: float

    def over(self, time_s: float) -> bool:
        """True if nothing is left of it."""
        return time_s - self.begun_s >= self.length_s


def fade_from(old: Command, time_s: float, length_s: float) -> Fade:
    """The fade away from a command, from a time on."""
    roll, pitch, yaw_rad = euler_from_quaternion(old.attitude_flu_to_enu)
    return Fade(time_s, length_s, math.sin(pitch), -math.sin(roll), yaw_rad, old.thrust)


def faded(fade: Fade, new: Command, time_s: float) -> tuple[Command, float, float]:
    """What is sent while a command fades into a new one: first the old, at the end the new.

    In between it is on the straight line between them, in the sines of the tilt: within every limit
    that both keep, and without a leap where the new controller's first commands have one.

    Returns:
        The command, and its roll and pitch, rad.
    """
    left = _left((time_s - fade.begun_s) / fade.length_s)
    roll, pitch, yaw_rad = euler_from_quaternion(new.attitude_flu_to_enu)
    forwards, leftwards = math.sin(pitch), -math.sin(roll)
    roll, pitch = tilt.roll_pitch_from_u(
        forwards + left * (fade.forward - forwards), leftwards + left * (fade.left - leftwards), 0.0
    )
    yaw_rad += left * math.remainder(fade.yaw_rad - yaw_rad, 2.0 * math.pi)
    thrust = new.thrust + left * (fade.thrust - new.thrust)
    return Command(quaternion_from_euler(roll, pitch, yaw_rad), thrust), roll, pitch


def _left(share: float) -> float:
    """From 1 to 0 over the fade, with no corner at either end."""
    share = max(0.0, min(1.0, share))
    return 1.0 - share * share * (3.0 - 2.0 * share)


def applied_u(command: Command, record: StackRecord, *, same_kind: bool) -> Array:
    """The u (3,) of a command, for the controller that relieves the one that made it.

    Args:
        command: that was sent last.
        record: of it.
        same_kind: both controllers mean the same by u_z; else it is NaN: not known.
    """
    roll, pitch, yaw_rad = euler_from_quaternion(command.attitude_flu_to_enu)
    u_x, u_y = tilt.u_from_roll_pitch(roll, pitch, yaw_rad)
    return np.array([u_x, u_y, float(record.applied_u[2]) if same_kind else math.nan])


def mean_step(
    before: AdaptationMean | None, record: StackRecord, velocity_m_s: Vector3, dt_s: float
) -> AdaptationMean | None:
    """The mean with a tick more; as it was where the controller has no adaptation.

    Args:
        before: of the tick before; None at the first.
        record: of the tick.
        velocity_m_s: measured.
        dt_s: since the tick before.
    """
    sigma = _triple(record.inner.sigma_hat)
    if not math.isfinite(sum(sigma)):
        return before
    u = _triple(record.applied_u)
    if before is None:
        return AdaptationMean(u, sigma, velocity_m_s)
    known_s = before.known_s + dt_s
    # A plain mean at first, then one that forgets.
    share = 1.0 - math.exp(-dt_s / min(_MEAN_S, known_s)) if known_s > 0.0 else 1.0
    return AdaptationMean(
        _moved(before.u, u, share),
        _moved(before.sigma_hat, sigma, share),
        _moved(before.velocity_m_s, velocity_m_s, share),
        known_s,
    )


def _triple(values: Array) -> Vector3:
    x, y, z = values.tolist()
    return x, y, z


def _moved(before: tuple[float, ...], new: Vector3, share: float) -> tuple[float, ...]:
    (a, b, c), (x, y, z) = before, new
    return (a + share * (x - a), b + share * (y - b), c + share * (z - c))
