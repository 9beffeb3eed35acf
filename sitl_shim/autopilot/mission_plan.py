"""The mission that an autopilot holds: its items, where it has got to, what was reached.

The plan knows no wire format and no flavour.  It carries out the items that fly nothing (speed,
jump) by itself and hands out the legs that are to be flown; the flavour's flight code flies them
and says when each is done.  https://mavlink.io/en/services/mission.html
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

WAYPOINT, LOITER_UNLIMITED, LOITER_TIME, RETURN, LAND, TAKEOFF = 16, 17, 19, 20, 21, 22
LOITER_TO_ALTITUDE, DELAY, DO_JUMP, DO_CHANGE_SPEED = 31, 93, 177, 178
"""MAV_CMD of the items that mean something here; others are passed over."""

NOTHING = 0
"""An item that is none: home, where a mission begins with it."""

FLOWN = frozenset(
    {
        WAYPOINT,
        LOITER_UNLIMITED,
        LOITER_TIME,
        RETURN,
        LAND,
        TAKEOFF,
        LOITER_TO_ALTITUDE,
        DELAY,
    }
)
"""Items that take time."""
_UNTOLD_REACHED = 256
"""So many items may wait to be told as reached; the oldest are forgotten."""


class MissionState(IntEnum):
    """Values of MAVLink's MISSION_STATE."""

    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5


@dataclass(frozen=True, slots=True)
class PlanItem:
    """One item, in the local frame."""

    command: int
    """MAV_CMD."""
    parameters: tuple[float, float, float, float]
    """param1 to param4."""
    position_xy_m: tuple[float, float] | None = None
    """East and north; None where the item has no place, or leaves it to the vehicle."""
    altitude_m: float = math.nan
    """Up; NaN where the item leaves it to the vehicle."""
    above_home: bool = True
    """Whether the altitude counts from home; else from the local frame's origin."""

    def z_m(self, home_z_m: float) -> float:
        """The altitude in the local frame, NaN if there is none.

        Args:
            home_z_m: height of home in the local frame.
        """
        return self.altitude_m + home_z_m if self.above_home else self.altitude_m


@dataclass(frozen=True, slots=True)
class Leg:
    """An item that is to be flown now."""

    index: int
    item: PlanItem


class MissionPlan:
    """Items and progress of one mission.

    Args:
        tells_commands: whether items that fly nothing count as reached, too.
    """

    def __init__(self, *, tells_commands: bool = True) -> None:
        self.items: tuple[PlanItem, ...] = ()
        self.current = 0
        """Index of the item that is being flown, or will be."""
        self.revision = 0
        """Grows with every change of the items or of the current one from outside."""
        self.speed_m_s: float | None = None
        """Horizontal speed that an item asked for; None for the autopilot's own."""
        self.complete = False
        self._tells_commands = tells_commands
        self._begun = False
        self._flying = False
        self._jumps: dict[int, int] = {}
        self._reached: list[int] = []

    def __len__(self) -> int:
        return len(self.items)

    @property
    def state(self) -> MissionState:
        """Where the mission is, for MISSION_CURRENT."""
        if not self.items:
            return MissionState.NO_MISSION
        if self.complete:
            return MissionState.COMPLETE
        if self._flying:
            return MissionState.ACTIVE
        return MissionState.PAUSED if self._begun else MissionState.NOT_STARTED

    @property
    def begins_with_takeoff(self) -> bool:
        """Whether the first item to be flown, from the current one on, is a take-off."""
        flown = (item for item in self.items[self.current :] if item.command in FLOWN)
        first = next(flown, None)
        return first is not None and first.command == TAKEOFF

    # --- from the ground ---

    def replace(self, items: Sequence[PlanItem], current: int = 0) -> None:
        """Take a new mission in place of the old one.

        Args:
            items: in their order; none clears the mission.
            current: where to begin.
        """
        self.items = tuple(items)
        self._reached = []
        self._begin_at(current if 0 <= current < len(self.items) else 0)

    def set_current(self, index: int) -> bool:
        """Go on from an item; False if there is none of this index."""
        if not 0 <= index < len(self.items):
            return False
        self._begin_at(index)
        return True

    def change_speed(self, speed_m_s: float | None) -> None:
        """Fly on at another speed; None for the autopilot's own."""
        self.speed_m_s = speed_m_s

    def _begin_at(self, index: int) -> None:
        self.current = index
        self.complete = False
        self.speed_m_s = None
        self._begun = False
        self._jumps = {}
        self.revision += 1

    # --- from the flight ---

    def resume(self) -> Leg | None:
        """Begin or go on, from the current item; None if there is nothing left to fly.

        A mission that was complete begins again.
        """
        if self.complete:
            self._begin_at(0)
        self._begun = self._flying = True
        return self._settle()

    def suspend(self) -> None:
        """The mission is no longer being flown."""
        self._flying = False

    def leg_done(self) -> Leg | None:
        """The current item was flown: go on to the next; None at the end."""
        self._note_reached(self.current)
        self.current += 1
        return self._settle()

    def take_reached(self) -> list[int]:
        """Indices of the items reached since the last call."""
        reached = self._reached
        if reached:
            self._reached = []
        return reached

    def _note_reached(self, index: int) -> None:
        self._reached = [*self._reached, index][-_UNTOLD_REACHED:]

    def _settle(self) -> Leg | None:
        """Carry out items from the current one on until one is to be flown."""
        # A mission may consist of jumps alone: nobody may wait for its end.
        for _ in range(2 * len(self.items) + 1):
            if self.current >= len(self.items):
                break
            index, item = self.current, self.items[self.current]
            if item.command in FLOWN:
                return Leg(index, item)
            if self._tells_commands and item.command != NOTHING:
                self._note_reached(index)
            self.current = self._after(index, item)
        self.complete = bool(self.items)
        self._flying = False
        self.current = max(0, len(self.items) - 1)
        return None

    def _after(self, index: int, item: PlanItem) -> int:
        if item.command == DO_CHANGE_SPEED:
            self._change_speed(item)
        elif item.command == DO_JUMP:
            target = self._jump_target(index, item)
            if target is not None:
                return target
        return index + 1

    def _change_speed(self, item: PlanItem) -> None:
        speed = item.parameters[1]
        if math.isfinite(speed) and speed > 0.0:
            self.speed_m_s = speed
        elif speed == 0.0:
            self.speed_m_s = None

    def _jump_target(self, index: int, item: PlanItem) -> int | None:
        """Where a jump leads; None when its repetitions are used up, or it leads nowhere."""
        target, repetitions = item.parameters[0], item.parameters[1]
        if not (math.isfinite(target) and math.isfinite(repetitions)):
            return None
        if not 0 <= target < len(self.items):
            return None
        done = self._jumps.get(index, 0)
        if 0 <= repetitions <= done:
            return None
        self._jumps[index] = done + 1
        return int(target)
