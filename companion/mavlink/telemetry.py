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
    quaternion_multiply,
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

_ODOMETRY_BYTES = 231
"""Up to the extension `reset_counter`, which is 0 where it was not sent."""
_ODOMETRY = struct.Struct("<Q13f168xBBB")
_HIL_STATE_QUATERNION = int(MessageId.HIL_STATE_QUATERNION)
_POSITION = struct.Struct("<I6f")
_ATTITUDE = struct.Struct("<I7f")
_DEBUG_VECT = struct.Struct("<Q3f10s")
_WRAP_MS = 1 << 32
"""`time_boot_ms` begins again at 0 after 49.7 days."""

LARGEST_CARRY_S = 0.03
"""An attitude further than this from the position's time is not carried to it."""

FARTHEST_M = 1.0e5
FASTEST_M_S = 300.0
_NORM_TOLERANCE = 0.01


@dataclass(frozen=True, slots=True)
class Rejected:
    """A sample that says nothing usable."""

    reason: str
    """One sentence for the log, naming the message and the field."""


# LocalPosition and WireAttitude are made at every tick, and frozen
# they take several times as long to make: change none.
@dataclass(slots=True)
class LocalPosition:
    """A LOCAL_POSITION_NED as it was sent."""

    time_boot_ms: int
    position_ned_m: Vector3
    velocity_ned_m_s: Vector3


@dataclass(slots=True)
class WireAttitude:
    """An ATTITUDE_QUATERNION as it was sent."""

    time_boot_ms: int
    frd_to_ned: Quaternion
    rate_frd_rad_s: Vector3


@dataclass(frozen=True, slots=True)
class WindAcceleration:
    """Acceleration that the air causes, as the simulation's truth gives it."""

    time_s: float
    acceleration_enu_m_s2: Vector3


def is_truth(frame: Frame) -> bool:
    """True for what only a simulation can know: for the recording and the report alone."""
    return frame.component_id == COMPONENT_TRUTH or frame.message_id == _HIL_STATE_QUATERNION


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
        reset_counter,
    ) = _ODOMETRY.unpack_from(payload)  # fmt: skip
    if pose_frame != _FRAME_LOCAL_NED:
        return Rejected(f"ODOMETRY has its pose in frame {pose_frame}, wanted 1 (local NED)")
    velocity = (vx, vy, vz)
    if twist_frame != _FRAME_LOCAL_NED:
        if twist_frame not in _BODY_FRAMES:
            return Rejected(f"ODOMETRY has its velocity in frame {twist_frame}, wanted 1, 8 or 12")
        velocity = rotate((qw, qx, qy, qz), velocity)
    return _state(
        "ODOMETRY",
        time_us * 1e-6,
        (x, y, z),
        velocity,
        (qw, qx, qy, qz),
        (p, q, r),
        reset_counter,
    )


def local_position(frame: Frame) -> LocalPosition:
    """Read a LOCAL_POSITION_NED."""
    time_ms, x, y, z, vx, vy, vz = _POSITION.unpack_from(frame.payload.ljust(_POSITION.size, b"\0"))
    return LocalPosition(time_ms, (x, y, z), (vx, vy, vz))


def wire_attitude(frame: Frame) -> WireAttitude:
    """Read an ATTITUDE_QUATERNION."""
    payload = frame.payload
    if len(payload) < _ATTITUDE.size:
        payload = payload.ljust(_ATTITUDE.size, b"\0")
    time_ms, qw, qx, qy, qz, p, q, r = _ATTITUDE.unpack_from(payload)
    return WireAttitude(time_ms, (qw, qx, qy, qz), (p, q, r))


def state_from_parts(
    position: LocalPosition, attitude: WireAttitude, time_s: float
) -> VehicleState | Rejected:
    """State from a position and the newest attitude, for autopilots without ODOMETRY.

    The state's time is the position's; the attitude is carried to it by its own rates.

    Args:
        position: LOCAL_POSITION_NED.
        attitude: ATTITUDE_QUATERNION.
        time_s: the position's time since boot, any wrap of its 32 bits undone.
    """
    carried_ms = (position.time_boot_ms - attitude.time_boot_ms + _WRAP_MS // 2) % _WRAP_MS
    carried_s = (carried_ms - _WRAP_MS // 2) * 1e-3
    if abs(carried_s) > LARGEST_CARRY_S:
        order = "older" if carried_s > 0.0 else "newer"
        return Rejected(
            f"LOCAL_POSITION_NED has only an ATTITUDE_QUATERNION that is "
            f"{abs(carried_s) * 1e3:.0f} ms {order}, and at most "
            f"{LARGEST_CARRY_S * 1e3:.0f} ms are bridged"
        )
    q = attitude.frd_to_ned
    if carried_s != 0.0:
        q = _turned(q, attitude.rate_frd_rad_s, carried_s)
    return _state(
        "LOCAL_POSITION_NED with ATTITUDE_QUATERNION",
        time_s,
        position.position_ned_m,
        position.velocity_ned_m_s,
        q,
        attitude.rate_frd_rad_s,
    )


def unwrapped_s(time_boot_ms: int, about_s: float) -> float:
    """A `time_boot_ms` of 32 bits as seconds since boot: the one nearest to `about_s`."""
    turns = round((about_s * 1e3 - time_boot_ms) / _WRAP_MS)
    return (time_boot_ms + max(0, turns) * _WRAP_MS) * 1e-3


def _turned(q: Quaternion, rate_rad_s: Vector3, duration_s: float) -> Quaternion:
    """An attitude after turning at constant body rates; not finite if those are not."""
    x, y, z = rate_rad_s
    speed = math.sqrt(x * x + y * y + z * z)
    half = 0.5 * speed * duration_s
    if not abs(half) < math.pi:
        return (math.nan,) * 4
    share = math.sin(half) / speed if speed > 0.0 else 0.5 * duration_s
    return quaternion_multiply(q, (math.cos(half), share * x, share * y, share * z))


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
    reset_counter: int = 0,
) -> VehicleState | Rejected:
    """Check everything, then turn it into the companion's frames."""
    # Comparisons with NaN are false.
    x, y, z = position_ned_m
    if not (abs(x) + abs(y) + abs(z) < FARTHEST_M):
        return Rejected(f"{message} has an impossible position: {x:g}, {y:g}, {z:g} m")
    vx, vy, vz = velocity_ned_m_s
    if not (abs(vx) + abs(vy) + abs(vz) < FASTEST_M_S):
        return Rejected(f"{message} has an impossible velocity: {vx:g}, {vy:g}, {vz:g} m/s")
    p, q, r = rate_frd_rad_s
    if not math.isfinite(p + q + r):
        return Rejected(f"{message} has rates that are not finite: {p:g}, {q:g}, {r:g} rad/s")
    qw, qx, qy, qz = frd_to_ned
    norm = math.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
    if not abs(norm - 1.0) <= _NORM_TOLERANCE:
        return Rejected(f"{message} has an attitude quaternion of norm {norm:.3g}, wanted 1")
    return VehicleState(
        time_s,
        swap_enu_ned(position_ned_m),
        swap_enu_ned(velocity_ned_m_s),
        attitude_from_wire((qw / norm, qx / norm, qy / norm, qz / norm)),
        swap_flu_frd(rate_frd_rad_s),
        reset_counter,
    )
