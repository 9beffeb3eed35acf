"""One MAVLink link of the vehicle: its streams, its numbering, what waits to leave."""

from collections import deque

from sitl_shim.mavlink.messages_truth import TRUTH_COMPONENT_ID
from sitl_shim.mavlink.signing import Signing
from sitl_shim.mavlink.streams import (
    BUILDERS,
    HEARTBEAT_ID,
    RATES_HZ,
    TRUTH_BUILDERS,
    TRUTH_RATES_HZ,
    LinkKind,
    StreamSet,
)
from sitl_shim.mavlink.wire import Message, Packer, Parser
from sitl_shim.simulation import Simulation

AUTOPILOT_COMPONENT_ID = 1
_GROUND_STATION_TIMEOUT_US = 5_000_000


class Link:
    """State of one link.

    Args:
        kind: decides the rates to start with.
        system_id: of the vehicle.
        truth: whether the simulator's truth is streamed here.
        estimate_interval_us: how often the autopilot's estimator publishes.
    """

    __slots__ = (
        "_autopilot",
        "_ground_station_us",
        "_late",
        "_truth",
        "kind",
        "outgoing",
        "parser",
        "streams",
        "truth_streams",
    )

    def __init__(
        self, kind: LinkKind, *, system_id: int, truth: bool, estimate_interval_us: int
    ) -> None:
        self.kind = kind
        self.parser = Parser()
        self.streams = StreamSet(
            BUILDERS, RATES_HZ[kind], estimate_interval_us, fixed=frozenset({HEARTBEAT_ID})
        )
        self.truth_streams = StreamSet(
            TRUTH_BUILDERS, TRUTH_RATES_HZ if truth else {}, estimate_interval_us
        )
        self.outgoing: list[bytes] = []
        """Frames that leave at this tick."""
        self._autopilot = Packer(system_id, AUTOPILOT_COMPONENT_ID)
        self._truth = Packer(system_id, TRUTH_COMPONENT_ID)
        self._late: deque[tuple[int, Message]] = deque()
        self._ground_station_us: int | None = None

    def sign(self, signing: Signing, link_id: int) -> None:
        """Sign what leaves, or no more, as the vehicle has a key or none."""
        for packer in (self._autopilot, self._truth):
            packer.sign(signing.key, link_id, signing.take_stamp)

    def send(self, message: Message) -> None:
        """Queue a message of the autopilot."""
        self.outgoing.append(self._autopilot.pack(message))

    def send_truth(self, message: Message) -> None:
        """Queue a message of the truth's component."""
        self.outgoing.append(self._truth.pack(message))

    def send_later(self, message: Message, due_us: int) -> None:
        """Queue a message of the autopilot for a later tick."""
        self._late.append((due_us, message))

    def note_ground_station(self, now_us: int) -> None:
        """A ground station's heartbeat came by this link."""
        self._ground_station_us = now_us

    def has_ground_station(self, now_us: int) -> bool:
        """Whether a ground station is on this link: only then it carries texts."""
        since = self._ground_station_us
        return since is not None and now_us - since < _GROUND_STATION_TIMEOUT_US

    def stream(self, sim: Simulation) -> None:
        """Queue what is due at this tick."""
        now_us = sim.time_us
        if self._late:
            self._send_due(now_us)
        for builder in self.streams.due(now_us):
            message = builder(sim)
            if message is not None:
                self.outgoing.append(self._autopilot.pack(message))
        for builder in self.truth_streams.due(now_us):
            self.outgoing.append(self._truth.pack(builder(sim)))

    def _send_due(self, now_us: int) -> None:
        waiting = [entry for entry in self._late if entry[0] > now_us]
        for due_us, message in self._late:
            if due_us <= now_us:
                self.send(message)
        self._late = deque(waiting)
