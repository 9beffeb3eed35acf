"""The vehicle's link, shared: its frames to clients, and of theirs what the filter lets through.

Clients come last.  Frames are handed on after the flight has dealt with them and its setpoint has
left; a client that takes nothing is skipped; what clients send is bounded and filtered.
"""

from collections import deque
from collections.abc import Callable, Sequence

from companion.config.link_models import ForwardConfig
from companion.flight.shared_link.endpoints import Endpoint, datagrams_of
from companion.flight.vehicle.connection import Connection
from companion.link.clients import Client
from companion.link.link import LinkError
from companion.mavlink.client_command import read_command
from companion.mavlink.client_filter import Refusal, Situation, judge
from companion.mavlink.codec import Packer
from companion.mavlink.commands import Result
from companion.mavlink.framing import Frame
from companion.mavlink.messages import (
    COMPONENT_ONBOARD_COMPUTER,
    MessageId,
    Outgoing,
    Target,
)
from companion.mavlink.stand_in import StandIn, read_instead_of_set
from companion.mavlink.stream_requests import REQUEST_DATA_STREAM, StreamRequests
from companion.mavlink.telemetry import is_truth
from companion.mavlink.timesync import is_answer

_LATER_PER_CHORE = 2
_MOST_LATER = 200
_MOST_KINDS_TOLD = 100
_TOO_MUCH = "reads of clients who say too much"
_SECOND_COMPUTER = 192
"""MAV_COMP_ID_ONBOARD_COMPUTER2: acknowledgements to it are nobody's."""
_ACK_TARGET_AT = 9
"""Where in a COMMAND_ACK the component lies that it answers."""
_OURS_TO_CLIENTS = (MessageId.HEARTBEAT, MessageId.STATUSTEXT)


