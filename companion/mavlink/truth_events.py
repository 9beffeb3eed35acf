"""The events of a scenario, and the faults, as the simulation's truth tells them."""

import math
import struct
from dataclasses import dataclass

from companion.mavlink.framing import Frame
from companion.mavlink.telemetry import Rejected

_NAMED_VALUE_FLOAT = struct.Struct("<If10s")

_WORDS: dict[str, tuple[str, str]] = {
    "front": ("gust front, {value:.3g} m/s", ""),
    "reset": ("estimate reset by {value:.3g} m", "estimate reset"),
    "jump": ("estimate jumps by {value:.3g} m, unannounced", "estimate jumps, unannounced"),
    "velocity": ("estimated velocity steps by {value:.3g} m/s", ""),
    "heading": ("estimated heading steps by {value:.3g}°", ""),
    "pos lost": ("position lost", "position back"),
    "frozen": ("telemetry frozen", "telemetry goes on"),
    "clock": ("autopilot's clock jumps by {value:+.3g} s", ""),
    "reboot": ("autopilot reboots", ""),
    "mode": ("mode chosen by somebody else", ""),
    "disarm": ("disarmed by somebody else", ""),
    "battery": ("battery reports {value:.0%}", ""),
    "link": ("link fault {value:.0f} begins", ""),
}
"""What is said, and what where the value is 0; without the latter always the former."""


@dataclass(frozen=True, slots=True)
class TruthEvent:
    """Something that happened to the simulated vehicle or to its air."""

    time_s: float
    """Of the autopilot's clock."""
    name: str
    """``payload``, ``motor1`` … ``motor4`` or ``front``; of a fault ``reset``, ``jump``,
    ``velocity``, ``heading``, ``pos lost``, ``frozen``, ``clock``, ``reboot``, ``mode``,
    ``disarm``, ``battery`` or ``link``."""
    value: float
    """Mass carried from then on (kg), the motor's thrust factor, the front's speed (m/s); metres
    that the estimate steps by, m/s or degrees beside that; 1 at the beginning and 0 at the end of
    what lasts; the clock's jump (s), the number of the boot, the custom_mode, the share that the
    battery reports, or the link fault's place in its file."""

    @property
    def text(self) -> str:
        """In words, for tables and pictures."""
        if self.name == "payload":
            return f"payload {self.value:.3g} kg" if self.value else "payload dropped"
        if self.name.startswith("motor"):
            return f"motor {self.name[5:]} at {self.value:.0%} thrust"
        words = _WORDS.get(self.name)
        if words is not None:
            begins, ends = words
            return (begins if self.value or not ends else ends).format(value=self.value)
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
