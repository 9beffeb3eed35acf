"""The three lists that the mission protocol carries: mission, fence, rally points.

The mission's list becomes the autopilot's plan; fence and rally points are kept for whoever asks
for them again.
"""

from collections.abc import Sequence

from sitl_shim.autopilot.mission_plan import NOTHING, WAYPOINT, MissionPlan, PlanItem
from sitl_shim.frames import Vector3
from sitl_shim.mavlink.geodesy import global_position
from sitl_shim.mavlink.services.mission_items import (
    ALL,
    FENCE,
    MISSION,
    RALLY,
    WireItem,
    plan_item,
)
from sitl_shim.simulation import Simulation

_GLOBAL_INT = 5
_PASSED_OVER = PlanItem(NOTHING, (0.0, 0.0, 0.0, 0.0))


class MissionStore:
    """Items by type.

    Args:
        sim: of the vehicle.
        capacity: items that each type may have.
        home_first: the mission's item 0 is home, whatever is written to it.
    """

    def __init__(
        self, sim: Simulation, capacity: tuple[int, int, int], *, home_first: bool
    ) -> None:
        self._sim = sim
        self._capacity = capacity
        self._home_first = home_first
        self._lists: dict[int, tuple[WireItem, ...]] = {MISSION: (), FENCE: (), RALLY: ()}

    @property
    def plan(self) -> MissionPlan:
        """The autopilot's mission."""
        return self._sim.autopilot.mission

    def capacity(self, mission_type: int) -> int:
        """Items that a list of this type may have; 0 for an unknown type."""
        if mission_type not in self._lists:
            return 0
        return self._capacity[mission_type]

    def items(self, mission_type: int) -> tuple[WireItem, ...]:
        """The list as it is downloaded; empty for an unknown type."""
        items = self._lists.get(mission_type, ())
        if mission_type == MISSION and self._home_first:
            return (self._home(), *items[1:])
        return items

    def replace(self, mission_type: int, items: Sequence[WireItem], current: int = 0) -> None:
        """Take a list in place of the old one.

        Args:
            mission_type: which list.
            items: in their order.
            current: where a mission begins.
        """
        self._lists[mission_type] = tuple(items)
        if mission_type != MISSION:
            return
        plan = [plan_item(item, self._sim.origin) for item in items]
        if self._home_first and plan:
            plan[0] = _PASSED_OVER
        self.plan.replace(plan if len(plan) > self._home_first else (), current)

    def clear(self, mission_type: int) -> bool:
        """Forget a list, or all of them; False if there is no such type."""
        if mission_type != ALL and mission_type not in self._lists:
            return False
        for each in self._lists:
            if mission_type in (each, ALL):
                self.replace(each, ())
        return True

    def _home(self) -> WireItem:
        home: Vector3 = self._sim.autopilot.home_enu_m or (0.0, 0.0, 0.0)
        latitude, longitude, altitude_mm = global_position(self._sim.origin, home)
        nothing = (0.0, 0.0, 0.0, 0.0)
        return WireItem(_GLOBAL_INT, WAYPOINT, 1, nothing, latitude, longitude, altitude_mm / 1e3)