class Forwarder:
    """Passes frames between the vehicle and the clients of its endpoints."""

    def __init__(
        self,
        connection: Connection,
        endpoints: Sequence[ForwardConfig],
        tell: Callable[[str, str], None],
        pilot_flies: Callable[[], bool],
        pause: Callable[[], bool] = lambda: False,
    ) -> None:
        """Prepare; nothing is opened yet.

        Args:
            connection: with the vehicle.
            endpoints: where clients are, and what they may.
            tell: told (severity, text) what a person should know.
            pilot_flies: true once the companion has handed over.
            pause: hands over because a client wants a pause; true if there was anything to end.

        Raises:
            LinkError: an endpoint cannot be one.
        """
        self.passed = 0
        """Frames of clients that went on to the vehicle."""
        self.refused: dict[str, int] = {}
        """How often each kind of message was kept back, by its name."""
        self.endpoints = [Endpoint(config) for config in endpoints]
        self._connection = connection
        self._tell = tell
        self._pilot_flies = pilot_flies
        self._pause = pause
        self._requests = StreamRequests()
        self._later: deque[Outgoing] = deque(maxlen=_MOST_LATER)
        """Questions on behalf of clients, asked a few at a time."""
        self._second: Packer | None = None
        self._stand_in: StandIn | None = None
        self._told: set[tuple[str, str]] = set()
        for endpoint in self.endpoints:
            self._listen(endpoint)

    @property
    def unsent(self) -> int:
        """Datagrams or packets that a client did not take."""
        return sum(endpoint.unsent for endpoint in self.endpoints)

    @property
    def has_talkers(self) -> bool:
        """True if a client has said something, and is still there."""
        return any(endpoint.has_talkers for endpoint in self.endpoints)

    async def open(self) -> None:
        """Open the endpoints and begin to forward.

        Raises:
            LinkError: an endpoint cannot be opened; the others are closed again.
        """
        try:
            for endpoint in self.endpoints:
                await endpoint.clients.open()
        except LinkError:
            self.close()
            raise
        connection = self._connection
        connection.on_frames = self._on_frames
        connection.on_sent = self._on_sent
        connection.chores.append(self._chore)
        for endpoint in self.endpoints:
            self._tell("info", f"the link is shared at {endpoint.description}")
            if endpoint.config.remote:
                self._tell(
                    "warning",
                    f"{endpoint.description} is open to the network: whoever reaches it sees the "
                    "vehicle, and may end the flight",
                )

    def close(self) -> None:
        """Forward no more."""
        self._connection.on_frames = self._connection.on_sent = None
        if self._chore in self._connection.chores:
            self._connection.chores.remove(self._chore)
        for endpoint in self.endpoints:
            endpoint.clients.close()

    # --- to the clients ---

    def _on_frames(self, frames: list[Frame]) -> None:
        frames = [frame for frame in frames if not _is_answer_to_second_computer(frame)]
        plain = datagrams_of([frame.raw for frame in frames if not is_truth(frame)])
        for endpoint in self.endpoints:
            if endpoint.config.truth:
                endpoint.give(datagrams_of([frame.raw for frame in frames]))
            else:
                endpoint.give(plain)

    def _on_sent(self, message_id: int, raw: bytes) -> None:
        """What the companion itself says belongs to what a ground station should see."""
        self._requests.on_sent(message_id, raw)
        if message_id in _OURS_TO_CLIENTS:
            for endpoint in self.endpoints:
                endpoint.give([raw])

    # --- from the clients ---

    def _listen(self, endpoint: Endpoint) -> None:
        def on_data(client: Client, data: bytes, now_s: float) -> None:
            try:
                self._on_data(endpoint, client, data, now_s)
            except Exception as error:
                # A client must not end a flight, whatever it says.
                self._tell_once(endpoint, type(error).__name__, f"on what a client said: {error}")

        endpoint.clients.on_data = on_data

    def _on_data(self, endpoint: Endpoint, client: Client, data: bytes, now_s: float) -> None:
        if not endpoint.knows(client):
            self._tell_once(endpoint, f"client {client.name}", "is there", "info")
        frames = endpoint.read(client, data, now_s)
        if frames is None:
            self.refused[_TOO_MUCH] = self.refused.get(_TOO_MUCH, 0) + 1
            self._tell_once(endpoint, f"client {client.name}", "says more than is passed on")
            return
        if self._connection.peers.vehicle is None:
            return  # nobody to tell it to
        for frame in frames:
            self._pass_on(endpoint, client, frame)

    def _pass_on(self, endpoint: Endpoint, client: Client, frame: Frame) -> None:
        connection = self._connection
        us = Target(connection.our_system_id, COMPONENT_ONBOARD_COMPUTER)
        if (frame.system_id, frame.component_id) in (connection.target, us):
            why = "that is the vehicle's or the companion's own address; give the client another"
            self._refuse(endpoint, client, frame, Refusal("messages", why))
            return
        if frame.message_id == REQUEST_DATA_STREAM:
            if connection.dialect.name == "ardupilot":  # others do not heed it
                self._later.extend(self._requests.translate(frame, connection.target))
            return
        if frame.message_id == MessageId.TIMESYNC and is_answer(frame):
            return  # the companion answers, by one clock; nobody waits for anything
        command = read_command(frame)
        answer = None if command is None else self._requests.answer(command)
        if command is not None and answer is not None:
            target = command.target
            client.send(self._vehicle_says.acknowledge(frame, command.command_id, target, answer))
            return
        refusal = judge(frame, self._situation(endpoint))
        if refusal is not None and refusal.pauses and self._pause():
            self._answer(client, frame, refusal, Result.ACCEPTED)
            return
        if refusal is not None:
            self._refuse(endpoint, client, frame, refusal)
            return
        self.passed += 1
        if endpoint.config.remote:
            connection.send_raw(frame.raw)  # signed by its own sender, or not at all
        else:
            connection.send_frame(frame)
        for other in self.endpoints:
            other.give([frame.raw], but=client)

    def _situation(self, endpoint: Endpoint) -> Situation:
        connection, config = self._connection, endpoint.config
        return Situation(
            connection.target,
            connection.dialect,
            connection.reports.armed,
            self._pilot_flies(),
            config.allow_setpoints,
            config.allow_commands or endpoint.trusted,
        )

    def _refuse(self, endpoint: Endpoint, client: Client, frame: Frame, refusal: Refusal) -> None:
        """Keep a frame back: count it, say so once, and answer who waits for an answer."""
        self.refused[refusal.what] = self.refused.get(refusal.what, 0) + 1
        who = f"{refusal.what} of {frame.system_id}/{frame.component_id}"
        self._tell_once(endpoint, who, f"not passed on: {refusal.why}")
        self._answer(client, frame, refusal, refusal.result)

    def _answer(self, client: Client, frame: Frame, refusal: Refusal, result: Result) -> None:
        """Say what came of a frame that does not go on, if its sender waits for that."""
        if refusal.command_id is not None and refusal.target is not None:
            client.send(
                self._vehicle_says.acknowledge(frame, refusal.command_id, refusal.target, result)
            )
        elif frame.message_id == MessageId.PARAM_SET:
            # Its sender waits for a PARAM_VALUE: the one that stays.
            self._later.append(read_instead_of_set(frame))
        elif frame.decodable and (denial := self._vehicle_says.deny(frame)) is not None:
            client.send(denial)

    @property
    def _vehicle_says(self) -> StandIn:
        """Answers in the vehicle's place, so that no client waits and asks again."""
        if self._stand_in is None:
            self._stand_in = StandIn(self._connection.target)
        return self._stand_in

    def _chore(self, now_s: float) -> None:
        for endpoint in self.endpoints:
            endpoint.clients.tidy(now_s)
        for _ in range(min(_LATER_PER_CHORE, len(self._later))):
            if self._second is None:
                signing = self._connection.signing
                self._second = Packer(
                    self._connection.target.system_id,
                    _SECOND_COMPUTER,
                    None if signing is None else signing.signer,
                )
            self._connection.send_raw(self._second.pack(self._later.popleft()))

    def _tell_once(
        self, endpoint: Endpoint, who: str, text: str, severity: str = "warning"
    ) -> None:
        where = endpoint.description
        if (where, who + text) in self._told or len(self._told) >= _MOST_KINDS_TOLD:
            return
        self._told.add((where, who + text))
        self._tell(severity, f"{where}: {who} {text}")


def _is_answer_to_second_computer(frame: Frame) -> bool:
    """True for the acknowledgement of a question that was ours, on behalf of a client."""
    if frame.message_id != MessageId.COMMAND_ACK:
        return False
    payload = frame.payload
    return len(payload) > _ACK_TARGET_AT and payload[_ACK_TARGET_AT] == _SECOND_COMPUTER
