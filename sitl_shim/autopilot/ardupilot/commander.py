"""Arming and modes of one vehicle, and what commands do to these."""

import math
from typing import NamedTuple

from sitl_shim.autopilot.ardupilot import arming
from sitl_shim.autopilot.ardupilot.boot import (
    AHRS_HEALTHY_S,
    GYROS_CONSISTENT_S,
    READY_S,
    SWITCHES_READ_S,
    Boot,
)
from sitl_shim.autopilot.ardupilot.ground_station import GroundStationWatch
from sitl_shim.autopilot.ardupilot.modes import Mode, mode_name, mode_of
from sitl_shim.autopilot.interface import (
    Acknowledgement,
    Announcement,
    Command,
    SensorHealth,
    StatusText,
)
from sitl_shim.autopilot.mission_plan import MissionPlan
from sitl_shim.autopilot.parameters import ParameterStore

ACCEPTED, DENIED, FAILED = 0, 2, 4
CMD_RETURN, CMD_LAND, CMD_SET_MODE, CMD_ARM = 20, 21, 176, 400
_FORCE = (2989.0, 21196.0)
_CHECK_PERIOD_US = 1_000_000
_CHECK_PHASE_US = 448_000
"""The checks before arming run once a second; the bit in SYS_STATUS is as old as that."""
_COMPLAINS_EVERY_US = 30_000_000
_CRITICAL, _WARNING, _INFO = 2, 4, 6
_CUSTOM_MODE_ENABLED = 1


class Situation(NamedTuple):
    """What the commander needs to know of the flight."""

    landed: bool
    idle: bool
    """The motors are not beyond idle."""
    position_controlled: bool
    altitude_controlled: bool


