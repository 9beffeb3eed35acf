"""A MAVLink client of the shim for tests, on simulated time: no loop, no sockets."""

import heapq
import math
from collections.abc import Callable, Sequence
from typing import Any

from sitl_shim.mavlink.endpoint import Shim
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Packer, Parser, dialect
from sitl_shim.simulation import ShimOptions

AUTO_LOITER, AUTO_LAND, AUTO_TAKEOFF = 0x03040000, 0x06040000, 0x02040000
AUTO_RTL, POSCTL, ALTCTL, OFFBOARD = 0x05040000, 0x00030000, 0x00020000, 0x00060000
SET_MODE, ARM, TAKEOFF, LAND, RETURN = 176, 400, 22, 21, 20
NAN = math.nan

Received = tuple[float, Any]
"""Time of arrival (simulated s) and message."""


def _sender_and_id(name: str, component: int) -> bytes:
    message_id: int = getattr(dialect, f"MAVLINK_MSG_ID_{name}")
    return bytes([component]) + message_id.to_bytes(3, "little")


class ShimClient:
    """Drives one shim tick by tick; keeps everything that arrives on each link."""

    def __init__(
        self,
        options: ShimOptions,
        links: Sequence[LinkKind] = (LinkKind.ONBOARD,),
        *,
        component: int = 191,
    ) -> None:
        self.shim = Shim(options, links)
        self._frames: list[list[tuple[float, bytes]]] = [[] for _ in links]
        self._parser = Parser()
        self._packers = [Packer(1, component) for _ in links]
        self._flying: list[tuple[float, int, int, bytes]] = []
        self._count = 0
        self._repeats: list[list[Any]] = []

    @property
    def time_s(self) -> float:
        return self.shim.time_s

    @property
    def simulation(self) -> Any:
        return self.shim.simulation

    # --- sending ---

    def send(self, message: Any, link: int = 0) -> None:
        self.send_bytes(self._packers[link].pack(message), link)

    def send_bytes(self, data: bytes, link: int = 0) -> None:
        self.shim.receive(link, data, self.time_s)

    def command(self, number: int, *parameters: float, target: tuple[int, int] = (1, 1)) -> None:
        filled = [*parameters, *([0.0] * (7 - len(parameters)))]
        self.send(dialect.MAVLink_command_long_message(*target, number, 0, *filled))

    def take_off(self) -> None:
        self.command(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, NAN)

    def set_mode(self, custom_mode: int) -> None:
        self.command(SET_MODE, 1, (custom_mode >> 16) & 0xFF, custom_mode >> 24)

    def set_interval(self, message_id: int, interval_us: float) -> None:
        self.command(511, message_id, interval_us)

    def setpoint(
        self,
        q: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
        thrust: float = 0.5,
        *,
        mask: int = 7,
        rates: tuple[float, float, float] = (0.0, 0.0, 0.0),
        target: tuple[int, int] = (1, 1),
    ) -> None:
        self.send(
            dialect.MAVLink_set_attitude_target_message(
                round(self.time_s * 1000), *target, mask, list(q), *rates, thrust
            )
        )

    def heartbeat(self, kind: int = 18, link: int = 0) -> None:
        self.send(dialect.MAVLink_heartbeat_message(kind, 8, 0, 0, 4, 3), link)

    def every(self, period_s: float, action: Callable[[], None]) -> Callable[[], None]:
        """Repeat an action from now on; returns what stops it."""
        entry = [self.time_s, period_s, action]
        self._repeats.append(entry)

        def stop() -> None:
            self._repeats.remove(entry)

        return stop

    # --- time ---

    def run(self, duration_s: float) -> None:
        self.run_until(self.time_s + duration_s)

    def run_until(self, time_s: float) -> None:
        while self.time_s < time_s - 1e-9:
            for entry in list(self._repeats):
                if entry[0] <= self.time_s + 1e-9:
                    entry[0] += entry[1]
                    entry[2]()
            for datagram in self.shim.step():
                self._count += 1
                heapq.heappush(
                    self._flying, (datagram.due_s, self._count, datagram.link, datagram.data)
                )
            while self._flying and self._flying[0][0] <= self.time_s + 1e-9:
                due_s, _, link, data = heapq.heappop(self._flying)
                self._frames[link].append((due_s, data))

    def wait_for(self, condition: Callable[[], bool], within_s: float) -> float:
        """Run until a condition holds; returns the time."""
        end_s = self.time_s + within_s
        while not condition():
            assert self.time_s < end_s, f"waited {within_s} s in vain"
            self.run(0.004)
        return self.time_s

    # --- what arrived ---

    def inbox(self, link: int = 0) -> list[Received]:
        """Everything, decoded."""
        return [
            (time_s, message)
            for time_s, data in self._frames[link]
            for message in self._parser.parse(data)
        ]

    def frames(self, link: int = 0) -> list[bytes]:
        """Everything, as it came."""
        return [data for _, data in self._frames[link]]

    def received(self, name: str, *, component: int = 1, link: int = 0) -> list[Received]:
        head = _sender_and_id(name, component)
        return [
            (time_s, message)
            for time_s, data in self._frames[link]
            if data[6:10] == head  # one message per datagram: only what is wanted is decoded
            for message in self._parser.parse(data)
        ]

    def messages(self, name: str, *, component: int = 1, link: int = 0) -> list[Any]:
        return [message for _, message in self.received(name, component=component, link=link)]

    def last(self, name: str, *, component: int = 1, link: int = 0) -> Any:
        head = _sender_and_id(name, component)
        for _, data in reversed(self._frames[link]):
            if data[6:10] == head:
                return next(self._parser.parse(data))
        raise AssertionError(f"no {name} arrived")

    def acks(self, command: int) -> list[int]:
        return [m.result for m in self.messages("COMMAND_ACK") if m.command == command]

    def texts(self, link: int = 0) -> list[str]:
        return [m.text for m in self.messages("STATUSTEXT", link=link)]

    def forget(self) -> None:
        for frames in self._frames:
            frames.clear()

    # --- phases ---

    def boot(self) -> None:
        """Until the vehicle can be armed."""
        self.run_until(5.0)

    def start_stream(
        self, q: Sequence[float] = (1.0, 0.0, 0.0, 0.0), thrust: float = 0.49, hz: float = 50.0
    ) -> Callable[[], None]:
        return self.every(1.0 / hz, lambda: self.setpoint(q, thrust))

    def attitude(self) -> tuple[float, float, float, float]:
        """Reported attitude now, FRD to NED."""
        message = self.last("ATTITUDE_QUATERNION")
        return (message.q1, message.q2, message.q3, message.q4)


def airborne(vehicle: str = "bebop2", *, seed: int = 1, **options: Any) -> ShimClient:
    """A client of a vehicle that already holds 30 m above the origin."""
    client = ShimClient(
        ShimOptions(vehicle=vehicle, seed=seed, airborne_at_enu_m=(0.0, 0.0, 30.0), **options)
    )
    client.run(1.0)
    return client
