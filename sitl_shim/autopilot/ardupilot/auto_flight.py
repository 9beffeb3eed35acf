"""AUTO: flies the mission's legs.

https://ardupilot.org/copter/docs/auto-mode.html, https://ardupilot.org/copter/docs/mission-command-list.html
"""

import math
from collections.abc import Callable

from sitl_shim.autopilot import mission_plan as items
from sitl_shim.autopilot.ardupilot.cascade import Cascade
from sitl_shim.autopilot.ardupilot.landing import ReturnFlight, land
from sitl_shim.autopilot.ardupilot.takeoff import Takeoff
from sitl_shim.autopilot.interface import Motion
from sitl_shim.autopilot.mission_plan import Leg, MissionPlan
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Vector3

_TURNS_WHEN_FARTHER_M = 2.0
"""The nose is turned to where it goes, if that is not near."""
_NAMES = {
    items.WAYPOINT: "WP",
    items.LOITER_UNLIMITED: "LoitUnlim",
    items.LOITER_TIME: "LoitTime",
    items.RETURN: "RTL",
    items.LAND: "Land",
    items.TAKEOFF: "Takeoff",
    items.LOITER_TO_ALTITUDE: "LoitAltitude",
    items.DELAY: "Delay",
}


class AutoFlight:
    """AUTO, over all its stays.

    Args:
        parameters: radii, speeds.
        plan: the mission.
        cascade: what carries it out.
        takeoff: the take-off, shared with the other modes.
        say: takes informative texts.
    """

    __slots__ = (
        "_arrived_s",
        "_cascade",
        "_descending",
        "_goal",
        "_home",
        "_leg",
        "_parameters",
        "_plan",
        "_return",
        "_revision",
        "_say",
        "_takeoff",
        "started",
    )

    def __init__(
        self,
        parameters: ParameterStore,
        plan: MissionPlan,
        cascade: Cascade,
        takeoff: Takeoff,
        say: Callable[[str], None],
    ) -> None:
        self._parameters = parameters
        self._plan = plan
        self._cascade = cascade
        self._takeoff = takeoff
        self._say = say
        self._leg: Leg | None = None
        self._revision = -1
        self._goal: Vector3 = (0.0, 0.0, 0.0)
        self._home: Vector3 = (0.0, 0.0, 0.0)
        self._arrived_s: float | None = None
        self._descending = False
        self._return: ReturnFlight | None = None
        self.started = False
        """Whether it may leave the ground: after MISSION_START, for there is no throttle stick."""

    @property
    def landing(self) -> bool:
        """Whether it is on its way down to the ground."""
        return self._descending or (self._return is not None and self._return.landing)

    def enter(self) -> None:
        """AUTO begins, or goes on."""
        self._revision = -1

    def leave(self) -> None:
        """Another mode flies."""
        self._plan.suspend()
        self._return = None
        self._descending = False

    def step(self, motion: Motion, home_enu_m: Vector3, armed_for_us: int) -> None:
        """One period of 4 ms."""
        self._home = home_enu_m
        landed = self._cascade.detector.landed
        if landed and not self.started:
            self._cascade.stand(motion)
            return
        if self._revision != self._plan.revision:
            self._begin(self._plan.resume(), motion)
        leg = self._leg
        if leg is None:
            self._hold(motion)
        elif leg.item.command == items.TAKEOFF:
            goal_m = leg.item.z_m(home_enu_m[2])
            goal_m = goal_m if math.isfinite(goal_m) else motion.position_enu_m[2]
            if self._takeoff.step(motion, goal_m, armed_for_us):
                self._next(motion)
        elif landed:
            self._cascade.stand(motion)
            self.started = False
            if self.landing:
                self._next(motion)
        else:
            self._fly(leg, motion)

    # --- legs ---

    def _begin(self, leg: Leg | None, motion: Motion) -> None:
        self._revision = self._plan.revision
        self._leg = leg
        self._arrived_s = None
        self._descending = False
        self._return = None
        self._takeoff.reset()
        if leg is None:
            return
        item = leg.item
        self._say(f"Mission: {leg.index} {_NAMES[item.command]}")
        speed = self._plan.speed_m_s or self._parameters["WPNAV_SPEED"] * 0.01
        cascade = self._cascade
        cascade.position.set_limits(speed, self._parameters["WPNAV_ACCEL"] * 0.01)
        if item.command == items.RETURN:
            self._return = ReturnFlight(self._parameters, cascade, motion, self._home)
            return
        x, y, z = motion.position_enu_m
        if item.position_xy_m is not None and item.command != items.DELAY:
            x, y = item.position_xy_m
        wanted = item.z_m(self._home[2])
        keeps_height = item.command in (items.LAND, items.DELAY) or not math.isfinite(wanted)
        self._goal = (x, y, z if keeps_height else wanted)
        if item.command != items.TAKEOFF:
            self._point_nose(motion)

    def _point_nose(self, motion: Motion) -> None:
        x, y, _ = motion.position_enu_m
        dx, dy = self._goal[0] - x, self._goal[1] - y
        if math.hypot(dx, dy) > _TURNS_WHEN_FARTHER_M:
            self._cascade.heading = math.atan2(dy, dx)

    def _next(self, motion: Motion) -> None:
        leg = self._leg
        if leg is not None and leg.item.command == items.WAYPOINT:
            self._say(f"Reached command #{leg.index}")
        self._begin(self._plan.leg_done(), motion)

    def _fly(self, leg: Leg, motion: Motion) -> None:
        if self._return is not None:
            self._return.step(motion)
            return
        if self._descending:
            home_z_m = self._home[2]
            land(self._parameters, self._cascade, motion, home_z_m, position_known=True)
            return
        x, y, z = self._goal
        self._cascade.follow_position(motion, (x, y))
        self._cascade.approach_height(motion, z)
        if self._arrived_s is None:
            if math.dist(motion.position_enu_m, self._goal) > self._radius_m(leg):
                return
            self._arrived_s = motion.time_s
        if leg.item.command == items.LAND:
            self._descending = True
        elif motion.time_s - self._arrived_s >= _hold_s(leg):
            self._next(motion)

    def _radius_m(self, leg: Leg) -> float:
        own = leg.item.parameters[1]
        if leg.item.command == items.WAYPOINT and math.isfinite(own) and own > 0.0:
            return own
        return self._parameters["WPNAV_RADIUS"] * 0.01

    def _hold(self, motion: Motion) -> None:
        """The mission is over, or gone."""
        if self._cascade.detector.landed:
            self._cascade.stand(motion)
            return
        self._cascade.stop(motion)
        self._cascade.climb(motion, 0.0)


def _hold_s(leg: Leg) -> float:
    if leg.item.command == items.LOITER_UNLIMITED:
        return math.inf
    if leg.item.command not in (items.WAYPOINT, items.LOITER_TIME, items.DELAY):
        return 0.0
    seconds = leg.item.parameters[0]
    return seconds if math.isfinite(seconds) else 0.0
