"""The mission protocol on all links: download, clear, set current, time-outs; uploads are apart.

https://mavlink.io/en/services/mission.html
"""

from collections.abc import Callable, Mapping

from sitl_shim.mavlink.services import mission_items as wire
from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.services.mission_manners import manners_of
from sitl_shim.mavlink.services.mission_progress import MissionProgress
from sitl_shim.mavlink.services.mission_store import MissionStore
from sitl_shim.mavlink.services.mission_transfer import Answers, State, Transfer, sender_of
from sitl_shim.mavlink.services.mission_upload import MissionUpload
from sitl_shim.mavlink.wire import Message

_PLANNER_COMPONENT_ID = 190
"""MAV_COMP_ID_MISSIONPLANNER: autopilots take what is addressed to it for theirs."""
# Looked at in every tick: in Python 3.11 a member costs eight times as much by its class.
_IDLE = State.IDLE

_Reader = Callable[[int, Transfer, Message], None]


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
        self._transfers = [Transfer() for _ in context.links]
        self._answers = Answers(context, self._store, self._manners)
        self._upload = MissionUpload(
            context, self._store, self._manners, self._answers, self._transfers
        )

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        request = self._request_any if self._manners.any_order else self._request_in_turn
        readers: dict[str, _Reader] = {
            "MISSION_COUNT": self._upload.count,
            "MISSION_ITEM": self._upload.item,
            "MISSION_ITEM_INT": self._upload.item,
            "MISSION_REQUEST_LIST": self._request_list,
            "MISSION_REQUEST": request,
            "MISSION_REQUEST_INT": request,
            "MISSION_ACK": self._acknowledged,
            "MISSION_SET_CURRENT": self._set_current,
            "MISSION_CLEAR_ALL": self._clear_all,
        }
        return {name: self._addressed(reader) for name, reader in readers.items()}

    def step(self, now_us: int) -> int:
        """Ask again for what does not come, give up, tell how the mission gets on.

        Returns:
            0: it looks at every tick how the autopilot gets on.
        """
        for link, transfer in enumerate(self._transfers):
            if transfer.state is not _IDLE:
                self._watch(link, transfer, now_us)
        self._progress.step(now_us)
        return 0

    def _watch(self, link: int, transfer: Transfer, now_us: int) -> None:
        manners, receiving = self._manners, transfer.state is State.RECEIVING
        if now_us - transfer.received_us > manners.timeout_us:
            self._answers.say(link, manners.timeout_text)
            if manners.timeout_result is not None and receiving:
                self._answers.acknowledge(link, transfer, manners.timeout_result)
            transfer.finish()
        elif receiving and now_us - transfer.sent_us > manners.retry_us:
            self._answers.ask(link, transfer)

    # --- download ---

    def _request_list(self, link: int, transfer: Transfer, message: Message) -> None:
        may_begin_again = transfer.state is State.SENDING and (
            transfer.mission_type == message.mission_type or transfer.sequence >= transfer.count
        )
        if transfer.state is not State.IDLE and not may_begin_again:
            if self._manners.any_order:
                self._answers.reply(link, message, wire.DENIED)
            self._answers.say(link, "Mission download request ignored, already active")
            return
        count = len(self._store.items(message.mission_type))
        if not self._manners.any_order:
            transfer.begin(State.SENDING, message, count, self._context.sim.time_us)
        self._answers.send_count(link, message, count)

    def _request_any(self, link: int, transfer: Transfer, message: Message) -> None:
        """An item is asked for, whichever."""
        self._note_kind(transfer, message)
        if transfer.state is State.RECEIVING:
            self._answers.reply(link, message, wire.DENIED)
        elif message.seq >= len(self._store.items(message.mission_type)):
            self._answers.reply(link, message, wire.INVALID_SEQUENCE)
        else:
            self._answers.send_item(link, message)

    def _request_in_turn(self, link: int, transfer: Transfer, message: Message) -> None:
        """An item is asked for: it must be the next of a download, or the last one again."""
        answers = self._answers
        self._note_kind(transfer, message)
        if transfer.state is State.IDLE:
            return
        if transfer.state is State.RECEIVING:
            answers.say(link, "WPM: REJ. CMD: Busy")
            answers.acknowledge(link, transfer, wire.DENIED)
        elif sender_of(message) != transfer.partner:
            answers.reply(link, message, wire.DENIED)
        elif message.mission_type != transfer.mission_type:
            answers.acknowledge(link, transfer, wire.ERROR)
        else:
            transfer.received_us = self._context.sim.time_us
            in_turn = message.seq in (transfer.sequence, transfer.sequence - 1)
            if in_turn and message.seq < len(self._store.items(transfer.mission_type)):
                transfer.sequence = message.seq + 1
                answers.send_item(link, message)
                return
            transfer.finish()
            answers.acknowledge(link, transfer, wire.ERROR)
            answers.say(link, "WPM: REJ. CMD: Req. WP was unexpected")

    def _acknowledged(self, link: int, transfer: Transfer, message: Message) -> None:
        if transfer.state is State.IDLE:
            return
        if sender_of(message) != transfer.partner:
            self._answers.say(link, "REJ. WP CMD: partner id mismatch")
            return
        if message.type == wire.CANCELLED:
            transfer.finish()
        elif transfer.state is State.RECEIVING:
            if message.type == wire.UNSUPPORTED:  # the client knows the other kind of message only
                transfer.as_int = not transfer.as_int
                self._answers.ask(link, transfer)
        elif message.mission_type == transfer.mission_type and message.type == wire.ACCEPTED:
            if transfer.sequence < transfer.count:
                self._answers.say(link, "WPM: ERR: not all items sent -> IDLE")
            transfer.finish()

    # --- the rest ---

    def _set_current(self, link: int, transfer: Transfer, message: Message) -> None:
        if transfer.state is State.RECEIVING:
            self._answers.say(link, "WPM: IGN WP CURR CMD: Busy")
        elif not self._store.plan.set_current(message.seq):
            self._answers.say(link, "WPM: WP CURR CMD: Not in list")
        elif self._manners.tells_current_at_once:
            self._progress.tell_current()

    def _clear_all(self, link: int, transfer: Transfer, message: Message) -> None:
        if transfer.state is not State.IDLE:
            self._answers.say(link, "WPM: IGN CLEAR CMD: Busy")
            return
        known = self._store.clear(message.mission_type)
        self._answers.reply(link, message, wire.ACCEPTED if known else wire.ERROR)

    @staticmethod
    def _note_kind(transfer: Transfer, message: Message) -> None:
        """Remember which kind of message the client speaks."""
        transfer.as_int = message.get_type() == "MISSION_REQUEST_INT"

    def _addressed(self, reader: _Reader) -> Callable[[int, Message], None]:
        """The same reader, for what is addressed to the autopilot only."""

        def read(link: int, message: Message) -> None:
            to_planner = message.target_component == _PLANNER_COMPONENT_ID
            own = message.target_system == self._context.system_id
            if (own and to_planner) or self._context.concerns(message):
                reader(link, self._transfers[link], message)

        return read
