"""The commander: armed or not, which mode, failsafe."""

import math
import struct
from dataclasses import dataclass

from sitl_shim.autopilot.interface import TICK_S
from sitl_shim.autopilot.mission_plan import MissionPlan
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4 import arming
from sitl_shim.autopilot.px4.announcements import (
    CRITICAL,
    ERROR,
    INFO,
    REASON_TEXTS,
    Announcer,
    ArmReason,
    make_event,
    mode_arguments,
)
from sitl_shim.autopilot.px4.failsafe import Cause
from sitl_shim.autopilot.px4.health_report import FIRST_US, health_report
from sitl_shim.autopilot.px4.mode_guard import ModeGuard
from sitl_shim.autopilot.px4.modes import Mode, mode_name, navigation_number

CHECK_PERIOD_US = 100_000
"""The health checks run at 10 Hz: a stream is seen, and missed, at their next run."""
_KNOWN = arming.PositionKnown()


@dataclass(frozen=True, slots=True)
class Reposition:
    """Where a vehicle that holds is to go, or only how fast."""

    goes: bool
    """Whether anything but the speed changes."""

    position_xy_m: tuple[float, float] | None = None
    """East and north; None: where it can come to rest."""
    altitude_m: float = math.nan
    """In the local frame, or above home; NaN: the altitude that it holds."""
    above_home: bool = False
    yaw_enu_rad: float = math.nan
    speed_m_s: float | None = None
    """Horizontal, from now on; None as before."""


