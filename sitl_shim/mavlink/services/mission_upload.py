"""Missions that come in: MISSION_COUNT, then the items, asked for one by one."""

from collections.abc import Sequence

from sitl_shim.mavlink.services import mission_items as wire
from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.services.mission_manners import MissionManners
from sitl_shim.mavlink.services.mission_store import MissionStore
from sitl_shim.mavlink.services.mission_transfer import Answers, State, Transfer, sender_of
from sitl_shim.mavlink.wire import Message


class MissionUpload:
    """Takes lists.

    Args:
        context: of the vehicle.
        store: where they go.
        manners: of the flavour.
        answers: to the other side.
        transfers: of all links: only one may upload at a time.
    """

    def __init__(
        self,
        context: Context,
        store: MissionStore,
        manners: MissionManners,
        answers: Answers,
        transfers: Sequence[Transfer],
    ) -> None:
        self._context = context
        self._store = store
        self._manners = manners
        self._answers = answers
        self._transfers = transfers

    def count(self, link: int, transfer: Transfer, message: Message) -> None:
        """MISSION_COUNT: a list is on its way."""
        refusal = self._refusal_of_count(link, transfer, message)
        if refusal is not None:
            self._answers.reply(link, message, refusal)
        elif message.count == 0:
            self._store.clear(message.mission_type)
            self._answers.reply(link, message, wire.ACCEPTED)
        else:
            now_us = self._context.sim.time_us
            transfer.begin(State.RECEIVING, message, message.count, now_us)
            self._answers.ask(link, transfer)

    def _refusal_of_count(self, link: int, transfer: Transfer, message: Message) -> int | None:
        """MAV_MISSION_RESULT with which a list is refused before it comes; None if it is not."""
        if transfer.state is State.SENDING and not self._manners.any_order:
            return wire.ERROR
        if transfer.state is State.RECEIVING:
            if sender_of(message) != transfer.partner:
                return wire.DENIED
            if transfer.sequence > 0 and not self._manners.any_order:
                self._answers.say(link, "WPM: REJ. CMD: Busy")
                return wire.ERROR
        elif self._busy_elsewhere(transfer):
            return wire.ERROR
        if message.count > self._store.capacity(message.mission_type):
            return self._manners.too_many_result
        return None

    def item(self, link: int, transfer: Transfer, message: Message) -> None:
        """MISSION_ITEM or MISSION_ITEM_INT: one item."""
        answers = self._answers
        if transfer.state is not State.RECEIVING:
            self._item_without_transfer(link, transfer, message)
            return
        if sender_of(message) != transfer.partner:
            answers.reply(link, message, wire.DENIED)
            return
        if message.mission_type != transfer.mission_type:
            answers.acknowledge(link, transfer, wire.ERROR)
            return
        transfer.received_us = self._context.sim.time_us
        if message.seq != transfer.sequence:
            if self._manners.unexpected_item_result is not None:
                answers.acknowledge(link, transfer, self._manners.unexpected_item_result)
            return
        item = wire.read_item(message)
        if isinstance(item, int):
            answers.say(link, "IGN MISSION_ITEM: Invalid item")
            answers.acknowledge(link, transfer, item)
            transfer.finish()
            return
        if message.current:
            transfer.current = message.seq
        transfer.items.append(item)
        transfer.sequence += 1
        if transfer.sequence < transfer.count:
            answers.ask(link, transfer)
            return
        self._store.replace(transfer.mission_type, transfer.items, transfer.current)
        transfer.finish()
        answers.acknowledge(link, transfer, wire.ACCEPTED)

    def _item_without_transfer(self, link: int, transfer: Transfer, message: Message) -> None:
        again = transfer.partner == sender_of(message) and transfer.sequence == message.seq + 1
        if transfer.state is State.IDLE and again and self._manners.forgives_repetition:
            self._answers.acknowledge(link, transfer, wire.ACCEPTED)
            return
        busy = transfer.state is State.SENDING
        self._answers.say(link, f"IGN MISSION_ITEM: {'Busy' if busy else 'No transfer'}")
        self._answers.reply(link, message, wire.ERROR)

    def _busy_elsewhere(self, transfer: Transfer) -> bool:
        """Whether another link is uploading."""
        return any(
            each is not transfer and each.state is State.RECEIVING for each in self._transfers
        )
