"""TIMESYNC and PING: whoever asks is answered with the time of the boot.

https://mavlink.io/en/services/timesync.html, https://mavlink.io/en/services/ping.html
"""

from collections.abc import Callable, Mapping

from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.wire import Message, dialect


class Clock:
    """Answers to questions about time.

    Args:
        context: of the vehicle.
        on_answer: takes the answers to the autopilot's own questions, with the link's index.
    """

    def __init__(self, context: Context, on_answer: Callable[[int, Message], None]) -> None:
        self._context = context
        self._on_answer = on_answer

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        return {"TIMESYNC": self._timesync, "PING": self._ping}

    def _timesync(self, link: int, message: Message) -> None:
        if message.tc1 == 0:
            now_ns = self._context.sim.stamp_us * 1000
            answer = dialect.MAVLink_timesync_message(now_ns, message.ts1)
            self._context.links[link].send(answer)
        else:
            self._on_answer(link, message)

    def _ping(self, link: int, message: Message) -> None:
        if message.target_system == 0 and message.target_component == 0:
            self._context.links[link].send(
                dialect.MAVLink_ping_message(
                    message.time_usec,
                    message.seq,
                    message.get_srcSystem(),
                    message.get_srcComponent(),
                )
            )
