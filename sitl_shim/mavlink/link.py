"""One MAVLink link of the vehicle: its streams, its numbering, what waits to leave."""

from collections import deque
from collections.abc import Hashable, Sequence

import numpy as np

from sitl_shim.mavlink.messages_status import heartbeat
from sitl_shim.mavlink.messages_truth import TRUTH_COMPONENT_ID
from sitl_shim.mavlink.personality import Personality
from sitl_shim.mavlink.signing import Signing
from sitl_shim.mavlink.streams import (
    TRUTH_BUILDERS,
    TRUTH_RATES_HZ,
    Builder,
    LinkKind,
    StreamSet,
    timesync,
)
from sitl_shim.mavlink.wire import Message, Packer, Parser
from sitl_shim.simulation import Simulation

AUTOPILOT_COMPONENT_ID = 1
_GROUND_STATION_TIMEOUT_US = 5_000_000
_BOOTING = 1
"""MAV_STATE_BOOT."""
_NEVER_QUIET = (heartbeat, timesync)
_STATUS_PERIOD_US = 500_000
_DRAWS = 1024
"""Random numbers drawn at a time."""


class Link:
    """State of one link.

    Args:
        kind: decides the rates to start with.
        personality: manners of the flavour.
        system_id: of the vehicle.
        truth: whether the simulator's truth is streamed here.
        estimate_interval_us: how often the autopilot's estimator publishes.
        random: draws which ticks let messages leave, where the flavour sends in bursts.
        truth_begins_us: boot time from which the truth is streamed.
    """

    __slots__ = (
        "_autopilot",
        "_draws",
        "_ground_station_us",
        "_held_since_us",
        "_late",
        "_quiet",
        "_random",
        "_truth",
        "kind",
        "outgoing",
        "parser",
        "personality",
        "spoken_to",
        "streams",
        "truth_streams",
    )

    def __init__(
        self,
        kind: LinkKind,
        personality: Personality,
        *,
        system_id: int,
        truth: bool,
        estimate_interval_us: int,
        random: np.random.Generator,
        truth_begins_us: int,
    ) -> None:
        self.kind = kind
        self.personality = personality
        self.parser = Parser()
        self.streams = StreamSet(
            personality.builders,
            personality.rates_hz[kind],
            estimate_interval_us,
            grid_origin_us=personality.grid_origin_us,
            begin_us=personality.listens_from_us,
            fixed=personality.fixed_rates,
            about_status=personality.about_status,
        )
        self.truth_streams = StreamSet(
            TRUTH_BUILDERS,
            TRUTH_RATES_HZ if truth else {},
            estimate_interval_us,
            grid_origin_us=personality.grid_origin_us,
            begin_us=truth_begins_us,
        )
        self.spoken_to = False
        """Whether a client has said anything here."""
        self.outgoing: list[bytes] = []
        """Frames that leave at this tick."""
        self._autopilot = Packer(system_id, AUTOPILOT_COMPONENT_ID)
        self._truth = Packer(system_id, TRUTH_COMPONENT_ID)
        self._late: deque[tuple[int, Message]] = deque()
        self._ground_station_us: int | None = None
        self._random = random
        self._draws: list[float] = []
        self._held_since_us: int | None = None
        self._quiet = personality.quiet_while_booting

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

    def carries_texts(self, now_us: int) -> bool:
        """Whether texts are sent here: to whoever has spoken, or to ground stations alone."""
        if self.personality.texts_to_every_link:
            return self.spoken_to
        return self._has_ground_station(now_us)

    def take(self, now_us: int) -> list[bytes]:
        """The frames that leave at this tick: all that is queued, or none of it."""
        frames = self.outgoing
        if not frames or self._holds(now_us):
            return []
        self.outgoing = []
        return frames

    def _holds(self, now_us: int) -> bool:
        """Whether what is queued waits for a later tick, as the flavour's bursts have it."""
        share = self.personality.held_share
        if share == 0.0:
            return False
        if not self._draws:
            self._draws = self._random.random(_DRAWS).tolist()
        since = now_us if self._held_since_us is None else self._held_since_us
        if self._draws.pop() < share and now_us - since < self.personality.longest_held_us:
            self._held_since_us = since
            return True
        self._held_since_us = None
        return False

    def _has_ground_station(self, now_us: int) -> bool:
        since = self._ground_station_us
        return since is not None and now_us - since < _GROUND_STATION_TIMEOUT_US

    def stream(self, sim: Simulation) -> None:
        """Queue what is due at this tick."""
        now_us = sim.time_us
        if self._late:
            self._send_due(now_us)
        if now_us >= self.streams.next_us:
            due = self.streams.due(now_us, lambda: _published(sim))
            if self._quiet:
                self._quiet = sim.autopilot.heartbeat.system_status == _BOOTING
                due = [builder for builder in due if not self._quiet or builder in _NEVER_QUIET]
            _send_all(due, sim, self._autopilot, self.outgoing)
        self.stream_truth(sim)

    def stream_truth(self, sim: Simulation) -> None:
        """Queue what is due of the truth at this tick."""
        if sim.time_us >= self.truth_streams.next_us:
            due = self.truth_streams.due(sim.time_us)
            _send_all(due, sim, self._truth, self.outgoing)

    def _send_due(self, now_us: int) -> None:
        waiting = [entry for entry in self._late if entry[0] > now_us]
        for due_us, message in self._late:
            if due_us <= now_us:
                self.send(message)
        self._late = deque(waiting)


def _send_all(
    builders: Sequence[Builder], sim: Simulation, packer: Packer, outgoing: list[bytes]
) -> None:
    """Pack what the builders have to say."""
    for builder in builders:
        message = builder(sim)
        if message is not None:
            outgoing.append(packer.pack(message))


def _published(sim: Simulation) -> Hashable:
    """Differs as soon as PX4's commander has published: twice a second, and changes at once."""
    autopilot = sim.autopilot
    beat = autopilot.heartbeat
    return sim.time_us // _STATUS_PERIOD_US, beat, autopilot.intended_custom_mode
