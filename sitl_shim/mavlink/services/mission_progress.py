"""MISSION_CURRENT and MISSION_ITEM_REACHED: how the mission gets on."""

from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.services.mission_manners import MissionManners
from sitl_shim.mavlink.services.mission_store import MissionStore
from sitl_shim.mavlink.wire import Message, dialect

_PERIOD_US = 1_000_000
_PHASE_US = 488_000
"""Into the second at which PX4 was recorded to tell the current item."""


class MissionProgress:
    """Tells all links how the mission gets on.

    Args:
        context: of the vehicle.
        store: its mission.
        manners: of its flavour.
    """

    def __init__(self, context: Context, store: MissionStore, manners: MissionManners) -> None:
        self._context = context
        self._store = store
        self._sim = context.sim
        self._manners = manners
        self._told_current = 0
        self._reached = 0
        self._repetitions = 0

    def step(self, now_us: int) -> None:
        """Send what is due at this tick."""
        plan = self._sim.autopilot.mission
        for index in plan.take_reached():
            self._reached, self._repetitions = index, self._manners.reached_repetitions
            self._tell_reached()
        if plan.current != self._told_current and self._manners.tells_current_at_once:
            self.tell_current()
        elif now_us % _PERIOD_US == _PHASE_US:
            if self._manners.streams_current:
                self.tell_current()
            if self._repetitions > 0:
                self._repetitions -= 1
                self._tell_reached()

    def tell_current(self) -> None:
        """Send MISSION_CURRENT now."""
        self._told_current = self._store.plan.current
        self._send(self._manners.mission_current(self._context.sim))

    def _tell_reached(self) -> None:
        self._send(dialect.MAVLink_mission_item_reached_message(self._reached))

    def _send(self, message: Message) -> None:
        for link in self._context.links:
            link.send(message)
