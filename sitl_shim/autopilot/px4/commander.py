"""The commander: armed or not, which mode, failsafe, and what commands do to these."""

import math

import numpy as np

from sitl_shim.autopilot.interface import Acknowledgement, Command, StatusText
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4 import arming, failsafe
from sitl_shim.autopilot.px4.modes import Mode, mode_name, mode_of

_ACCEPTED, _TEMPORARILY_REJECTED = 0, 1
_CMD_RETURN, _CMD_LAND, _CMD_TAKEOFF, _CMD_SET_MODE, _CMD_ARM = 20, 21, 22, 176, 400
_FORCE = 21196
_CHECK_PERIOD_US = 100_000
"""The health checks run at 10 Hz: a stream is seen, and missed, at their next run."""
_CRITICAL, _INFO = 2, 6
_ACK_DELAY_US = 8_000
"""To the commander's next run and back."""
_CUSTOM_MODE_ENABLED = 1
_KNOWN = arming.PositionKnown()
_SEED_STREAM = 4
"""Beside those of plant, wind and estimator."""


class Commander:
    """Arming, modes and failsafe of one vehicle.

    Args:
        parameters: of the autopilot.
        seed: draws how late the second acknowledgements of DO_SET_MODE come.
        airborne: begin booted, armed and holding in the air.
    """

    def __init__(self, parameters: ParameterStore, *, seed: int, airborne: bool) -> None:
        self._parameters = parameters
        self._random = np.random.default_rng(
            np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM,))
        )
        self._texts: list[StatusText] = []
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
        self.failsafe_active = False
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
            position=self.position,
        )

    @property
    def system_status(self) -> int:
        """MAV_STATE: 0 not armable in this mode, 3 armable, 4 armed, 5 failsafe."""
        if self.failsafe_active:
            return 5
        if self.armed:
            return 4
        return 3 if self.can_arm else 0

    def take_texts(self) -> list[StatusText]:
        """Texts since the last call."""
        texts, self._texts = self._texts, []
        return texts

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
            stream_alive: a setpoint arrived within COM_OF_LOSS_T.
            position: what the estimator says of its position.
        """
        self._boot_us = time_us
        if time_us % _CHECK_PERIOD_US == 0:
            self.stream_available = stream_alive
            self.position = position
        self._note_landing(time_us, landed)
        self._update_failsafe()
        if self.armed:
            self._disarm_when_idle(time_us, landed)

    def takeoff_done(self) -> None:
        """The take-off has reached its altitude: hold, or stay in its mode where that may not."""
        if self.intended is Mode.AUTO_TAKEOFF and self._can_run(Mode.AUTO_LOITER):
            self.intended = Mode.AUTO_LOITER
        self._update_failsafe()

    def say(self, severity: int, text: str) -> None:
        """Queue a text; PX4 ends most of its texts in a tab."""
        self._texts.append(StatusText(severity, text + "\t"))

    def _note_landing(self, time_us: int, landed: bool) -> None:
        if landed and not self._was_landed:
            self._landed_us = time_us
            if self.armed:
                self.say(_INFO, "Landing detected")
        elif self._was_landed and not landed:
            self._flown = True
            if self.armed:
                self.say(_INFO, "Takeoff detected")
        self._was_landed = landed

    def _can_run(self, mode: Mode) -> bool:
        return arming.mode_can_run(
            mode, stream_available=self.stream_available, position=self.position
        )

    def _update_failsafe(self) -> None:
        lost = self.armed and self.intended is Mode.OFFBOARD and not self.stream_available
        # A mode that is in use loses its position: descend.
        adrift = self.armed and self.intended.is_auto and not self.position.locally
        if not (lost or adrift):
            self.failsafe_active = False
            self.mode = self.intended
            return
        if self.failsafe_active:
            return
        self.failsafe_active = True
        self.say(_CRITICAL, "Failsafe activated")
        if adrift:
            self.mode = Mode.AUTO_LAND
            return
        fallback = failsafe.mode_after_offboard_loss(self._parameters.integer("COM_OBL_RC_ACT"))
        if fallback is None:
            self._disarm("Disarmed by failsafe")
        else:
            self.mode = fallback

    def _disarm_when_idle(self, time_us: int, landed: bool) -> None:
        if not landed:
            return
        if self._flown:
            delay_s, since, why = self._parameters["COM_DISARM_LAND"], self._landed_us, "landing"
        else:
            delay_s, since = self._parameters["COM_DISARM_PRFLT"], self._armed_us
            why = "auto preflight disarming"
        if delay_s >= 0.0 and time_us - since >= delay_s * 1e6:
            self._disarm(f"Disarmed by {why}")

    def _arm(self) -> None:
        self.armed = True
        self._armed_us = self._boot_us
        self._flown = not self._was_landed
        self.say(_INFO, "Armed by external command")
        if self.intended is Mode.AUTO_TAKEOFF:
            self._say_takeoff_altitude()

    def _say_takeoff_altitude(self) -> None:
        if not math.isfinite(self.takeoff_altitude_amsl_m):
            altitude_m = self._parameters["MIS_TAKEOFF_ALT"]
            self.say(_INFO, f"Using default takeoff altitude: {altitude_m:.1f} m")

    def _disarm(self, text: str) -> None:
        self.armed = False
        self.say(_INFO, text)
        if self.intended in (Mode.AUTO_LAND, Mode.AUTO_RTL, Mode.AUTO_TAKEOFF):
            self.intended = Mode.AUTO_LOITER
        self._update_failsafe()

    # --- commands ---

    def receive(self, command: Command) -> tuple[Acknowledgement, ...] | None:
        """Carry out a command; None if it is none of the commander's."""
        kind = command.command
        if kind == _CMD_ARM:
            return self._acknowledge(self._arm_or_disarm(command))
        if kind == _CMD_SET_MODE:
            result = self._set_mode_by_number(command)
            late_us = 4_000 * min(35, int(self._random.exponential(3.0)))
            return (
                Acknowledgement(_ACCEPTED, _ACK_DELAY_US),
                Acknowledgement(result, _ACK_DELAY_US + late_us),
            )
        if kind == _CMD_TAKEOFF:
            self.takeoff_altitude_amsl_m = command.parameters[6]
            if self.armed:
                self._say_takeoff_altitude()
            return self._acknowledge(self._set_mode(Mode.AUTO_TAKEOFF))
        if kind == _CMD_LAND:
            return self._acknowledge(self._set_mode(Mode.AUTO_LAND))
        if kind == _CMD_RETURN:
            return self._acknowledge(self._set_mode(Mode.AUTO_RTL))
        return None

    @staticmethod
    def _acknowledge(result: int) -> tuple[Acknowledgement, ...]:
        return (Acknowledgement(result, _ACK_DELAY_US),)

    def _arm_or_disarm(self, command: Command) -> int:
        arm, forced = command.parameters[0] == 1.0, command.parameters[1] == _FORCE
        if arm:
            if self.armed:
                return _ACCEPTED
            if not (self.can_arm or forced):
                self.say(_CRITICAL, "Arming denied: Resolve system health failures first")
                return _TEMPORARILY_REJECTED
            self._arm()
            return _ACCEPTED
        if not self.armed:
            return _ACCEPTED
        if not (self._was_landed or forced):
            self.say(_CRITICAL, "Disarming denied: not landed")
            return _TEMPORARILY_REJECTED
        self._disarm("Disarmed by external command")
        return _ACCEPTED

    def _set_mode_by_number(self, command: Command) -> int:
        base, main, sub = command.parameters[:3]
        if not all(math.isfinite(number) for number in (base, main)):
            return _TEMPORARILY_REJECTED
        if not int(base) & _CUSTOM_MODE_ENABLED:
            return _TEMPORARILY_REJECTED
        mode = mode_of(int(main), int(sub) if math.isfinite(sub) else 0)
        return _TEMPORARILY_REJECTED if mode is None else self._set_mode(mode)

    def _set_mode(self, mode: Mode) -> int:
        """Disarmed, any mode may be chosen; armed, only one that can run."""
        if self.armed and not self._can_run(mode):
            self.say(_CRITICAL, f"Switching to {mode_name(mode)} is currently not available")
            return _TEMPORARILY_REJECTED
        self.intended = mode
        self._update_failsafe()
        return _ACCEPTED
