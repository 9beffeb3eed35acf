"""What PX4 does when something fails in flight: the worst of all that is called for.

From its source (commander/failsafe) and its documentation
(https://docs.px4.io/main/en/config/safety.html); what follows on the loss of the offboard stream
was measured.  Each cause asks for an action.  The actions are ordered, the worst one flies, and
one that cannot be flown gives way to the next worse.  Some causes hold for COM_FAIL_ACT_T first.
A mode that is chosen while an action flies takes over from it, until another cause comes up.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum

from sitl_shim.autopilot.interface import TICK_S
from sitl_shim.autopilot.px4.modes import Mode


class Action(IntEnum):
    """Actions from harmless to final, with the numbers that events give them."""

    NONE = 0
    WARN = 1
    POSITION = 2
    ALTITUDE = 3
    STABILIZED = 4
    HOLD = 5
    RETURN = 6
    LAND = 7
    DESCEND = 8
    DISARM = 9
    TERMINATE = 10


class CauseNumber(IntEnum):
    """Causes with the numbers that events give them."""

    GENERIC = 0
    BATTERY_LOW = 3
    BATTERY_CRITICAL = 4
    BATTERY_EMERGENCY = 5


@dataclass(frozen=True, slots=True)
class Cause:
    """Something is wrong, and asks for an action."""

    key: str
    """Two of the same key are the same."""
    action: Action
    number: CauseNumber = CauseNumber.GENERIC
    held: bool = True
    """Whether the vehicle holds for COM_FAIL_ACT_T before it acts."""
    lasts: bool = False
    """Whether it goes on when what was wrong is over, until somebody chooses a mode."""


_OFFBOARD_LOSS = (
    Action.POSITION,
    Action.ALTITUDE,
    Action.STABILIZED,
    Action.RETURN,
    Action.LAND,
    Action.HOLD,
    Action.TERMINATE,
    Action.DISARM,
)
"""By COM_OBL_RC_ACT."""

_MODES: Mapping[Action, Mode] = {
    Action.POSITION: Mode.POSCTL,
    Action.ALTITUDE: Mode.ALTCTL,
    Action.STABILIZED: Mode.STABILIZED,
    Action.HOLD: Mode.AUTO_LOITER,
    Action.RETURN: Mode.AUTO_RTL,
    Action.LAND: Mode.AUTO_LAND,
    Action.DESCEND: Mode.AUTO_LAND,
}
_GIVES_WAY = (
    Action.POSITION,
    Action.ALTITUDE,
    Action.STABILIZED,
    Action.HOLD,
    Action.RETURN,
    Action.LAND,
)
"""Actions that may be impossible; the next one is tried then, and after the last one DESCEND."""
_STOPS = (Action.DISARM, Action.TERMINATE)
# Looked at in every tick: in Python 3.11 a member costs eight times as much by its class.
_NONE, _WARN = Action.NONE, Action.WARN


def after_offboard_loss(parameter: int) -> Action:
    """What COM_OBL_RC_ACT asks for."""
    return _OFFBOARD_LOSS[parameter]


def mode_of(action: Action) -> Mode | None:
    """The mode that an action flies; None where it flies none.

    A mode for sticks without sticks sinks level, lands and disarms.
    """
    return _MODES.get(action)


class Failsafe:
    """Chooses the action of each period.

    Args:
        can_fly: whether the vehicle has what a mode needs, sticks not counted.
        tell: is told each new action, what it puts off (NONE: nothing), and why.
    """

    __slots__ = ("_can_fly", "_delay_s", "_standing", "_taken_over", "_tell", "action")

    def __init__(
        self,
        can_fly: Callable[[Mode], bool],
        tell: Callable[[Action, Action, CauseNumber], None],
    ) -> None:
        self._can_fly = can_fly
        self._tell = tell
        self._standing: dict[str, Cause] = {}
        self._delay_s = 0.0
        self._taken_over = False
        self.action = Action.NONE

    @property
    def active(self) -> bool:
        """Whether something other than the intended mode flies."""
        return self.action > _WARN

    @property
    def idle(self) -> bool:
        """Whether nothing is or was called for."""
        return self.action is _NONE and not self._standing

    def forget(self) -> None:
        """Armed or disarmed: what is over is forgotten, and nothing flies in place of a mode."""
        self._standing = {}
        self._delay_s = 0.0
        self._taken_over = False
        self.action = Action.NONE

    def step(
        self,
        causes: tuple[Cause, ...],
        fallback: Action,
        intended: Mode,
        *,
        chosen: bool,
        hold_s: float,
        passed_s: float = TICK_S,
    ) -> Action:
        """One period in flight.

        Args:
            causes: what is wrong now.
            fallback: what the intended mode's own lack calls for.
            intended: the mode that was asked for.
            chosen: it was asked for just now.
            hold_s: COM_FAIL_ACT_T.
            passed_s: since the last period.
        """
        if chosen or self._taken_over:
            self._standing = {
                key: cause
                for key, cause in self._standing.items()
                if any(cause.key == present.key for present in causes)
            }
        holds = self._can_fly(Mode.AUTO_LOITER)
        self._delay_s = max(0.0, self._delay_s - passed_s)
        warned = self._add(causes, hold_s)
        if self.action > Action.HOLD or not holds or self._taken_over:
            self._delay_s = 0.0
        worst = max(self._standing.values(), key=lambda cause: cause.action, default=None)
        action = fallback if worst is None else max(fallback, worst.action)
        number = CauseNumber.GENERIC
        if worst is not None and worst.action > fallback:
            number = worst.number
        put_off = Action.NONE
        if self._delay_s > 0.0 and not self._taken_over and action not in _STOPS:
            action, put_off = Action.HOLD, action
        taken = self._taken_over or (chosen and action is self.action)
        self._taken_over = taken and Action.HOLD <= action <= Action.DESCEND
        if self._taken_over:
            action, put_off = max(Action.WARN, fallback), Action.NONE
        action = self._possible(action)
        if intended is Mode.AUTO_LAND and Action.RETURN in (action, put_off) and holds:
            action, put_off = Action.WARN, Action.NONE
        if action > self.action or (warned and action is not Action.NONE):
            self._tell(action, put_off, number)
        self.action = action
        return action

    def _add(self, causes: tuple[Cause, ...], hold_s: float) -> bool:
        """Take the causes of now; returns whether there is a new warning."""
        warned = False
        before = self._standing
        self._standing = {key: cause for key, cause in before.items() if cause.lasts}
        for cause in causes:
            self._standing[cause.key] = cause
            if cause.key in before:
                continue
            warned = warned or cause.action is Action.WARN
            if cause.action >= Action.HOLD:
                self._taken_over = False
                if cause.held and self._delay_s == 0.0 and hold_s > 0.1:
                    self._delay_s = hold_s
        return warned

    def _possible(self, action: Action) -> Action:
        if action not in _GIVES_WAY:
            return action
        for wanted in _GIVES_WAY[_GIVES_WAY.index(action) :]:
            if self._can_fly(_MODES[wanted]):
                return wanted
        return Action.DESCEND
