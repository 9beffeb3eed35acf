"""When the vehicle may be armed, and what its sensors say of themselves while it boots."""

from typing import NamedTuple

from sitl_shim.autopilot.interface import SensorHealth
from sitl_shim.autopilot.px4.modes import Mode

READY_US = 4_200_000
"""Boot time from which the estimator is good enough to arm."""
HOME_US = 3_700_000
"""Boot time at which the position becomes valid, and home is set."""
_PARTLY_UP_US = 2_200_000

_PREARM_CHECK = 0x10000000
_NOTHING_YET = SensorHealth(0x0, 0x0, 0x0321C83F)
_PARTLY_UP = SensorHealth(0x0300400F, 0x0301400F, 0x0320883F)
_UP = SensorHealth(0x0300402F, 0x0301402F, 0x0320C83F)
_ARMABLE = SensorHealth(_UP.present, _UP.enabled, _UP.health | _PREARM_CHECK)

_NO_ARMING_IN = (Mode.AUTO_LAND, Mode.AUTO_RTL)
_NEEDS_GLOBAL_POSITION = (Mode.AUTO_LOITER, Mode.AUTO_MISSION, Mode.AUTO_RTL)


class PositionKnown(NamedTuple):
    """What the estimator says of its position."""

    locally: bool = True
    globally: bool = True


def mode_can_run(
    mode: Mode,
    *,
    stream_available: bool,
    mission_available: bool,
    position: PositionKnown,
    sticks: bool = False,
) -> bool:
    """Whether a mode has what it needs: a stream, a mission, sticks, a position.

    An offboard stream of attitudes needs no position.  To hold takes a global one, which is why a
    vehicle without satellites cannot be armed in Hold, whatever measures its position.
    """
    if mode is Mode.OFFBOARD:
        return stream_available
    if mode.needs_sticks:
        return sticks and (position.locally or mode is not Mode.POSCTL)
    if mode is Mode.AUTO_MISSION and not mission_available:
        return False
    return position.locally and (position.globally or mode not in _NEEDS_GLOBAL_POSITION)


def mode_can_arm(
    mode: Mode,
    *,
    ready: bool,
    stream_available: bool,
    mission_available: bool,
    position: PositionKnown,
    sticks: bool = False,
) -> bool:
    """Whether the checks before arming pass in a mode."""
    can_run = mode_can_run(
        mode,
        stream_available=stream_available,
        mission_available=mission_available,
        position=position,
        sticks=sticks,
    )
    return ready and can_run and mode not in _NO_ARMING_IN


def sensor_health(boot_us: int, *, ready: bool, checks_pass: bool) -> SensorHealth:
    """SYS_STATUS while booting and after, as measured."""
    if ready:
        return _ARMABLE if checks_pass else _UP
    return _PARTLY_UP if boot_us >= _PARTLY_UP_US else _NOTHING_YET
