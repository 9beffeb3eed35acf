"""A gust front: air that begins to move everywhere at once, and goes on."""

from math import cos, pi

from sitl_shim.frames import Vector3
from sitl_shim.wind.events import Moments, Timed

_CALM = (0.0, 0.0, 0.0)


class GustFront:
    """Rises from nothing to a steady wind as the discrete gust of MIL-F-8785C does: 1 - cos.

    The speed is ``V (1 - cos(pi t / rise)) / 2`` over the rise, and V from then on.

    Args:
        velocity_enu_m_s: V, where it has risen.
        begins: when the rise begins.
        rise_s: how long it takes.
        moments: what its time counts from.
    """

    __slots__ = ("_begins", "_moments", "_rise_s", "_velocity")

    def __init__(
        self, velocity_enu_m_s: Vector3, begins: Timed, rise_s: float, moments: Moments
    ) -> None:
        self._velocity = velocity_enu_m_s
        self._begins = begins
        self._rise_s = rise_s
        self._moments = moments

    def velocity_enu_m_s(self, time_s: float, position_enu_m: Vector3) -> Vector3:
        """Velocity of the air, the same everywhere."""
        since_s = time_s - self._moments.time_s(self._begins)
        if since_s <= 0.0:
            return _CALM
        if since_s >= self._rise_s:
            return self._velocity
        share = 0.5 - 0.5 * cos(pi * since_s / self._rise_s)
        x, y, z = self._velocity
        return (share * x, share * y, share * z)
