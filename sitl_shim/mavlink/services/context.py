"""What every microservice knows: the simulation, the links, and who it is."""

from collections.abc import Sequence
from dataclasses import dataclass

from sitl_shim.autopilot.interface import StatusText
from sitl_shim.mavlink.link import AUTOPILOT_COMPONENT_ID, Link
from sitl_shim.mavlink.personality import Personality
from sitl_shim.mavlink.signing import Signing
from sitl_shim.mavlink.statustext import status_messages
from sitl_shim.mavlink.wire import Message
from sitl_shim.simulation import Simulation

NEVER_US = 2**62
"""What a microservice says that has nothing to do until a message comes."""


@dataclass(frozen=True, slots=True)
class Context:
    """Shared by the services of one vehicle."""

    sim: Simulation
    links: Sequence[Link]
    system_id: int
    """MAVLink system id of the vehicle."""
    signing: Signing

    @property
    def personality(self) -> Personality:
        """Manners of the flavour."""
        return self.links[0].personality

    def say(self, link: int, severity: int, text: str) -> None:
        """Send a text of at most 50 bytes on one link, if it carries texts."""
        if self.links[link].carries_texts(self.sim.time_us):
            for message in status_messages(StatusText(severity, text), 0):
                self.links[link].send(message)

    def concerns(self, message: Message, *, any_system: bool = False) -> bool:
        """Whether a message is addressed to the autopilot.

        Args:
            message: one with a target system and a target component.
            any_system: the target system 0 counts, too.
        """
        system = message.target_system
        fits = system == self.system_id or (any_system and system == 0)
        return fits and message.target_component in (0, AUTOPILOT_COMPONENT_ID)
