"""Who is on the link: the vehicle among them, and how much of each one's traffic is lost."""

from dataclasses import dataclass, field

from companion.mavlink.codec import decode
from companion.mavlink.dialect import Message
from companion.mavlink.framing import Frame, Framer
from companion.mavlink.messages import (
    AUTOPILOT_INVALID,
    COMPONENT_AUTOPILOT,
    MessageId,
    Target,
)
from companion.mavlink.signing import Rejection, Verifier

_TYPES_THAT_FLY_OR_DRIVE = frozenset(
    [*range(5), *range(7, 18), *range(19, 26), 28, 29, 35, 43, 45, 46, 47]
)
"""MAV_TYPE of vehicles: not trackers (5), ground stations (6), companions (18), gimbals, …"""

_FULL_CIRCLE = 256
_LARGEST_GAP = 128
"""A step of the sequence beyond this is one back: a late packet, a copy, or a restart."""
_MOST_LATE = 16
"""So many late ones in a row are none: the sender has restarted."""
_MOST_PEERS = 256
_MOST_VEHICLES = 32
"""Who makes up more senders than that is not told of, and not remembered."""


@dataclass(slots=True)
class Peer:
    """One sender: a system and component that has been heard."""

    system_id: int
    component_id: int
    last_heard_s: float
    last_sequence: int
    received: int = 1
    lost: int = 0
    """Packets missing by their sequence numbers."""
    late: int = 0
    """Packets in a row that others have overtaken."""

    @property
    def loss(self) -> float:
        """Share of its packets that never came, 0..1."""
        return self.lost / (self.received + self.lost)


@dataclass(frozen=True, slots=True)
class Vehicle:
    """The vehicle, as its first heartbeat introduced it."""

    system_id: int
    component_id: int
    autopilot: int
    """MAV_AUTOPILOT: 12 PX4, 3 ArduPilot."""
    kind: int
    """MAV_TYPE: 2 quadrotor."""

    @property
    def target(self) -> Target:
        """Whom to address."""
        return Target(self.system_id, self.component_id)


def vehicle_from_heartbeat(frame: Frame, heartbeat: Message) -> Vehicle | None:
    """The vehicle that a HEARTBEAT announces; None for ground stations, companions, parts."""
    if heartbeat.autopilot == AUTOPILOT_INVALID or frame.system_id == 0:
        return None
    if heartbeat.type not in _TYPES_THAT_FLY_OR_DRIVE:
        return None
    return Vehicle(
        frame.system_id, frame.component_id, int(heartbeat.autopilot), int(heartbeat.type)
    )


def vehicle_heartbeat_in(data: bytes, verifier: Verifier | None = None) -> bool:
    """True if a datagram holds a vehicle's heartbeat: a way to tell who the peer of a link is.

    With a verifier only one that carries the right signature counts, so that nobody else can take
    the peer's place.  It is told of the last one that does not: what is dropped here nobody else
    sees.
    """
    framer = Framer()
    turned_away: tuple[Frame, Rejection] | None = None
    for frame in framer.feed(data) + framer.finish():
        if frame.message_id != MessageId.HEARTBEAT:
            continue
        if vehicle_from_heartbeat(frame, decode(frame)) is None:
            continue
        reason = None if verifier is None else verifier.preview(frame)
        if reason is None:
            return True
        turned_away = (frame, reason)
    if turned_away is not None and verifier is not None and verifier.on_turned_away is not None:
        verifier.on_turned_away(*turned_away)
    return False


@dataclass(slots=True)
class PeerTable:
    """Everybody heard on one link.

    The vehicle is the first one whose heartbeat is a vehicle's; an autopilot's own component
    (1) takes the place of another component of the same system.  It never changes otherwise:
    a second vehicle on the link must not take over a flight.
    """

    wanted_system_id: int | None = None
    """Take only this system for the vehicle; None takes the first."""
    wanted_component_id: int | None = None
    """Take only this component of it; None prefers the autopilot's own (1)."""
    vehicle: Vehicle | None = None
    other_vehicles: dict[tuple[int, int], Vehicle] = field(default_factory=dict)
    """Vehicles that were heard and not chosen, by (system, component)."""
    peers: dict[tuple[int, int], Peer] = field(default_factory=dict)

    def on_frame(self, frame: Frame, now_s: float) -> None:
        """Count a frame for its sender; one that was overtaken had been taken for lost."""
        _, _, _, system_id, component_id, sequence, _ = frame
        peer = self.peers.get((system_id, component_id))
        if peer is None:
            if len(self.peers) >= _MOST_PEERS and not self.is_vehicle(frame):
                return
            key = (system_id, component_id)
            self.peers[key] = Peer(*key, now_s, sequence)
            return
        gap = (sequence - peer.last_sequence - 1) % _FULL_CIRCLE
        peer.last_heard_s = now_s
        if gap >= _LARGEST_GAP and peer.late < _MOST_LATE:
            peer.late += 1
            if gap < _FULL_CIRCLE - 1:  # else it is a copy of the newest
                peer.received += 1
                peer.lost = max(0, peer.lost - 1)
            return
        if gap < _LARGEST_GAP:
            peer.lost += gap
        peer.received += 1
        peer.late = 0
        peer.last_sequence = sequence

    def on_heartbeat(self, frame: Frame, heartbeat: Message) -> Vehicle | None:
        """Take a HEARTBEAT; give the sender if it is a vehicle, chosen or not."""
        heard = vehicle_from_heartbeat(frame, heartbeat)
        if heard is None:
            return None
        chosen = self.vehicle
        if self.wanted_system_id not in (None, heard.system_id) or (
            self.wanted_component_id not in (None, heard.component_id)
        ):
            better = False
        elif chosen is None:
            better = True
        else:
            better = (
                heard.system_id == chosen.system_id
                and heard.component_id == COMPONENT_AUTOPILOT != chosen.component_id
            )
        if better:
            self.vehicle = heard
            self.other_vehicles.pop(heard.target, None)
        elif (chosen is None or heard.target != chosen.target) and (
            heard.target in self.other_vehicles or len(self.other_vehicles) < _MOST_VEHICLES
        ):
            self.other_vehicles[heard.target] = heard
        return heard

    @property
    def others_text(self) -> str:
        """Vehicles that were heard and not chosen, for a person; empty if there are none."""
        return ", ".join(
            f"system {vehicle.system_id} component {vehicle.component_id} "
            f"(MAV_AUTOPILOT {vehicle.autopilot})"
            for _, vehicle in sorted(self.other_vehicles.items())
        )

    def is_vehicle(self, frame: Frame) -> bool:
        """True if the frame comes from the chosen vehicle's autopilot."""
        chosen = self.vehicle
        return (
            chosen is not None
            and frame.system_id == chosen.system_id
            and frame.component_id == chosen.component_id
        )
