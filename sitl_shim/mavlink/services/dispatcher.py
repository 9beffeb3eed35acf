"""Leads each message that comes in to the microservice that reads it."""

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

from sitl_shim.mavlink.services.clock import Clock
from sitl_shim.mavlink.services.context import NEVER_US, Context
from sitl_shim.mavlink.services.events import Events
from sitl_shim.mavlink.services.external_pose import ExternalPoses
from sitl_shim.mavlink.services.file_tree import FileTree
from sitl_shim.mavlink.services.files import Files
from sitl_shim.mavlink.services.flight_logs import FlightLogs
from sitl_shim.mavlink.services.logs import Logs
from sitl_shim.mavlink.services.missions import Missions
from sitl_shim.mavlink.services.parameter_file import NAME as PARAMETER_FILE
from sitl_shim.mavlink.services.parameter_file import packed_parameters
from sitl_shim.mavlink.services.parameters import Parameters
from sitl_shim.mavlink.services.setpoints import PositionSetpoints
from sitl_shim.mavlink.services.signing_setup import SigningSetup
from sitl_shim.mavlink.wire import Message

Handler = Callable[[int, Message], None]
"""Takes the index of the link that a message came by, and the message."""


class Service(Protocol):
    """One microservice, on all links of the vehicle."""

    @property
    def handlers(self) -> Mapping[str, Handler]:
        """What it reads, by the name of the message."""


@runtime_checkable
class Sender(Protocol):
    """A microservice that sends of its own accord."""

    def step(self, now_us: int) -> int:
        """Send what is due at this tick.

        Called first when the links are up, and after each message that came in.

        Returns:
            The boot time (µs) at which it wants to be called again, if no message comes before:
            a past one (0) for the next tick.
        """


class Services:
    """All microservices of one vehicle.

    Args:
        context: of the vehicle.
    """

    def __init__(self, context: Context) -> None:
        poses = ExternalPoses(context)
        logs = FlightLogs(context.sim, context.personality.name)
        services: tuple[Service, ...] = (
            Clock(context, on_answer=poses.timesync_answer),
            poses,
            Parameters(context),
            Missions(context),
            Files(context, _tree(context, logs)),
            Logs(context, logs),
            Events(context),
            PositionSetpoints(context),
            SigningSetup(context),
        )
        self._handlers: dict[str, Handler] = {}
        for service in services:
            self._handlers.update(service.handlers)
        self._senders = tuple(service for service in services if isinstance(service, Sender))
        self._awake = self._senders
        """Those that want to be called at the next tick; order counts, as they send in it."""
        self._wake_us = 0
        """When all are called."""

    def handle(self, link: int, message: Message) -> bool:
        """Lead a message to its service; False if there is none for it."""
        handler = self._handlers.get(message.get_type())
        if handler is None:
            return False
        handler(link, message)
        self._wake_us = 0
        return True

    def step(self, now_us: int) -> None:
        """Let every service send what is due at this tick."""
        if now_us < self._wake_us:
            for sender in self._awake:
                sender.step(now_us)
            return
        wanted = [(sender.step(now_us), sender) for sender in self._senders]
        self._awake = tuple(sender for time_us, sender in wanted if time_us <= now_us)
        self._wake_us = min(
            (time_us for time_us, _ in wanted if time_us > now_us), default=NEVER_US
        )


def _tree(context: Context, logs: FlightLogs) -> FileTree:
    """The files of the flavour: PX4 has no parameter file."""
    special = {}
    if context.personality.parameter_file:
        store = context.sim.autopilot.parameters
        special[PARAMETER_FILE] = lambda query: packed_parameters(store, query)
    return FileTree(special, logs.files)
