"""What a link does to packets: all faults of a flight, on all of its links, both ways.

Pure: it is told bytes and times, and says what arrives when. The same therefore happens on a
virtual clock and over sockets.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from math import inf
from typing import Literal, NamedTuple

from sitl_shim.faults.link_stage import Due, LinkStage
from sitl_shim.faults.schema import Faults
from sitl_shim.wind.events import Moments

Way = Literal["telemetry", "setpoints"]
Babble = Callable[[Way], Sequence[bytes]]
"""Gives the packets that a direction's babble consists of."""

_WAY_NUMBERS: dict[Way, int] = {"telemetry": 0, "setpoints": 1}


class Arrival(NamedTuple):
    """Bytes at the end of their way."""

    due_s: float
    """Simulated time since boot."""
    link: int
    data: bytes


class _OnItsWay(NamedTuple):
    """A datagram before one of the stages, or behind all of them; earlier ones sort first."""

    time_s: float
    order: int
    """Of entry: what comes to be due at the same time stays in this order."""
    stage: int
    babble: bool
    data: bytes


class LinkChannel:
    """One direction of one link: its faults, one after another.

    Args:
        stages: in the order in which a datagram meets them.
    """

    __slots__ = ("_now_s", "_order", "_stages", "_waiting")

    def __init__(self, stages: Sequence[LinkStage]) -> None:
        self._stages = tuple(stages)
        self._waiting: list[_OnItsWay] = []
        self._order = 0
        self._now_s = 0.0

    def send(self, time_s: float, data: bytes) -> None:
        """Take a datagram that is sent at a time."""
        self._enter(time_s, 0, data)

    def pass_by(self, time_s: float, data: bytes) -> None:
        """Take one that no fault acts on: it arrives when it is sent."""
        self._enter(time_s, len(self._stages), data)

    @property
    def next_s(self) -> float:
        """When something happens next; infinite if nothing will, as far as is known."""
        first_s = self._waiting[0].time_s if self._waiting else inf
        return min(first_s, *(stage.next_babble_s for stage in self._stages))

    def arrived(self, time_s: float) -> list[Due]:
        """What has arrived up to a time and was not yet taken, in order of arrival.

        Args:
            time_s: simulated time since boot; must not decrease.
        """
        stages, waiting = self._stages, self._waiting
        for number, stage in enumerate(stages):
            for due_s, data in stage.babble(time_s):
                # Never into the past, should setpoints have begun since the last look.
                self._enter(max(due_s, self._now_s), number, data, babble=True)
        self._now_s = max(self._now_s, time_s)
        found: list[Due] = []
        while waiting and waiting[0].time_s <= time_s:
            now_s, order, number, babble, data = heappop(waiting)
            if number == len(stages):
                found.append((now_s, data))
                continue
            stage = stages[number]
            going = stage.take_babble(now_s, data) if babble else stage.take(now_s, data)
            for due_s, going_data in going:
                heappush(waiting, _OnItsWay(due_s, order, number + 1, False, going_data))
        return found

    def _enter(self, time_s: float, stage: int, data: bytes, *, babble: bool = False) -> None:
        self._order += 1
        heappush(self._waiting, _OnItsWay(time_s, self._order, stage, babble, data))


class LinkWay:
    """One direction of all links.

    Args:
        channels: one for each link.
    """

    __slots__ = ("_channels",)

    def __init__(self, channels: Sequence[LinkChannel]) -> None:
        self._channels = tuple(channels)

    def send(self, link: int, data: bytes, time_s: float) -> None:
        """Take a datagram that is sent at a simulated time since boot."""
        self._channels[link].send(time_s, data)

    def pass_by(self, link: int, data: bytes, time_s: float) -> None:
        """Take one that no fault acts on."""
        self._channels[link].pass_by(time_s, data)

    @property
    def next_s(self) -> float:
        """When something happens next; infinite if nothing will, as far as is known."""
        return min((channel.next_s for channel in self._channels), default=inf)

    def arrived(self, time_s: float) -> list[Arrival]:
        """What has arrived up to a time and was not yet taken, in order of arrival.

        Args:
            time_s: simulated time since boot; must not decrease.
        """
        found = [
            Arrival(due_s, link, data)
            for link, channel in enumerate(self._channels)
            for due_s, data in channel.arrived(time_s)
        ]
        if len(self._channels) > 1:
            found.sort(key=lambda arrival: arrival.due_s)
        return found


@dataclass(frozen=True, slots=True)
class LinkFaults:
    """Both directions; None where no fault acts."""

    telemetry: LinkWay | None = None
    setpoints: LinkWay | None = None


def link_faults(
    faults: Faults, moments: Moments, *, seed: int, links: int, babble: Babble
) -> LinkFaults:
    """The faults of a flight's links.

    Args:
        faults: what goes wrong.
        moments: what the times count from; looked at whenever something passes.
        seed: of the flight; each fault draws by itself, on each link and in each direction.
        links: how many there are.
        babble: gives the packets to babble with.
    """

    def way(name: Way) -> LinkWay | None:
        acting = [
            (index, fault) for index, fault in enumerate(faults.link) if fault.way in (name, "both")
        ]
        if not acting:
            return None
        packets = babble(name)
        return LinkWay(
            [
                LinkChannel(
                    [
                        LinkStage(fault, moments, seed, (index, _WAY_NUMBERS[name], link), packets)
                        for index, fault in acting
                    ]
                )
                for link in range(links)
            ]
        )

    return LinkFaults(way("telemetry"), way("setpoints"))
