"""The wire between companion and shim, for tests that listen to it and tamper with it."""

import asyncio
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, field

from companion.frames import tilt_cosine
from companion.mavlink.codec import Packer
from companion.mavlink.commands import Command, disarm
from companion.mavlink.crc import CRC_TABLE, crc16
from companion.mavlink.dialect import CRC_EXTRA
from companion.mavlink.dialects import dialect_named
from companion.mavlink.dialects.base import AutopilotDialect
from companion.mavlink.messages import MessageId, Target

AUTOPILOT = 1
GROUND_STATION = Packer(255, 190)
_HEARTBEAT = struct.Struct("<IBBBBB")
_SETPOINT = struct.Struct("<I4f3ffBBB")
_COMMAND = struct.Struct("<7fHBBB")

Tamper = Callable[["Packet"], bytes]


@dataclass(frozen=True)
class Packet:
    """A MAVLink 2 packet on its way."""

    time_s: float
    raw: bytes

    @property
    def message_id(self):
        return int.from_bytes(self.raw[7:10], "little")

    @property
    def component_id(self):
        return self.raw[6]

    @property
    def payload(self):
        return self.raw[10 : 10 + self.raw[1]]

    def fields(self, layout):
        return layout.unpack(self.payload.ljust(layout.size, b"\0")[: layout.size])

    def with_payload(self, payload):
        """The packet with another payload and the right CRC."""
        covered = bytes([len(payload)]) + self.raw[2:10] + payload
        crc = crc16(covered)
        crc = CRC_TABLE[(crc ^ CRC_EXTRA[self.message_id]) & 0xFF] ^ (crc >> 8)
        return self.raw[:1] + covered + crc.to_bytes(2, "little")


@dataclass(frozen=True)
class SentSetpoint:
    time_s: float
    state_age_s: float
    """Since the last state passed the wire."""
    quaternion: tuple
    thrust: float
    mask: int
    rates: tuple = (0.0, 0.0, 0.0)

    @property
    def tilt_deg(self):
        return math.degrees(math.acos(min(1.0, tilt_cosine(self.quaternion))))


@dataclass
class Wire:
    """Listens to both ways; `from_shim` and `to_shim` may be set, and reset, in flight."""

    dialect: AutopilotDialect = field(default_factory=lambda: dialect_named("px4"))
    state_message: MessageId = MessageId.ODOMETRY
    """Completes a sample of the state."""
    from_shim: Tamper | None = None
    to_shim: Tamper | None = None
    setpoints: list[SentSetpoint] = field(default_factory=list)
    commands: list[tuple] = field(default_factory=list)
    """(time, command id, parameters) that the companion sent."""
    modes: list[tuple] = field(default_factory=list)
    """(time, name) of each change of mode that the vehicle truly reported."""
    armed: list[tuple] = field(default_factory=list)
    """(time, armed) of each change that the vehicle truly reported."""
    texts: list[str] = field(default_factory=list)
    """STATUSTEXTs of the companion, chunks joined."""
    health: list[tuple] = field(default_factory=list)
    """(time, MAV_STATE) of each heartbeat of the companion."""
    last_state_s: float = -math.inf
    _to_shim_too: list[bytes] = field(default_factory=list)
    _from_shim_too: list[bytes] = field(default_factory=list)
    _text: bytes = b""

    # --- the taps ---

    def tap_from_shim(self, raw):
        packet = Packet(asyncio.get_running_loop().time(), raw)
        if packet.component_id == AUTOPILOT and packet.message_id == MessageId.HEARTBEAT:
            self._note_heartbeat(packet)
        arriving = raw if self.from_shim is None else self.from_shim(packet)
        is_state = packet.component_id == AUTOPILOT and packet.message_id == self.state_message
        if arriving and is_state:
            self.last_state_s = packet.time_s
        more, self._from_shim_too = self._from_shim_too, []
        return b"".join([arriving, *more])

    def tap_to_shim(self, raw):
        packet = Packet(asyncio.get_running_loop().time(), raw)
        self._note_sent(packet)
        arriving = raw if self.to_shim is None else self.to_shim(packet)
        more, self._to_shim_too = self._to_shim_too, []
        return b"".join([arriving, *more])

    # --- what tests do ---

    def listen_as(self, name):
        """Understand the vehicle as an autopilot of this kind."""
        self.dialect = dialect_named(name)
        if name == "ardupilot":
            self.state_message = MessageId.LOCAL_POSITION_NED

    def send_to_vehicle(self, outgoing):
        """As a ground station on the same link."""
        self._to_shim_too.append(GROUND_STATION.pack(outgoing))

    def send_to_companion(self, outgoing, component=AUTOPILOT):
        """As the vehicle."""
        self._from_shim_too.append(Packer(1, component).pack(outgoing))

    def change_mode(self, name):
        self.send_to_vehicle(self.dialect.set_mode(Target(1), name).as_long())

    def disarm_by_force(self):
        command: Command = disarm(Target(1), force=True)
        self.send_to_vehicle(command.as_long())

    def cut(self, duration_s=None, only=None):
        """Lose what the vehicle sends (messages of the ids `only`, or all), for a time."""
        self.from_shim = lambda p: (
            b"" if only is None or (p.message_id in only and p.component_id == AUTOPILOT) else p.raw
        )
        self.restore_after(duration_s)

    def restore_after(self, duration_s):
        if duration_s is not None:
            asyncio.get_running_loop().call_later(duration_s, self.restore)

    def restore(self):
        self.from_shim = self.to_shim = None

    def setpoints_after(self, time_s):
        return [s for s in self.setpoints if s.time_s > time_s]

    def mode_requests(self):
        """(time, main mode, sub mode) that the companion asked for."""
        return [(t, p[1], p[2]) for t, c, p in self.commands if c == 176]

    # --- listening ---

    def _note_heartbeat(self, packet):
        custom_mode, _, _, base_mode, _, _ = packet.fields(_HEARTBEAT)
        mode, armed = self.dialect.mode_name(custom_mode), bool(base_mode & 0x80)
        if not self.modes or self.modes[-1][1] != mode:
            self.modes.append((packet.time_s, mode))
        if not self.armed or self.armed[-1][1] != armed:
            self.armed.append((packet.time_s, armed))

    def _note_sent(self, packet):
        if packet.message_id == MessageId.SET_ATTITUDE_TARGET:
            _, qw, qx, qy, qz, *rates, thrust, _, _, mask = packet.fields(_SETPOINT)
            age = packet.time_s - self.last_state_s
            attitude = (qw, qx, qy, qz)
            self.setpoints.append(
                SentSetpoint(packet.time_s, age, attitude, thrust, mask, tuple(rates))
            )
        elif packet.message_id == MessageId.HEARTBEAT:
            self.health.append((packet.time_s, packet.fields(_HEARTBEAT)[4]))
        elif packet.message_id == MessageId.COMMAND_LONG:
            *parameters, command_id, _, _, _ = packet.fields(_COMMAND)
            self.commands.append((packet.time_s, command_id, tuple(parameters)))
        elif packet.message_id == MessageId.STATUSTEXT:
            chunk = packet.payload[1:51]
            self._text += chunk.rstrip(b"\0")
            if len(chunk.rstrip(b"\0")) < 50:
                self.texts.append(self._text.decode())
                self._text = b""
