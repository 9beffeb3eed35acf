"""The two setpoints that every autopilot understands alike, and nothing else.

Mask 7 is attitude and thrust, mask 128 body rates and thrust.  Other masks mean different
things on PX4 and ArduPilot, some of them dangerous ones.  A setpoint that is not finite, not of
unit norm or out of bounds cannot be made, so it cannot be sent: PX4 would accept a NaN.

Message: https://mavlink.io/en/messages/common.html#SET_ATTITUDE_TARGET.
"""

import math
import struct
from dataclasses import dataclass
from typing import ClassVar

from companion.frames import (
    Quaternion,
    Vector3,
    attitude_to_wire,
    swap_flu_frd,
    tilt_cosine,
)
from companion.mavlink.messages import MessageId, Outgoing, Target

_MASK_ATTITUDE = 7
_MASK_BODY_RATE = 128
_WIRE = struct.Struct("<I4f3ffBBB")
_SET_ATTITUDE_TARGET = int(MessageId.SET_ATTITUDE_TARGET)
_LATEST_MS = 0xFFFF_FFFF

NORM_TOLERANCE = 5e-4
"""How far from 1 a quaternion's norm may be; ArduPilot stops the vehicle at 1e-3."""
LARGEST_TILT_RAD = math.radians(75.0)
_SMALLEST_TILT_COSINE = math.cos(LARGEST_TILT_RAD)
LARGEST_RATE_RAD_S = 12.0


class InvalidSetpointError(ValueError):
    """The numbers would not be a setpoint that a vehicle may be given."""


@dataclass(frozen=True, slots=True)
class AttitudeSetpoint:
    """An attitude, heading included, and a thrust.

    Raises:
        InvalidSetpointError: a number is not finite, the quaternion is not of unit norm, the tilt
            exceeds `LARGEST_TILT_RAD`, or the thrust is not in [0, 1].
    """

    minimum_rate_hz: ClassVar[float] = 50.0
    """The stream must not be slower than this for the attitude to be tracked smoothly."""

    attitude_flu_to_enu: Quaternion
    thrust: float
    """0..1: collective thrust, or on ArduPilot by default a climb rate with 0.5 for none."""

    def __post_init__(self) -> None:
        _check_thrust(self.thrust)
        w, x, y, z = self.attitude_flu_to_enu
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        # Written so that NaN fails the comparison.
        if not abs(norm - 1.0) <= NORM_TOLERANCE:
            raise InvalidSetpointError(
                f"attitude {self.attitude_flu_to_enu} has norm {norm}, wanted 1"
            )
        if tilt_cosine(self.attitude_flu_to_enu) < _SMALLEST_TILT_COSINE:
            raise InvalidSetpointError(
                f"attitude {self.attitude_flu_to_enu} tilts by more than "
                f"{math.degrees(LARGEST_TILT_RAD):.0f} degrees"
            )


@dataclass(frozen=True, slots=True)
class BodyRateSetpoint:
    """Angular rates of the body and a thrust.

    Raises:
        InvalidSetpointError: a number is not finite, a rate exceeds `LARGEST_RATE_RAD_S`, or the
            thrust is not in [0, 1].
    """

    minimum_rate_hz: ClassVar[float] = 100.0
    """Nothing holds the attitude between two of these, so they must come fast."""

    rate_flu_rad_s: Vector3
    thrust: float

    def __post_init__(self) -> None:
        _check_thrust(self.thrust)
        for rate in self.rate_flu_rad_s:
            if not abs(rate) <= LARGEST_RATE_RAD_S:
                raise InvalidSetpointError(
                    f"body rates {self.rate_flu_rad_s} rad/s: each must be finite and at most "
                    f"{LARGEST_RATE_RAD_S} rad/s"
                )


Setpoint = AttitudeSetpoint | BodyRateSetpoint


def setpoint_message(setpoint: Setpoint, autopilot_time_s: float, target: Target) -> Outgoing:
    """SET_ATTITUDE_TARGET of a setpoint.

    Args:
        setpoint: what to ask for.
        autopilot_time_s: the autopilot's clock, time since its boot; the field begins again at 0
            after 49.7 days, as the autopilot's own do.
        target: the autopilot.

    Raises:
        InvalidSetpointError: the time is not finite, or negative.
    """
    if not 0.0 <= autopilot_time_s < math.inf:
        raise InvalidSetpointError(f"the autopilot's time cannot be {autopilot_time_s} s")
    if isinstance(setpoint, AttitudeSetpoint):
        mask = _MASK_ATTITUDE
        qw, qx, qy, qz = attitude_to_wire(setpoint.attitude_flu_to_enu)
        p = q = r = 0.0
    else:
        mask = _MASK_BODY_RATE
        qw, qx, qy, qz = 1.0, 0.0, 0.0, 0.0
        p, q, r = swap_flu_frd(setpoint.rate_flu_rad_s)
    return Outgoing(
        _SET_ATTITUDE_TARGET,
        _WIRE.pack(
            round(autopilot_time_s * 1000.0) & _LATEST_MS,
            qw, qx, qy, qz,
            p, q, r,
            setpoint.thrust,
            target.system_id,
            target.component_id,
            mask,
        ),
    )  # fmt: skip


def _check_thrust(thrust: float) -> None:
    if not 0.0 <= thrust <= 1.0:
        raise InvalidSetpointError(f"thrust {thrust} is not in 0..1")
