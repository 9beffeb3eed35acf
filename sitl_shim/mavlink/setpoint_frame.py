"""SET_ATTITUDE_TARGET (82) read straight from its frame: by far the most frequent that comes in.

Only a chunk of bytes that is one whole, sound, unsigned MAVLink 2 frame of it is read here; all
else is the parser's.  https://mavlink.io/en/messages/common.html#SET_ATTITUDE_TARGET
"""

from struct import Struct
from typing import Final, NamedTuple

from fastcrc.crc16 import mcrf4xx

from sitl_shim.autopilot.interface import AttitudeTarget
from sitl_shim.frames import attitude_from_wire, swap_flu_frd
from sitl_shim.mavlink.wire import dialect

_MESSAGE: Final = dialect.MAVLink_set_attitude_target_message
_SEED: Final = bytes([_MESSAGE.crc_extra])
_PAYLOAD: Final = Struct("<I8fBBB12x")
"""Without thrust_body, which this vehicle has no use for."""
_HEADER_BYTES: Final = 10
_FRAME_BYTES: Final = _HEADER_BYTES + 2
_FLAGS: Final = b"\0\0"
_ID: Final = int(_MESSAGE.id).to_bytes(3, "little")


class Setpoint(NamedTuple):
    """What a frame said."""

    target_system: int
    target_component: int
    target: AttitudeTarget


def read_setpoint(frame: bytes) -> Setpoint | None:
    """The setpoint of a chunk that is a whole frame of one; None for any other chunk."""
    if len(frame) <= _FRAME_BYTES or frame[0] != 0xFD or frame[7:_HEADER_BYTES] != _ID:
        return None
    end = _HEADER_BYTES + frame[1]
    if (
        len(frame) != end + 2
        or frame[1] > _PAYLOAD.size
        or frame[2:4] != _FLAGS
        or mcrf4xx(frame[1:end] + _SEED) != frame[end] | frame[end + 1] << 8
    ):
        return None
    _, w, x, y, z, p, q, r, thrust, system, component, mask = _PAYLOAD.unpack(
        frame[_HEADER_BYTES:end].ljust(_PAYLOAD.size, b"\0")
    )
    target = AttitudeTarget(mask, attitude_from_wire((w, x, y, z)), swap_flu_frd((p, q, r)), thrust)
    return Setpoint(system, component, target)