class Commander:
    """Arming, modes and the ground station's failsafe; the others are `Guards`.

    Args:
        parameters: of the autopilot.
        boot: the timeline of this boot.
        plan: the mission, which AUTO needs.
        airborne: begin armed, in GUIDED.
    """

    def __init__(
        self, parameters: ParameterStore, boot: Boot, plan: MissionPlan, *, airborne: bool
    ) -> None:
        self._parameters = parameters
        self._plan = plan
        self._boot = boot
        self._texts: list[StatusText] = []
        self._announcements: list[Announcement] = []
        self._time_us = 0
        self._situation = Situation(not airborne, not airborne, airborne, airborne)
        self._idle_since_us = 0
        self._attempted = airborne
        self._switch_read = airborne
        self._checks_pass = airborne
        self._complained_us = 0
        self._station = GroundStationWatch(parameters)
        self._has_flown = airborne
        self._lane = 0
        self.failsafe = False
        """Whether the estimator or the battery gives cause for one."""
        self.mode = Mode.GUIDED if airborne else Mode.STABILIZE
        self.armed = airborne
        self.armed_us = 0
        self._situation_mode = self.mode
        """In which the controllers were when they told of their situation."""

    # --- state for others ---

    @property
    def ready(self) -> bool:
        """Whether booting is over."""
        return self._boot.passed(self._time_us, READY_S)

    @property
    def base_shows_position(self) -> bool:
        """Whether base_mode has the bit of a controlled position."""
        if not self._boot.passed(self._time_us, SWITCHES_READ_S):
            return True
        if self.mode is not self._situation_mode:  # the controllers follow at the next step
            return self.mode.needs_position or self.mode is Mode.LAND
        return self._situation.position_controlled

    @property
    def system_status(self) -> int:
        """MAV_STATE: 1 booting, 3 on the ground, 4 flying, 5 failsafe."""
        if not self.ready:
            return 1
        if (self._station.lost or self.failsafe) and self.armed:
            return 5
        return 3 if self._situation.landed else 4

    @property
    def sensor_health(self) -> SensorHealth:
        """The bit sets of SYS_STATUS."""
        return arming.sensor_health(
            self._boot.estimator,
            ahrs_healthy=self._boot.passed(self._time_us, AHRS_HEALTHY_S),
            checks_pass=self._checks_pass or self.armed,
            logging=self._attempted,
            xy_controlled=self._situation.position_controlled,
            z_controlled=self._situation.altitude_controlled,
        )

    def take_texts(self) -> list[StatusText]:
        """Texts since the last call."""
        texts, self._texts = self._texts, []
        return texts

    def take_announcements(self) -> list[Announcement]:
        """Announcements since the last call."""
        announcements, self._announcements = self._announcements, []
        return announcements

    def say(self, severity: int, text: str) -> None:
        """Queue a text."""
        self._texts.append(StatusText(severity, text))

    def inform(self, text: str) -> None:
        """Queue an informative text."""
        self.say(_INFO, text)

    # --- the run of time ---

    def step(self, time_us: int, situation: Situation) -> None:
        """One period of 4 ms."""
        self._time_us = time_us
        self._situation = situation
        self._situation_mode = self.mode
        if not self._switch_read and self.ready:
            self._switch_read = True  # whatever was asked for before is overwritten
            self._change(Mode.STABILIZE)
        texts, announcements = self._boot.step(time_us)
        if texts:
            self._texts += texts
        if announcements:
            self._announcements += announcements
        if time_us % _CHECK_PERIOD_US == _CHECK_PHASE_US:
            self._check()
        if not (situation.idle and situation.landed and self.armed):
            self._idle_since_us = time_us
        else:
            delay_s = self._parameters["DISARM_DELAY"]
            done = self.mode is Mode.AUTO and self._plan.complete
            landed_in_land = (done or self.mode in (Mode.LAND, Mode.RTL)) and self._has_flown
            if landed_in_land or 0.0 < delay_s * 1e6 <= time_us - self._idle_since_us:
                self.disarm()
        if not situation.landed:
            self._has_flown = True
        if self._station.falls_silent(time_us):
            self._leave_station()

    def lose_position(self, lost: bool) -> None:
        """The estimator has no position any more, or again."""
        self._texts += self._boot.lose_position(lost)

    def change_lane(self) -> None:
        """Another of the estimator's lanes leads."""
        self._lane = 1 - self._lane
        self.say(_CRITICAL, f"EKF3 lane switch {self._lane}")
        self.say(_WARNING, f"EKF primary changed:{self._lane}")

    def align_yaw(self) -> None:
        """The estimator aligns its heading in flight."""
        self._texts += self._boot.align_yaw()

    def _check(self) -> None:
        if self.armed or not self.ready:
            return
        reasons = self._refusals(forced=False)
        self._checks_pass = not reasons
        if reasons and self._time_us - self._complained_us >= _COMPLAINS_EVERY_US:
            self._complained_us = self._time_us
            for reason in reasons:
                self.say(_CRITICAL, f"PreArm: {reason}")

    def _refusals(self, *, forced: bool) -> list[str]:
        return arming.refusals(
            self.mode,
            self._boot.estimator,
            ready=self.ready,
            gyros_consistent=self._boot.passed(self._time_us, GYROS_CONSISTENT_S),
            forced=forced,
        )

    def heard_ground_station(self) -> None:
        """A heartbeat of the ground station came in."""
        if self._station.hear(self._time_us):
            self.say(_WARNING, "GCS Failsafe Cleared")

    def _leave_station(self) -> None:
        """The ground station is lost: do what FS_GCS_ENABLE says."""
        self.say(_WARNING, "GCS Failsafe")
        if not self.armed or self.mode in (Mode.STABILIZE, Mode.ALT_HOLD, Mode.LAND):
            return
        if self._situation.landed:
            self.disarm()
            return
        for mode in self._station.modes():
            if self.set_mode(mode) == ACCEPTED:
                return

    # --- modes ---

    def set_mode(self, mode: Mode) -> int:
        """Change the mode; disarmed, any mode may be chosen.  MAV_RESULT."""
        if self.armed and mode.needs_position and not self._boot.estimator.position_known:
            self.say(_WARNING, f"Mode change to {mode_name(mode)} failed: requires position")
            return FAILED
        if mode is Mode.AUTO and not self._may_fly_mission():
            return FAILED
        self._change(mode)
        return ACCEPTED

    def _may_fly_mission(self) -> bool:
        """Whether there is a mission, and a take-off where one is needed; says why not."""
        reason = ""
        if not self._plan.items:
            reason = "init failed"
        elif self.armed and self._situation.landed and not self._plan.begins_with_takeoff:
            reason = "Missing Takeoff Cmd"
        if reason:
            self.say(_WARNING, f"Mode change to AUTO failed: {reason}")
        return not reason

    def _change(self, mode: Mode) -> None:
        if mode is not self.mode:
            self.mode = mode
            self._announcements.append(Announcement.HEARTBEAT)

    # --- commands ---

    def receive(self, command: Command) -> tuple[Acknowledgement, ...] | None:
        """Carry out a command; None if it is none of the commander's."""
        kind = command.command
        if kind == CMD_ARM:
            return acknowledge(self._arm_or_disarm(command))
        if kind == CMD_SET_MODE:
            return acknowledge(self._set_mode_by_number(command))
        if kind == CMD_LAND:
            return acknowledge(self.set_mode(Mode.LAND))
        if kind == CMD_RETURN:
            return acknowledge(self.set_mode(Mode.RTL))
        return None

    def _set_mode_by_number(self, command: Command) -> int:
        base, number = command.parameters[:2]
        if not (math.isfinite(base) and math.isfinite(number)):
            return DENIED
        if not int(base) & _CUSTOM_MODE_ENABLED:
            return DENIED
        mode = mode_of(int(number))
        if mode is None:
            self.say(_WARNING, f"No such mode {int(number)}")
            return FAILED
        return self.set_mode(mode)

    def _arm_or_disarm(self, command: Command) -> int:
        arm, forced = command.parameters[0] == 1.0, command.parameters[1] in _FORCE
        if not arm:
            if self.armed and not (self._situation.landed or forced):
                return FAILED
            if self.armed:
                self.disarm()
            return ACCEPTED
        if self.armed:
            return ACCEPTED
        self._attempted = True
        reasons = self._refusals(forced=forced)
        if not (self.mode.may_arm or reasons):
            reasons = [f"{mode_name(self.mode)} mode not armable"]
        for reason in reasons:
            self.say(_CRITICAL, f"Arm: {reason}")
        if reasons:
            return FAILED
        self.armed = True
        self._has_flown = False
        self.armed_us = self._idle_since_us = self._time_us
        self._announcements += [Announcement.ORIGIN, Announcement.HOME]
        self.say(_INFO, "Arming motors")
        return ACCEPTED

    def disarm(self) -> None:
        """Stop the motors."""
        self.armed = False
        self.say(_INFO, "Disarming motors")


def acknowledge(result: int) -> tuple[Acknowledgement, ...]:
    """The one acknowledgement of a command."""
    return (Acknowledgement(result, 0),)
