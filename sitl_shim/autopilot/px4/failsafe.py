"""What happens when the offboard stream stops in flight."""

from enum import IntEnum

from sitl_shim.autopilot.px4.modes import Mode


class OffboardLossAction(IntEnum):
    """Values of COM_OBL_RC_ACT."""

    POSITION = 0
    ALTITUDE = 1
    STABILIZED = 2
    RETURN = 3
    LAND = 4
    HOLD = 5
    TERMINATE = 6
    DISARM = 7


_MODE: dict[OffboardLossAction, Mode | None] = {
    OffboardLossAction.POSITION: Mode.POSCTL,
    OffboardLossAction.ALTITUDE: Mode.ALTCTL,
    OffboardLossAction.STABILIZED: Mode.STABILIZED,
    OffboardLossAction.RETURN: Mode.AUTO_RTL,
    OffboardLossAction.LAND: Mode.AUTO_LAND,
    OffboardLossAction.HOLD: Mode.AUTO_LOITER,
    OffboardLossAction.TERMINATE: None,
    OffboardLossAction.DISARM: None,
}


EVENT_NUMBERS: dict[OffboardLossAction, int] = {
    OffboardLossAction.POSITION: 2,
    OffboardLossAction.ALTITUDE: 3,
    OffboardLossAction.STABILIZED: 4,
    OffboardLossAction.HOLD: 5,
    OffboardLossAction.RETURN: 6,
    OffboardLossAction.LAND: 7,
    OffboardLossAction.DISARM: 9,
    OffboardLossAction.TERMINATE: 10,
}
"""The actions as events number them."""
EVENT_DESCEND = 8


def mode_after_offboard_loss(action: OffboardLossAction) -> Mode | None:
    """Mode to fall back to; None: stop the motors.

    A mode for sticks has none here: it sinks level, lands and disarms.
    """
    return _MODE[action]
