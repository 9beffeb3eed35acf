"""From telemetry packets to the vehicle's state: the reading side of the MAVLink edge.

These read the payload bytes, not message objects: they run at every sample.  Field order is that
of the wire (https://mavlink.io/en/messages/common.html#ODOMETRY and so on).
"""

import math
import struct
from dataclasses import dataclass

from companion.frames import (
    Quaternion,
    Vector3,
    attitude_from_wire,
    rotate,
    swap_enu_ned,
    swap_flu_frd,
)
from companion.mavlink.framing import Frame
from companion.mavlink.messages import COMPONENT_TRUTH, MessageId
from companion.vehicle_state import VehicleState

_FRAME_LOCAL_NED = 1
_BODY_FRAMES = (8, 12)
"""MAV_FRAME_BODY_NED, deprecated but sent, and MAV_FRAME_BODY_FRD."""

_ODOMETRY_BYTES = 230
_ODOMETRY = struct.Struct("<Q13f168xBB")
_DEBUG_VECT = struct.Struct("<Q3f10s")

FARTHEST_M = 1.0e5
FASTEST_M_S = 300.0
_NORM_TOLERANCE = 0.01


@dataclass(frozen=True, slots=True)
class Rejected:
    """A sample that says nothing usable."""

    reason: str
    """One sentence for the log, naming the message and the field."""


@dataclass(frozen=True, slots=True)
class WindAcceleration:
    """Acceleration that the air causes, as the simulation's truth gives it."""

    time_s: float
    acceleration_enu_m_s2: Vector3


def is_truth(frame: Frame) -> bool:
    """True for what only a simulation can know: for the recording and the report alone."""
    return (
        frame.component_id == COMPONENT_TRUTH or frame.message_id == MessageId.HIL_STATE_QUATERNION
    )


def state_from_odometry(frame: Frame) -> VehicleState | Rejected:
    """State from an ODOMETRY whose pose is in the local NED frame.

    The velocity is in the frame that `child_frame_id` names: PX4 says 1 and means NED; body
    frames are rotated by the attitude of the same sample.  Angular rates are of the body always.
    """
    payload = frame.payload
    if len(payload) < _ODOMETRY_BYTES:
        payload = payload.ljust(_ODOMETRY_BYTES, b"\0")
    (
        time_us, x, y, z, qw, qx, qy, qz, vx, vy, vz, p, q, r, pose_frame, twist_frame,
    ) = _ODOMETRY.unpack_from(payload)  # fmt: skip
    if pose_frame != _FRAME_LOCAL_NED:
        return Rejected(f"ODOMETRY has its pose in frame {pose_frame}, wanted 1 (local NED)")
    velocity = (vx, vy, vz)
    if twist_frame != _FRAME_LOCAL_NED:
        if twist_frame not in _BODY_FRAMES:
            return Rejected(f"ODOMETRY has its velocity in frame {twist_frame}, wanted 1, 8 or 12")
        velocity = rotate((qw, qx, qy, qz), velocity)
    return _state("ODOMETRY", time_us * 1e-6, (x, y, z), velocity, (qw, qx, qy, qz), (p, q, r))


def wind_acceleration(frame: Frame) -> WindAcceleration | Rejected | None:
    """The acceleration by wind from a DEBUG_VECT `wind_acc` (NED, m/s²); None if not that."""
    time_us, x, y, z, name = _DEBUG_VECT.unpack_from(frame.payload.ljust(_DEBUG_VECT.size, b"\0"))
    if name.rstrip(b"\0") != b"wind_acc":
        return None
    if not math.isfinite(x + y + z):
        return Rejected(f"DEBUG_VECT wind_acc is not finite: {x}, {y}, {z}")
    return WindAcceleration(time_us * 1e-6, swap_enu_ned((x, y, z)))


def _state(
    message: str,
    time_s: float,
    position_ned_m: Vector3,
    velocity_ned_m_s: Vector3,
    frd_to_ned: Quaternion,
    rate_frd_rad_s: Vector3,
) -> VehicleState | Rejected:
    """Check everything, then turn it into the companion's frames."""
    problem = _problem(message, position_ned_m, velocity_ned_m_s, rate_frd_rad_s)
    if problem is not None:
        return Rejected(problem)
    w, x, y, z = frd_to_ned
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if not abs(norm - 1.0) <= _NORM_TOLERANCE:
        return Rejected(f"{message} has an attitude quaternion of norm {norm:.3g}, wanted 1")
    return VehicleState(
        time_s,
        swap_enu_ned(position_ned_m),
        swap_enu_ned(velocity_ned_m_s),
        attitude_from_wire((w / norm, x / norm, y / norm, z / norm)),
        swap_flu_frd(rate_frd_rad_s),
    )


def _problem(
    message: str, position_m: Vector3, velocity_m_s: Vector3, rate_rad_s: Vector3
) -> str | None:
    """What is wrong with a sample, in words, or None.  Comparisons with NaN are false."""
    x, y, z = position_m
    vx, vy, vz = velocity_m_s
    p, q, r = rate_rad_s
    if not (abs(x) + abs(y) + abs(z) < FARTHEST_M):
        return f"{message} has an impossible position: {x:g}, {y:g}, {z:g} m"
    if not (abs(vx) + abs(vy) + abs(vz) < FASTEST_M_S):
        return f"{message} has an impossible velocity: {vx:g}, {vy:g}, {vz:g} m/s"
    if not math.isfinite(p + q + r):
        return f"{message} has rates that are not finite: {p:g}, {q:g}, {r:g} rad/s"
    return None
