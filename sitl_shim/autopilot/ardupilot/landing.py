"""LAND and RTL: down to the ground, here or at home."""

import math
from enum import IntEnum

from sitl_shim.autopilot.ardupilot.cascade import Cascade
from sitl_shim.autopilot.ardupilot.laws import sqrt_controller
from sitl_shim.autopilot.interface import TICK_S, Motion
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Vector3


def land(
    parameters: ParameterStore,
    cascade: Cascade,
    motion: Motion,
    home_z_m: float,
    *,
    position_known: bool,
    waits: bool = False,
) -> None:
    """One period of landing: in place, or level where there is no position.

    Args:
        parameters: speeds and heights.
        cascade: what carries it out.
        motion: the estimate.
        home_z_m: height of home in the local frame.
        position_known: whether the vehicle can stay in place.
        waits: keep the height for now.
    """
    if cascade.detector.landed:
        cascade.stand(motion)
        return
    if position_known:
        cascade.stop(motion)
    else:
        cascade.level(motion)
    if waits:
        cascade.climb(motion, 0.0)
        return
    height_m = motion.position_enu_m[2] - home_z_m
    low_m = max(1.0, parameters["LAND_ALT_LOW"] * 0.01)
    slow = parameters["LAND_SPEED"] * 0.01
    fast = parameters["LAND_SPEED_HIGH"] * 0.01 or cascade.altitude.speed_down
    gain = parameters["PSC_D_POS_P"]
    sinking = sqrt_controller(height_m - low_m, gain, cascade.altitude.acceleration_max)
    cascade.climb(motion, -max(slow, min(fast, sinking)))


class _Stage(IntEnum):
    CLIMB = 0
    GO_HOME = 1
    WAIT = 2
    DESCEND = 3


class ReturnFlight:
    """One return to home.

    Args:
        parameters: altitudes and times.
        cascade: what carries it out.
        motion: the estimate at entry.
        home_enu_m: where to return to.
    """

    __slots__ = ("_cascade", "_goal", "_home", "_parameters", "_stage", "_waited_s")

    def __init__(
        self, parameters: ParameterStore, cascade: Cascade, motion: Motion, home_enu_m: Vector3
    ) -> None:
        self._parameters = parameters
        self._cascade = cascade
        self._home = home_enu_m
        x, y, z = motion.position_enu_m
        self._goal = (x, y, max(z, home_enu_m[2] + parameters["RTL_ALT"] * 0.01))
        self._stage = _Stage.CLIMB
        self._waited_s = 0.0

    @property
    def landing(self) -> bool:
        """Whether it is on its way down to the ground."""
        return self._stage is _Stage.DESCEND and self._parameters["RTL_ALT_FINAL"] == 0.0

    def step(self, motion: Motion) -> None:
        """One period of 4 ms."""
        self._advance(motion)
        if self._cascade.detector.landed:
            self._cascade.stand(motion)
            return
        if self.landing:
            land(self._parameters, self._cascade, motion, self._home[2], position_known=True)
            return
        x, y, z = self._goal
        if self._stage is _Stage.DESCEND:
            z = self._home[2] + self._parameters["RTL_ALT_FINAL"] * 0.01
        self._cascade.follow_position(motion, (x, y))
        self._cascade.approach_height(motion, z)

    def _advance(self, motion: Motion) -> None:
        x, y, z = motion.position_enu_m
        radius_m = self._parameters["WPNAV_RADIUS"] * 0.01
        goal_x, goal_y, goal_z = self._goal
        if self._stage is _Stage.CLIMB and abs(z - goal_z) < radius_m:
            self._goal = (self._home[0], self._home[1], goal_z)
            self._stage = _Stage.GO_HOME
        elif self._stage is _Stage.GO_HOME and math.hypot(x - goal_x, y - goal_y) < radius_m:
            self._stage = _Stage.WAIT
        elif self._stage is _Stage.WAIT:
            self._waited_s += TICK_S
            if self._waited_s >= self._parameters["RTL_LOIT_TIME"] * 0.001:
                self._stage = _Stage.DESCEND
