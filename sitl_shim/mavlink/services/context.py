"""What every microservice knows: the simulation, the links, and who it is."""

from collections.abc import Sequence
from dataclasses import dataclass

from sitl_shim.mavlink.link import AUTOPILOT_COMPONENT_ID, Link
from sitl_shim.mavlink.signing import Signing
from sitl_shim.mavlink.wire import Message
from sitl_shim.simulation import Simulation


@dataclass(frozen=True, slots=True)
class Context:
    """Shared by the services of one vehicle."""

    sim: Simulation
    links: Sequence[Link]
    system_id: int
    """MAVLink system id of the vehicle."""
    signing: Signing

    def concerns(self, message: Message, *, any_system: bool = False) -> bool:
        """Whether a message is addressed to the autopilot.

        Args:
            message: one with a target system and a target component.
            any_system: the target system 0 counts, too.
        """
        system = message.target_system
        fits = system == self.system_id or (any_system and system == 0)
        return fits and message.target_component in (0, AUTOPILOT_COMPONENT_ID)
