"""The scenario's events, as the simulation's truth tells them."""

import math
import struct
from dataclasses import dataclass

from companion.mavlink.framing import Frame
from companion.mavlink.telemetry import Rejected

_NAMED_VALUE_FLOAT = struct.Struct("<If10s")


@dataclass(frozen=True, slots=True)
class TruthEvent:
    """Something that happened to the simulated vehicle or to its air."""

    time_s: float
    """Of the autopilot's clock."""
    name: str
    """``payload``, ``motor1`` … ``motor4`` or ``front``."""
    value: float
    """Mass carried from then on (kg), the motor's thrust factor, or the front's speed (m/s)."""

    @property
    def text(self) -> str:
        """In words, for tables and pictures."""
        if self.name == "payload":
            return f"payload {self.value:.3g} kg" if self.value else "payload dropped"
        if self.name.startswith("motor"):
            return f"motor {self.name[5:]} at {self.value:.0%} thrust"
        if self.name == "front":
            return f"gust front, {self.value:.3g} m/s"
        return f"{self.name} {self.value:.3g}"


def truth_event(frame: Frame) -> TruthEvent | Rejected:
    """Read a NAMED_VALUE_FLOAT of the truth.

    https://mavlink.io/en/messages/common.html#NAMED_VALUE_FLOAT
    """
    payload = frame.payload.ljust(_NAMED_VALUE_FLOAT.size, b"\0")
    time_ms, value, name = _NAMED_VALUE_FLOAT.unpack_from(payload)
    if not math.isfinite(value):
        return Rejected(f"NAMED_VALUE_FLOAT is not finite: {value}")
    return TruthEvent(time_ms * 1e-3, name.rstrip(b"\0").decode("ascii", "replace"), value)
