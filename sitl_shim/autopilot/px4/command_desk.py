"""What commands do to a PX4, and how they are acknowledged.

https://docs.px4.io/main/en/mavlink/standard_modes, https://mavlink.io/en/services/command.html
"""

import math

import numpy as np

from sitl_shim.autopilot.interface import Acknowledgement, Command, Event
from sitl_shim.autopilot.mission_plan import MissionPlan
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.announcements import (
    CRITICAL,
    INFO,
    LANDING_HERE_ID,
    Announcer,
    ArmReason,
    make_event,
)
from sitl_shim.autopilot.px4.commander import Commander, Reposition
from sitl_shim.autopilot.px4.modes import Mode, mode_of

_ACCEPTED, _TEMPORARILY_REJECTED, _DENIED, _UNSUPPORTED = 0, 1, 2, 3
_CMD_RETURN, _CMD_LAND, _CMD_TAKEOFF = 20, 21, 22
_CMD_SET_MODE, _CMD_CHANGE_SPEED, _CMD_REPOSITION = 176, 178, 192
_CMD_MISSION_START, _CMD_ARM = 300, 400
_FORCE = 21196
_ACK_DELAY_US = 8_000
"""To the commander's next run and back."""
_CUSTOM_MODE_ENABLED = 1
_CHANGE_MODE = 1
"""The one flag of DO_REPOSITION."""
_SEED_STREAM = 4
"""Beside those of plant, wind and estimator."""