class Commander:
    """Arming, modes and failsafe of one vehicle.

    Args:
        parameters: of the autopilot.
        plan: the mission, which mission mode needs.
        announcer: takes texts and events.
        airborne: begin booted, armed and holding in the air.
    """

    def __init__(
        self,
        parameters: ParameterStore,
        plan: MissionPlan,
        announcer: Announcer,
        *,
        airborne: bool,
    ) -> None:
        self._parameters = parameters
        self._plan = plan
        self._announcer = announcer
        self._reported: tuple[bool, bool, bool] | None = None
        self._reposition: Reposition | None = None
        self._booted = airborne
        self._boot_us = 0
        self._armed_us = 0
        self._landed_us = 0
        self._was_landed = not airborne
        self._flown = airborne
        self.intended = Mode.AUTO_LOITER
        """What the user asked for last."""
        self.mode = Mode.AUTO_LOITER
        """What flies: the intended mode, or the failsafe's."""
        self.armed = airborne
        self._guard = ModeGuard(parameters, announcer, self._can_run)
        self._sticks = False
        self.stream_available = False
        self.position = arming.PositionKnown()
        """What the estimator said of its position at the last health checks."""
        self.takeoff_altitude_amsl_m = math.nan
        """Of the last take-off command; NaN for MIS_TAKEOFF_ALT above home."""

    # --- state for others ---

    @property
    def ready(self) -> bool:
        """Whether booting is over."""
        return self._booted or self._boot_us >= arming.READY_US

    @property
    def can_arm(self) -> bool:
        """Whether the checks pass in the intended mode."""
        return arming.mode_can_arm(
            self.intended,
            ready=self.ready,
            stream_available=self.stream_available,
            mission_available=self.mission_available,
            position=self.position,
            sticks=self._sticks,
        )

    @property
    def checks_pass(self) -> bool:
        """PREARM_CHECK in SYS_STATUS: whether the mode that flies has what it needs."""
        return self.ready and self._can_run(self.mode)

    @property
    def mission_available(self) -> bool:
        """Whether there is a mission to fly."""
        return bool(self._plan.items)

    @property
    def on_ground(self) -> bool:
        """The land detector's verdict at the last step."""
        return self._was_landed

    @property
    def failsafe_active(self) -> bool:
        """Whether something other than the intended mode flies."""
        return self._guard.active

    @property
    def sticks_centred(self) -> bool:
        """Whether there is a pilot; the sticks stand in the middle then."""
        return self._sticks

    @property
    def system_status(self) -> int:
        """MAV_STATE: 0 not armable in this mode, 3 armable, 4 armed, 5 failsafe."""
        if self._guard.active:
            return 5
        if self.armed:
            return 4
        return 3 if self.can_arm else 0

    def beware(self, causes: tuple[Cause, ...]) -> None:
        """What is wrong from now on with more than the mode."""
        self._guard.causes = causes

    def take_reposition(self) -> Reposition | None:
        """Where to go while holding, if it was told since the last call."""
        wanted, self._reposition = self._reposition, None
        return wanted

    # --- the run of time ---

    def step(
        self,
        time_us: int,
        *,
        landed: bool,
        stream_alive: bool,
        position: arming.PositionKnown = _KNOWN,
    ) -> None:
        """One period of 4 ms.

        Args:
            time_us: boot time.
            landed: the land detector's verdict.
            stream_alive: a setpoint arrived within COM_OF_LOSS_T; counts at the health checks.
            position: what the estimator says of its position; counts at the health checks.
        """
        self._boot_us = time_us
        if time_us % CHECK_PERIOD_US == 0:
            self.stream_available = stream_alive
            self.position = position
            self._report_health()
        self._note_landing(time_us, landed)
        self._update_failsafe(passed_s=TICK_S)
        if self.armed:
            self._disarm_when_idle(time_us, landed)

    def takeoff_done(self) -> None:
        """The take-off has reached its altitude: hold, or stay in its mode where that may not."""
        if self.intended is Mode.AUTO_TAKEOFF and self._can_run(Mode.AUTO_LOITER):
            self.intended = Mode.AUTO_LOITER
        self._update_failsafe()

    def mission_done(self) -> None:
        """There is nothing left to fly of the mission: hold."""
        if self.mission_available:
            self._announcer.say(INFO, "Mission finished, loitering")
            self._announcer.tell(make_event("mission_finished_loiter"))
        else:
            self._announcer.say(CRITICAL, "No valid mission available, loitering")
        if self.intended is Mode.AUTO_MISSION:
            self.intended = Mode.AUTO_LOITER
        self._update_failsafe()

    def reposition(self, wanted: Reposition) -> None:
        """Go there as soon as, and if, the vehicle holds."""
        self._reposition = wanted

    def _report_health(self) -> None:
        """Tell which modes can run, whenever it changes."""
        facts = (self.ready, self.stream_available, self.mission_available)
        if facts == self._reported or self._boot_us < FIRST_US:
            return
        self._reported = facts
        ready, stream, mission = facts
        for event in health_report(ready=ready, stream=stream, mission=mission):
            self._announcer.tell(event)

    def _note_landing(self, time_us: int, landed: bool) -> None:
        if landed and not self._was_landed:
            self._landed_us = time_us
            if self.armed:
                self._announcer.say(INFO, "Landing detected")
                self._announcer.tell(make_event("commander_landing_detected"))
        elif self._was_landed and not landed:
            self._flown = True
            if self.armed:
                self._announcer.say(INFO, "Takeoff detected")
                self._announcer.tell(make_event("commander_takeoff_detected"))
        self._was_landed = landed

    def _can_run(self, mode: Mode) -> bool:
        return arming.mode_can_run(
            mode,
            stream_available=self.stream_available,
            mission_available=self.mission_available,
            position=self.position,
            sticks=self._sticks,
        )

    def _update_failsafe(self, *, chosen: bool = False, passed_s: float = 0.0) -> None:
        """Fly the intended mode, or what a failsafe has in its place.

        Args:
            chosen: the intended mode was asked for just now.
            passed_s: since the last time.
        """
        mode = self._guard.choose(
            self.intended,
            self.position,
            armed=self.armed,
            stream_available=self.stream_available,
            chosen=chosen,
            passed_s=passed_s,
        )
        if mode is None:
            self.disarm(ArmReason.FAILSAFE)
        else:
            self.mode = mode

    def _disarm_when_idle(self, time_us: int, landed: bool) -> None:
        if not landed:
            return
        if self._flown:
            delay_s, since = self._parameters["COM_DISARM_LAND"], self._landed_us
            why = ArmReason.LANDING
        else:
            delay_s, since = self._parameters["COM_DISARM_PRFLT"], self._armed_us
            why = ArmReason.PREFLIGHT_INACTION
        if delay_s >= 0.0 and time_us - since >= delay_s * 1e6:
            self.disarm(why)

    # --- what commands do ---

    def arm(self, reason: ArmReason) -> None:
        """Let the motors turn."""
        self.armed = True
        self._guard.forget()
        self._armed_us = self._boot_us
        self._flown = not self._was_landed
        self._announcer.say(INFO, f"Armed by {REASON_TEXTS[reason]}")
        self._announcer.tell(make_event("commander_armed_by", bytes([reason])))
        if self.intended is Mode.AUTO_TAKEOFF:
            self.say_takeoff_altitude()

    def disarm(self, reason: ArmReason) -> None:
        """Stop the motors; modes in which nobody may arm are left."""
        self.armed = False
        self._announcer.say(INFO, f"Disarmed by {REASON_TEXTS[reason]}")
        self._announcer.tell(make_event("commander_disarmed_by", bytes([reason])))
        if self.intended in (Mode.AUTO_LAND, Mode.AUTO_RTL, Mode.AUTO_TAKEOFF):
            self.intended = Mode.AUTO_LOITER
        self._update_failsafe()

    def say_takeoff_altitude(self) -> None:
        """Tell the altitude of a take-off that was asked for without one."""
        if not math.isfinite(self.takeoff_altitude_amsl_m):
            altitude_m = self._parameters["MIS_TAKEOFF_ALT"]
            self._announcer.say(INFO, f"Using default takeoff altitude: {altitude_m:.1f} m")
            self._announcer.tell(
                make_event("navigator_takeoff_default_alt", struct.pack("<f", altitude_m))
            )

    def say_already_higher(self) -> None:
        """Tell that a take-off asks for less than the present altitude."""
        self._announcer.say(CRITICAL, "Already higher than takeoff altitude")
        self._announcer.tell(make_event("navigator_takeoff_already_higher", external=ERROR))

    def set_mode(self, mode: Mode) -> bool:
        """Choose a mode: disarmed any, armed only one that can run; False if refused."""
        if self.armed and not self._can_run(mode):
            self.refuse_mode(mode)
            return False
        self.intended = mode
        self._reposition = None
        self._update_failsafe(chosen=True)
        return True

    def take_sticks(self, mode: Mode) -> None:
        """A pilot's radio control is there, and its switch says a mode."""
        self._sticks = True
        self.set_mode(mode)

    def refuse_mode(self, mode: Mode) -> None:
        """Say that a mode is not to be had."""
        text = f"Switching to {mode_name(mode)} is currently not available"
        self._announcer.say(CRITICAL, text)
        self._announcer.tell(
            make_event(
                "commander_modeswitch_not_avail",
                mode_arguments(mode, navigation_number(mode)),
                external=CRITICAL,
            )
        )
