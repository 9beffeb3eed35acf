"""A wind that is a function of the caller's: only for a simulation within the same process."""

from collections.abc import Callable
from math import isfinite

from sitl_shim.frames import Vector3

OwnWindFunction = Callable[[float, Vector3], Vector3]
"""Velocity of the air (ENU, m/s) at a time (s since the vehicle's boot) and a place (ENU, m)."""

_FASTEST_M_S = 100.0


class OwnWind:
    """Asks the function once a step, at times that never go back.

    Args:
        function: what blows.
    """

    __slots__ = ("_function",)

    def __init__(self, function: OwnWindFunction) -> None:
        self._function = function

    def velocity_enu_m_s(self, time_s: float, position_enu_m: Vector3) -> Vector3:
        """Velocity of the air.

        Raises:
            ValueError: it is not three finite numbers of at most 100 m/s.
        """
        given = self._function(time_s, position_enu_m)
        try:
            x, y, z = (float(c) for c in given)
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"the wind at t = {time_s:g} s is {given!r}; three numbers (ENU, m/s) are expected"
            ) from error
        if not isfinite(x + y + z) or max(abs(x), abs(y), abs(z)) > _FASTEST_M_S:
            raise ValueError(
                f"the wind at t = {time_s:g} s is {(x, y, z)} m/s; finite ones of at most "
                f"{_FASTEST_M_S:g} m/s are simulated"
            )
        return (x, y, z)
