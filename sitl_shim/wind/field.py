"""What a wind is, and the two plainest: a steady one, and the sum of several."""

from collections.abc import Sequence
from typing import Protocol

from sitl_shim.frames import Vector3


class Wind(Protocol):
    """Velocity of the air as a function of time and place."""

    def velocity_enu_m_s(self, time_s: float, position_enu_m: Vector3) -> Vector3:
        """Velocity of the air; turbulent winds want times that never go back."""
        ...


class SteadyWind:
    """The same wind everywhere and always."""

    __slots__ = ("_velocity",)

    def __init__(self, velocity_enu_m_s: Vector3) -> None:
        self._velocity = velocity_enu_m_s

    def velocity_enu_m_s(self, time_s: float, position_enu_m: Vector3) -> Vector3:
        """The wind's velocity."""
        return self._velocity


class SumOfWinds:
    """Several winds at once."""

    __slots__ = ("_winds",)

    def __init__(self, winds: Sequence[Wind]) -> None:
        self._winds = tuple(winds)

    def velocity_enu_m_s(self, time_s: float, position_enu_m: Vector3) -> Vector3:
        """Sum of the winds' velocities."""
        x = y = z = 0.0
        for wind in self._winds:
            wx, wy, wz = wind.velocity_enu_m_s(time_s, position_enu_m)
            x, y, z = x + wx, y + wy, z + wz
        return (x, y, z)


CALM: Wind = SteadyWind((0.0, 0.0, 0.0))
"""No wind."""
