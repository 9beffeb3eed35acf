"""Arming in the mode of setpoints, where no other mode can be armed in.

PX4 arms in Hold only with a global position, which a vehicle indoors has not; of an offboard stream
of attitudes it asks for no position at all.  So an idle stream (level, no thrust) flows on the
ground, PX4 is brought to OFFBOARD, says that it would arm, is armed, and takes off at once by its
own take-off, which needs a local position only.
"""

import asyncio

from companion.flight.errors import FlightAbortedError
from companion.flight.stages.crew import Flight, FlightScope

_ONLY_THE_MODE = frozenset({"PX4's pre-arm check", "GPS"})
"""Nothing else may be missing: what satellites would give, the motion capture gives."""
_SETTLED_S = 3.0
"""So long must nothing else have been missing."""
_RISEN_SHARE = 0.85
_SLOW_M_S = 0.3


class OnlyTheMode:
    """Tells when nothing but the mode keeps a vehicle from arming."""

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self._since_s: float | None = None

    def __call__(self) -> bool:
        """Whether it has been so for a while."""
        flight, now_s = self._flight, asyncio.get_running_loop().time()
        missing = flight.connection.readiness.missing
        if not (
            flight.mocap is not None
            and flight.scope is FlightScope.WHOLE
            and flight.connection.dialect.arms_in_setpoint_mode
            and missing
            and _ONLY_THE_MODE.issuperset(missing)
        ):
            self._since_s = None
            return False
        if self._since_s is None:
            self._since_s = now_s
        return now_s - self._since_s >= _SETTLED_S


async def stand_in_setpoint_mode(flight: Flight, wait_s: float) -> None:
    """Stream idle setpoints, in the mode that obeys them, until the autopilot would arm in it.

    Raises:
        FlightAbortedError: it does not take the mode, or would not arm in it either.
    """
    connection, stream = flight.connection, flight.stream
    mode = connection.dialect.setpoint_mode
    flight.voice.tell("info", f"without satellites it is armed in mode {mode}, standing idle")
    stream.start(idle=True)
    try:
        before_s = connection.loop_seconds(connection.dialect.stream_before_mode_s)
        await connection.waiting.pause(before_s)
        change = await connection.exchanges.change_mode(connection.target, mode)
        if connection.mode != mode:
            raise FlightAbortedError(f"The autopilot cannot be armed: {change.explanation}.")
        await connection.waiting.until(
            lambda: connection.readiness.ready,
            wait_s,
            lambda: (
                f"The autopilot did not become ready in mode {mode} within {wait_s:g} s. It "
                f"waits for: {', '.join(connection.readiness.missing)}."
            ),
        )
    except BaseException:
        stream.stop()
        raise


def risen_without_satellites(flight: Flight, height_m: float) -> bool:
    """Whether a take-off is over that cannot end in Hold: high enough, and hardly climbing."""
    connection, state = flight.connection, flight.connection.state
    if flight.mocap is None or state is None:
        return False
    if connection.mode != connection.dialect.takeoff_modes[0]:
        return False
    risen_m = state.position_enu_m[2] - flight.progress.ground_up_m
    return risen_m > _RISEN_SHARE * height_m and abs(state.velocity_enu_m_s[2]) < _SLOW_M_S
