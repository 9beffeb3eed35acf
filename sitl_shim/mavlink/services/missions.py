"""The mission protocol: upload, download, clear, set current, and how a mission gets on.

https://mavlink.io/en/services/mission.html
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from sitl_shim.mavlink.services import mission_items as wire
from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.services.mission_items import WireItem
from sitl_shim.mavlink.services.mission_manners import manners_of
from sitl_shim.mavlink.services.mission_progress import MissionProgress
from sitl_shim.mavlink.services.mission_store import MissionStore
from sitl_shim.mavlink.wire import Message, dialect

_PLANNER_COMPONENT_ID = 190
"""MAV_COMP_ID_MISSIONPLANNER: autopilots take what is addressed to it for theirs."""
_UNSUPPORTED_BY_CLIENT = wire.UNSUPPORTED


class _State(Enum):
    IDLE = "idle"
    RECEIVING = "receiving"
    SENDING = "sending"


@dataclass(slots=True)
class _Transfer:
    """What goes on, on one link."""

    state: _State = _State.IDLE
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


class Missions:
    """The mission protocol on all links.

    Args:
        context: of the vehicle.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self._manners = manners_of(context.personality.name)
        self._store = MissionStore(
            context.sim, self._manners.capacity, home_first=self._manners.home_first
        )
        self._progress = MissionProgress(context, self._store, self._manners)
        self._transfers = [_Transfer() for _ in context.links]

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        readers: dict[str, Callable[[int, _Transfer, Message], None]] = {
            "MISSION_COUNT": self._count,
            "MISSION_ITEM": self._item,
            "MISSION_ITEM_INT": self._item,
            "MISSION_REQUEST_LIST": self._request_list,
            "MISSION_REQUEST": self._request,
            "MISSION_REQUEST_INT": self._request,
            "MISSION_ACK": self._acknowledged,
            "MISSION_SET_CURRENT": self._set_current,
            "MISSION_CLEAR_ALL": self._clear_all,
        }
        return {name: self._addressed(reader) for name, reader in readers.items()}

    def step(self, now_us: int) -> None:
        """Ask again for what does not come, give up, tell how the mission gets on."""
        manners = self._manners
        for link, transfer in enumerate(self._transfers):
            if transfer.state is _State.IDLE:
                continue
            if now_us - transfer.received_us > manners.timeout_us:
                self._say(link, manners.timeout_text)
                if manners.timeout_result is not None and transfer.state is _State.RECEIVING:
                    self._acknowledge(link, transfer, manners.timeout_result)
                self._finish(transfer)
            elif (
                transfer.state is _State.RECEIVING and now_us - transfer.sent_us > manners.retry_us
            ):
                self._ask(link, transfer)
        self._progress.step(now_us)

    # --- upload ---

    def _count(self, link: int, transfer: _Transfer, message: Message) -> None:
        sender = _sender(message)
        if transfer.state is _State.SENDING and not self._manners.any_order:
            self._reply(link, sender, message.mission_type, wire.ERROR)
            return
        if transfer.state is _State.RECEIVING:
            if sender != transfer.partner:
                self._reply(link, sender, message.mission_type, wire.DENIED)
                return
            if transfer.sequence > 0 and not self._manners.any_order:
                self._say(link, "WPM: REJ. CMD: Busy")
                self._acknowledge(link, transfer, wire.ERROR)
                return
        elif self._busy_elsewhere(transfer):
            self._reply(link, sender, message.mission_type, wire.ERROR)
            return
        if message.count > self._store.capacity(message.mission_type):
            self._reply(link, sender, message.mission_type, self._manners.too_many_result)
            return
        if message.count == 0:
            self._store.clear(message.mission_type)
            self._reply(link, sender, message.mission_type, wire.ACCEPTED)
            return
        self._begin(transfer, _State.RECEIVING, message, message.count)
        self._ask(link, transfer)

    def _item(self, link: int, transfer: _Transfer, message: Message) -> None:
        sender = _sender(message)
        if transfer.state is not _State.RECEIVING:
            repeated = transfer.partner == sender and transfer.sequence == message.seq + 1
            if transfer.state is _State.IDLE and repeated and self._manners.forgives_repetition:
                self._acknowledge(link, transfer, wire.ACCEPTED)
                return
            busy = transfer.state is _State.SENDING
            self._say(link, f"IGN MISSION_ITEM: {'Busy' if busy else 'No transfer'}")
            self._reply(link, sender, message.mission_type, wire.ERROR)
            return
        if sender != transfer.partner:
            self._reply(link, sender, message.mission_type, wire.DENIED)
            return
        if message.mission_type != transfer.mission_type:
            self._acknowledge(link, transfer, wire.ERROR)
            return
        transfer.received_us = self._context.sim.time_us
        if message.seq != transfer.sequence:
            if self._manners.unexpected_item_result is not None:
                self._acknowledge(link, transfer, self._manners.unexpected_item_result)
            return
        item = wire.read_item(message)
        if isinstance(item, int):
            self._say(link, "IGN MISSION_ITEM: Invalid item")
            self._acknowledge(link, transfer, item)
            self._finish(transfer)
            return
        if message.current:
            transfer.current = message.seq
        transfer.items.append(item)
        transfer.sequence += 1
        if transfer.sequence < transfer.count:
            self._ask(link, transfer)
            return
        self._store.replace(transfer.mission_type, transfer.items, transfer.current)
        self._finish(transfer)
        self._acknowledge(link, transfer, wire.ACCEPTED)

    # --- download ---

    def _request_list(self, link: int, transfer: _Transfer, message: Message) -> None:
        sending = transfer.state is _State.SENDING and (
            transfer.mission_type == message.mission_type
            or transfer.sequence >= transfer.count
            or self._manners.any_order
        )
        if not (transfer.state is _State.IDLE or sending):
            if self._manners.any_order:
                self._reply(link, _sender(message), message.mission_type, wire.DENIED)
            self._say(link, "Mission download request ignored, already active")
            return
        count = len(self._store.items(message.mission_type))
        if not self._manners.any_order:
            self._begin(transfer, _State.SENDING, message, count)
        answer = dialect.MAVLink_mission_count_message(
            *_sender(message), count, message.mission_type
        )
        self._context.links[link].send(answer)

    def _request(self, link: int, transfer: _Transfer, message: Message) -> None:
        as_int = message.get_type() == "MISSION_REQUEST_INT"
        transfer.as_int = as_int
        sender = _sender(message)
        if self._manners.any_order:
            if transfer.state is _State.RECEIVING:
                self._reply(link, sender, message.mission_type, wire.DENIED)
            elif message.seq >= len(self._store.items(message.mission_type)):
                self._reply(link, sender, message.mission_type, wire.INVALID_SEQUENCE)
            else:
                self._send_item(link, sender, message.mission_type, message.seq, as_int=as_int)
            return
        if transfer.state is _State.IDLE:
            return
        if transfer.state is _State.RECEIVING:
            self._say(link, "WPM: REJ. CMD: Busy")
            self._acknowledge(link, transfer, wire.DENIED)
            return
        if sender != transfer.partner:
            self._reply(link, sender, message.mission_type, wire.DENIED)
            return
        if message.mission_type != transfer.mission_type:
            self._acknowledge(link, transfer, wire.ERROR)
            return
        transfer.received_us = self._context.sim.time_us
        in_turn = message.seq in (transfer.sequence, transfer.sequence - 1)
        if not in_turn or message.seq >= len(self._store.items(transfer.mission_type)):
            self._finish(transfer)
            self._acknowledge(link, transfer, wire.ERROR)
            self._say(link, "WPM: REJ. CMD: Req. WP was unexpected")
            return
        transfer.sequence = message.seq + 1
        self._send_item(link, sender, transfer.mission_type, message.seq, as_int=as_int)

    def _acknowledged(self, link: int, transfer: _Transfer, message: Message) -> None:
        if transfer.state is _State.IDLE:
            return
        if _sender(message) != transfer.partner:
            self._say(link, "REJ. WP CMD: partner id mismatch")
            return
        if message.type == wire.CANCELLED:
            self._finish(transfer)
        elif transfer.state is _State.RECEIVING:
            if message.type == _UNSUPPORTED_BY_CLIENT:  # try the other kind of message
                transfer.as_int = not transfer.as_int
                self._ask(link, transfer)
        elif message.mission_type == transfer.mission_type and message.type == wire.ACCEPTED:
            if transfer.sequence < transfer.count:
                self._say(link, "WPM: ERR: not all items sent -> IDLE")
            self._finish(transfer)

    # --- the rest ---

    def _set_current(self, link: int, transfer: _Transfer, message: Message) -> None:
        if transfer.state is _State.RECEIVING:
            self._say(link, "WPM: IGN WP CURR CMD: Busy")
        elif not self._store.plan.set_current(message.seq):
            self._say(link, "WPM: WP CURR CMD: Not in list")
        elif self._manners.tells_current_at_once:
            self._progress.tell_current()

    def _clear_all(self, link: int, transfer: _Transfer, message: Message) -> None:
        if transfer.state is not _State.IDLE:
            self._say(link, "WPM: IGN CLEAR CMD: Busy")
            return
        known = self._store.clear(message.mission_type)
        result = wire.ACCEPTED if known else wire.ERROR
        self._reply(link, _sender(message), message.mission_type, result)

    # --- parts ---

    def _addressed(
        self, reader: Callable[[int, _Transfer, Message], None]
    ) -> Callable[[int, Message], None]:
        """The same reader, for what is addressed to the autopilot only."""

        def read(link: int, message: Message) -> None:
            to_planner = message.target_component == _PLANNER_COMPONENT_ID
            own = message.target_system == self._context.system_id
            if (own and to_planner) or self._context.concerns(message):
                reader(link, self._transfers[link], message)

        return read

    def _begin(self, transfer: _Transfer, state: _State, message: Message, count: int) -> None:
        transfer.state = state
        transfer.mission_type = message.mission_type
        transfer.partner = _sender(message)
        transfer.count = count
        transfer.sequence = transfer.current = 0
        transfer.items = []
        transfer.received_us = self._context.sim.time_us

    @staticmethod
    def _finish(transfer: _Transfer) -> None:
        transfer.state = _State.IDLE
        transfer.items = []

    def _busy_elsewhere(self, transfer: _Transfer) -> bool:
        """Whether another link is uploading."""
        return any(
            each is not transfer and each.state is _State.RECEIVING for each in self._transfers
        )

    def _ask(self, link: int, transfer: _Transfer) -> None:
        make = (
            dialect.MAVLink_mission_request_int_message
            if transfer.as_int
            else dialect.MAVLink_mission_request_message
        )
        transfer.sent_us = self._context.sim.time_us
        message = make(*transfer.partner, transfer.sequence, transfer.mission_type)
        self._context.links[link].send(message)

    def _send_item(
        self, link: int, target: tuple[int, int], mission_type: int, seq: int, *, as_int: bool
    ) -> None:
        self._context.links[link].send(
            wire.item_message(
                self._store.items(mission_type)[seq],
                seq,
                mission_type,
                target,
                current=mission_type == wire.MISSION and seq == self._store.plan.current,
                as_int=as_int,
            )
        )

    def _acknowledge(self, link: int, transfer: _Transfer, result: int) -> None:
        self._reply(link, transfer.partner, transfer.mission_type, result)

    def _reply(self, link: int, target: tuple[int, int], mission_type: int, result: int) -> None:
        answer = dialect.MAVLink_mission_ack_message(*target, result, mission_type)
        self._context.links[link].send(answer)

    def _say(self, link: int, text: str) -> None:
        self._context.say(link, self._manners.severity, text + self._manners.text_end)


def _sender(message: Message) -> tuple[int, int]:
    return (message.get_srcSystem(), message.get_srcComponent())
