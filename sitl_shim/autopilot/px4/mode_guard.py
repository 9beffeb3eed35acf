"""Which mode flies: the one that was asked for, or what a failsafe has in its place."""

from collections.abc import Callable

from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4 import failsafe
from sitl_shim.autopilot.px4.announcements import CRITICAL, Announcer, failsafe_event
from sitl_shim.autopilot.px4.arming import PositionKnown
from sitl_shim.autopilot.px4.failsafe import Action, Cause, CauseNumber, Failsafe
from sitl_shim.autopilot.px4.modes import Mode

# Looked at in every tick: in Python 3.11 a member costs eight times as much by its class.
_OFFBOARD = Mode.OFFBOARD


class ModeGuard:
    """Watches over the mode of one vehicle.

    Args:
        parameters: COM_OBL_RC_ACT, COM_FAIL_ACT_T.
        announcer: takes texts and events.
        can_run: whether a mode has what it needs, sticks included.
    """

    def __init__(
        self,
        parameters: ParameterStore,
        announcer: Announcer,
        can_run: Callable[[Mode], bool],
    ) -> None:
        self._parameters = parameters
        self._announcer = announcer
        self._can_run = can_run
        self._failsafe = Failsafe(self._could_run, self._tell)
        self._intended = Mode.AUTO_LOITER
        self._position = PositionKnown()
        self.causes: tuple[Cause, ...] = ()
        """What is wrong with more than the mode: the battery, the geofence."""

    @property
    def active(self) -> bool:
        """Whether something other than the intended mode flies."""
        return self._failsafe.active

    def forget(self) -> None:
        """What was, was in another flight."""
        self._failsafe.forget()

    def choose(
        self,
        intended: Mode,
        position: PositionKnown,
        *,
        armed: bool,
        stream_available: bool,
        chosen: bool,
        passed_s: float,
    ) -> Mode | None:
        """The mode that flies; None: the motors are to stop.

        Args:
            intended: the mode that was asked for.
            position: what the estimator says of its position.
            armed: disarmed, nothing but the intended mode counts.
            stream_available: whether offboard setpoints come in.
            chosen: the mode was asked for just now.
            passed_s: since the last time.
        """
        self._intended, self._position = intended, position
        guard = self._failsafe
        lacks_nothing = stream_available if intended is _OFFBOARD else position.locally
        if armed and lacks_nothing and not self.causes and guard.idle:
            return intended  # nearly always
        fallback = self._fallback(stream_available=stream_available) if armed else Action.NONE
        if not armed or (fallback is Action.NONE and not self.causes and guard.idle):
            if not guard.idle:
                guard.forget()
            return intended
        hold_s = self._parameters["COM_FAIL_ACT_T"]
        action = guard.step(
            self.causes, fallback, intended, chosen=chosen, hold_s=hold_s, passed_s=passed_s
        )
        if action in (Action.DISARM, Action.TERMINATE):
            return None
        return failsafe.mode_of(action) or intended

    def _could_run(self, mode: Mode) -> bool:
        """Whether a mode has what it needs, but for the sticks."""
        if mode.needs_sticks:
            return self._position.locally or mode is not Mode.POSCTL
        return self._can_run(mode)

    def _fallback(self, *, stream_available: bool) -> Action:
        """What the intended mode's own lack calls for."""
        intended = self._intended
        if intended is Mode.OFFBOARD:
            if stream_available:
                return Action.NONE
            return failsafe.after_offboard_loss(self._parameters.integer("COM_OBL_RC_ACT"))
        if self._position.locally:
            return Action.NONE
        if intended is Mode.POSCTL:
            return Action.ALTITUDE
        # A mode that is in use loses its position.
        return Action.DESCEND if intended.is_auto else Action.NONE

    def _tell(self, action: Action, put_off: Action, number: CauseNumber) -> None:
        """Say what flies now in place of the intended mode, or will soon."""
        text = "Failsafe activated"
        if put_off is not Action.NONE:
            text += f", entering Hold for {self._parameters['COM_FAIL_ACT_T']:.0f} seconds"
        self._announcer.say(CRITICAL, text)
        self._announcer.tell(
            failsafe_event(self._intended, action, put_off, number, self._parameters)
        )