class CommandDesk:
    """Takes commands and carries them out.

    Args:
        commander: arms, disarms, changes modes.
        parameters: of the autopilot.
        plan: the mission.
        announcer: takes texts and events.
        seed: draws how late the second acknowledgements of DO_SET_MODE come.
    """

    def __init__(
        self,
        commander: Commander,
        parameters: ParameterStore,
        plan: MissionPlan,
        announcer: Announcer,
        *,
        seed: int,
    ) -> None:
        self._commander = commander
        self._parameters = parameters
        self._plan = plan
        self._announcer = announcer
        self._random = np.random.default_rng(
            np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM,))
        )
        self._handlers = {
            _CMD_ARM: self._arm_or_disarm,
            _CMD_TAKEOFF: self._take_off,
            _CMD_LAND: self._land,
            _CMD_RETURN: lambda _: self._change_mode(Mode.AUTO_RTL),
            _CMD_MISSION_START: self._start_mission,
            _CMD_REPOSITION: self._reposition,
            _CMD_CHANGE_SPEED: self._change_speed,
        }

    def receive(self, command: Command) -> tuple[Acknowledgement, ...] | None:
        """Carry out a command; None if it is none of these."""
        if command.command == _CMD_SET_MODE:
            result = self._set_mode_by_number(command)
            late_us = 4_000 * min(35, int(self._random.exponential(3.0)))
            return (
                Acknowledgement(_ACCEPTED, _ACK_DELAY_US),
                Acknowledgement(result, _ACK_DELAY_US + late_us),
            )
        handler = self._handlers.get(command.command)
        if handler is None:
            return None
        return (Acknowledgement(handler(command), _ACK_DELAY_US),)

    # --- arming ---

    def _arm_or_disarm(self, command: Command) -> int:
        commander = self._commander
        arm, forced = command.parameters[0] == 1.0, command.parameters[1] == _FORCE
        if arm:
            return self._arm(ArmReason.COMMAND, forced=forced)
        if not commander.armed:
            return _ACCEPTED
        if not (commander.on_ground or forced):
            self._announcer.say(CRITICAL, "Disarming denied: not landed")
            self._announcer.tell(
                make_event("commander_disarm_denied_not_landed", external=CRITICAL)
            )
            return _TEMPORARILY_REJECTED
        commander.disarm(ArmReason.COMMAND)
        return _ACCEPTED

    def _arm(self, reason: ArmReason, *, forced: bool = False) -> int:
        commander = self._commander
        if commander.armed:
            return _ACCEPTED
        if not (commander.can_arm or forced):
            text = "Arming denied: Resolve system health failures first"
            self._announcer.say(CRITICAL, text)
            self._announcer.tell(
                make_event("commander_arm_denied_resolve_failures", external=CRITICAL)
            )
            return _TEMPORARILY_REJECTED
        commander.arm(reason)
        return _ACCEPTED

    # --- modes ---

    def _change_mode(self, mode: Mode) -> int:
        return _ACCEPTED if self._commander.set_mode(mode) else _TEMPORARILY_REJECTED

    def _set_mode_by_number(self, command: Command) -> int:
        base, main, sub = command.parameters[:3]
        if not all(math.isfinite(number) for number in (base, main)):
            return _TEMPORARILY_REJECTED
        if not int(base) & _CUSTOM_MODE_ENABLED:
            return _TEMPORARILY_REJECTED
        mode = mode_of(int(main), int(sub) if math.isfinite(sub) else 0)
        return _TEMPORARILY_REJECTED if mode is None else self._change_mode(mode)

    def _take_off(self, command: Command) -> int:
        commander = self._commander
        commander.takeoff_altitude_amsl_m = command.parameters[6]
        if commander.armed:
            commander.say_takeoff_altitude()
        return self._change_mode(Mode.AUTO_TAKEOFF)

    def _land(self, _: Command) -> int:
        self._announcer.tell(Event(LANDING_HERE_ID, INFO << 4 | INFO, b""))
        return self._change_mode(Mode.AUTO_LAND)

    # --- missions and going somewhere ---

    def _start_mission(self, command: Command) -> int:
        """Mission mode, and armed: PX4 arms by itself here."""
        commander = self._commander
        if not commander.mission_available:
            self._announcer.say(CRITICAL, "Mission start denied! No valid mission")
            self._announcer.tell(
                make_event("commander_mission_start_denied_no_mission", external=CRITICAL)
            )
            return _DENIED
        first = command.parameters[0]
        if not (math.isfinite(first) and -1.0 <= first < len(self._plan)):
            return _DENIED
        if not commander.set_mode(Mode.AUTO_MISSION):
            return _TEMPORARILY_REJECTED
        if self._arm(ArmReason.MISSION_START) == _ACCEPTED:
            if first >= 0.0:
                self._plan.set_current(int(first))
            return _ACCEPTED
        commander.refuse_mode(Mode.AUTO_MISSION)
        return _TEMPORARILY_REJECTED

    def _reposition(self, command: Command) -> int:
        speed, flags, _, yaw_rad = command.parameters[:4]
        if not math.isfinite(flags) or int(flags) != _CHANGE_MODE:
            return _UNSUPPORTED
        result = self._change_mode(Mode.AUTO_LOITER)
        if result == _ACCEPTED:
            self._commander.reposition(
                Reposition(
                    goes=True,
                    position_xy_m=command.position_xy_m,
                    altitude_m=command.altitude_m,
                    above_home=command.above_home,
                    yaw_enu_rad=math.pi / 2.0 - yaw_rad,
                    speed_m_s=self._speed(speed),
                )
            )
        return result

    def _change_speed(self, command: Command) -> int:
        """Horizontal speed of what flies now."""
        speed = self._speed(command.parameters[1])
        if self._commander.mode is Mode.AUTO_MISSION:
            self._plan.change_speed(speed)
        elif speed is not None:
            self._commander.reposition(Reposition(goes=False, speed_m_s=speed))
        return _ACCEPTED

    def _speed(self, wanted_m_s: float) -> float | None:
        """A speed that was asked for, within MPC_XY_VEL_MAX; None where none was."""
        if not math.isfinite(wanted_m_s) or wanted_m_s <= 0.0:
            return None
        return min(wanted_m_s, self._parameters["MPC_XY_VEL_MAX"])
