"""Where clients share the vehicle's link: their bytes as frames, bounded, and frames as bytes."""

from dataclasses import dataclass, field

from companion.config.link_models import ForwardConfig
from companion.link.clients import Client, Clients
from companion.link.link import LinkError
from companion.link.make import make_clients
from companion.link.url import parse_link_url
from companion.mavlink.framing import Frame, Framer

_LARGEST_DATAGRAM = 1400
_LARGEST_READ = 4096
_BYTES_PER_S = 10_000.0
"""Of one client to the vehicle: the setpoints need the link."""
_BURST_BYTES = 10_000.0


@dataclass(slots=True)
class _Talker:
    """What is kept of one client."""

    refilled_s: float
    framer: Framer = field(default_factory=Framer)
    allowance_bytes: float = _BURST_BYTES

    def may_send(self, size: int, now_s: float) -> bool:
        """Take as many bytes from its allowance, if it has them."""
        earned = (now_s - self.refilled_s) * _BYTES_PER_S
        self.allowance_bytes = min(_BURST_BYTES, self.allowance_bytes + earned)
        self.refilled_s = now_s
        if size > self.allowance_bytes:
            return False
        self.allowance_bytes -= size
        return True


class Endpoint:
    """The clients at one address, and what they may."""

    def __init__(self, config: ForwardConfig) -> None:
        """Prepare; nothing is opened yet.

        Raises:
            LinkError: it cannot be one, or is open to a network without saying so.
        """
        self.config = config
        self.clients = _clients_of(config)
        self.trusted = False
        """For now its commands pass, whatever the configuration says."""
        self.unsent = 0
        """Datagrams or packets that a client did not take."""
        self._talkers: dict[Client, _Talker] = {}
        self.clients.on_gone = self._forget

    @property
    def description(self) -> str:
        """Where it is, for a person."""
        return self.clients.description

    @property
    def local_port(self) -> int:
        """The port that it is bound to, once it is open."""
        assert self.clients.local is not None
        return self.clients.local[1]

    @property
    def has_talkers(self) -> bool:
        """True if a client has said something, and is still there."""
        return bool(self._talkers)

    def knows(self, client: Client) -> bool:
        """True if the client has spoken before."""
        return client in self._talkers

    def give(self, datagrams: list[bytes], but: Client | None = None) -> None:
        """Send to all clients, except one; what one does not take is dropped."""
        for client in self.clients.present():
            if client is but:
                continue
            for datagram in datagrams:
                if not client.send(datagram):
                    self.unsent += 1

    def read(self, client: Client, data: bytes, now_s: float) -> list[Frame] | None:
        """Frames in what a client says; None if that is more than it may say.

        It is not even looked at then: looking takes the time that the controller needs.
        """
        talker = self._talkers.get(client)
        if talker is None:
            talker = self._talkers[client] = _Talker(now_s)
        if len(data) > _LARGEST_READ or not talker.may_send(len(data), now_s):
            return None
        frames = talker.framer.feed(data)
        if self.clients.datagrams:
            frames += talker.framer.finish()
        return frames

    def _forget(self, client: Client) -> None:
        self._talkers.pop(client, None)


def datagrams_of(raws: list[bytes]) -> list[bytes]:
    """Packets, put together where several came at once."""
    if len(raws) <= 1:
        return raws
    together: list[bytes] = []
    for raw in raws:
        if together and len(together[-1]) + len(raw) <= _LARGEST_DATAGRAM:
            together[-1] += raw
        else:
            together.append(raw)
    return together


def _clients_of(config: ForwardConfig) -> Clients:
    url = parse_link_url(config.url)
    if not url.is_local and not config.remote:
        raise LinkError(
            f"The endpoint {url} is not this computer's loopback: whoever reaches it sees the "
            "vehicle, and may end the flight. If that is meant, say so: add `remote: true` to it "
            "in link.forward."
        )
    return make_clients(url, _holds_a_frame)


def _holds_a_frame(data: bytes) -> bool:
    framer = Framer()
    return bool(framer.feed(data) + framer.finish())
