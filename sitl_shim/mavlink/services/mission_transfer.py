"""What goes on on one link under the mission protocol, and how the other side is answered."""

from dataclasses import dataclass, field
from enum import Enum

from sitl_shim.mavlink.services import mission_items as wire
from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.services.mission_items import WireItem
from sitl_shim.mavlink.services.mission_manners import MissionManners
from sitl_shim.mavlink.services.mission_store import MissionStore
from sitl_shim.mavlink.wire import Message, dialect


class State(Enum):
    """Of a transfer."""

    IDLE = "idle"
    RECEIVING = "receiving"
    SENDING = "sending"


@dataclass(slots=True)
class Transfer:
    """What goes on, on one link."""

    state: State = State.IDLE
    mission_type: int = wire.MISSION
    partner: tuple[int, int] = (0, 0)
    count: int = 0
    sequence: int = 0
    """Of the item that is expected or asked for next."""
    items: list[WireItem] = field(default_factory=list)
    current: int = 0
    as_int: bool = True
    """Which kind of message the partner speaks: it is asked in its own."""
    sent_us: int = 0
    received_us: int = 0

    def begin(self, state: State, message: Message, count: int, now_us: int) -> None:
        """Begin, with whoever sent the message."""
        self.state = state
        self.mission_type = message.mission_type
        self.partner = sender_of(message)
        self.count = count
        self.sequence = self.current = 0
        self.items = []
        self.received_us = now_us

    def finish(self) -> None:
        """The transfer is over."""
        self.state = State.IDLE
        self.items = []


class Answers:
    """Messages to the other side.

    Args:
        context: of the vehicle.
        store: the lists.
        manners: of the flavour.
    """

    def __init__(self, context: Context, store: MissionStore, manners: MissionManners) -> None:
        self._context = context
        self._store = store
        self._manners = manners

    def ask(self, link: int, transfer: Transfer) -> None:
        """Ask for the item that is next, in the partner's kind of message."""
        make = (
            dialect.MAVLink_mission_request_int_message
            if transfer.as_int
            else dialect.MAVLink_mission_request_message
        )
        transfer.sent_us = self._context.sim.time_us
        message = make(*transfer.partner, transfer.sequence, transfer.mission_type)
        self._context.links[link].send(message)

    def send_count(self, link: int, request: Message, count: int) -> None:
        """MISSION_COUNT to whoever asked for a list."""
        target = sender_of(request)
        answer = dialect.MAVLink_mission_count_message(*target, count, request.mission_type)
        self._context.links[link].send(answer)

    def send_item(self, link: int, request: Message) -> None:
        """The item that was asked for, in the kind of message that was asked for."""
        seq, mission_type = request.seq, request.mission_type
        self._context.links[link].send(
            wire.item_message(
                self._store.items(mission_type)[seq],
                seq,
                mission_type,
                sender_of(request),
                current=mission_type == wire.MISSION and seq == self._store.plan.current,
                as_int=request.get_type() == "MISSION_REQUEST_INT",
            )
        )

    def acknowledge(self, link: int, transfer: Transfer, result: int) -> None:
        """MISSION_ACK to the partner of a transfer."""
        self._send(link, transfer.partner, transfer.mission_type, result)

    def reply(self, link: int, message: Message, result: int) -> None:
        """MISSION_ACK to whoever sent a message."""
        self._send(link, sender_of(message), message.mission_type, result)

    def say(self, link: int, text: str) -> None:
        """A text in the flavour's tone."""
        self._context.say(link, self._manners.severity, text + self._manners.text_end)

    def _send(self, link: int, target: tuple[int, int], mission_type: int, result: int) -> None:
        answer = dialect.MAVLink_mission_ack_message(*target, result, mission_type)
        self._context.links[link].send(answer)


def sender_of(message: Message) -> tuple[int, int]:
    """System and component that sent a message."""
    return (message.get_srcSystem(), message.get_srcComponent())
