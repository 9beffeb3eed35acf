"""Which messages are streamed, how often, and when each is next due.

Due times lie on a grid of the message's interval, the same for all links, and messages leave at the
autopilot's ticks of 4 ms: at 10 ms apart the steps are 8 and 12 ms.  Measured rates per link of
PX4 v1.17.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from enum import Enum
from heapq import heapify, heappop, heappush, heapreplace
from operator import itemgetter

from sitl_shim.mavlink import messages_motion as motion
from sitl_shim.mavlink import messages_status as status
from sitl_shim.mavlink import messages_truth as truth
from sitl_shim.mavlink.packets import Layout, Packet
from sitl_shim.mavlink.wire import Message, dialect
from sitl_shim.simulation import Simulation

Builder = Callable[[Simulation], Message | None]
"""Makes one message of the present state; None if it has nothing to say yet."""


class LinkKind(Enum):
    """What a link is for: it decides the rates that it starts with."""

    ONBOARD = "onboard"
    GROUND_STATION = "ground station"


PING_ID: int = dialect.MAVLINK_MSG_ID_PING
TIMESYNC_ID: int = dialect.MAVLINK_MSG_ID_TIMESYNC
HEARTBEAT_ID: int = dialect.MAVLINK_MSG_ID_HEARTBEAT
AVAILABLE_MODES_ID: int = dialect.MAVLINK_MSG_ID_AVAILABLE_MODES
_TIMESYNC = Layout(dialect.MAVLink_timesync_message)


def timesync(sim: Simulation) -> Packet:
    """TIMESYNC (111): the autopilot's own question, with its boot time in ns."""
    return Packet(_TIMESYNC, _TIMESYNC.pack(0, sim.stamp_us * 1000))


def ping(sim: Simulation) -> Message:
    """PING (4): the autopilot's own question to everybody."""
    return dialect.MAVLink_ping_message(sim.stamp_us, sim.time_us // 1_000_000, 0, 0)


BUILDERS: dict[int, Builder] = {
    HEARTBEAT_ID: status.heartbeat,
    dialect.MAVLINK_MSG_ID_ODOMETRY: motion.odometry,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: motion.local_position_ned,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: motion.attitude_quaternion,
    dialect.MAVLINK_MSG_ID_ATTITUDE: motion.attitude,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: motion.global_position_int,
    dialect.MAVLINK_MSG_ID_HIGHRES_IMU: motion.highres_imu,
    TIMESYNC_ID: timesync,
    dialect.MAVLINK_MSG_ID_ALTITUDE: motion.altitude,
    dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET: motion.attitude_target,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: motion.position_target_local_ned,
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: motion.servo_output_raw,
    dialect.MAVLINK_MSG_ID_VFR_HUD: motion.vfr_hud,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: motion.gps_raw_int,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: status.sys_status,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: status.extended_sys_state,
    dialect.MAVLINK_MSG_ID_SYSTEM_TIME: status.system_time,
    PING_ID: ping,
    dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS: status.estimator_status,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: status.battery_status,
    dialect.MAVLINK_MSG_ID_HOME_POSITION: status.home_position,
    dialect.MAVLINK_MSG_ID_VIBRATION: status.vibration,
    dialect.MAVLINK_MSG_ID_CURRENT_MODE: status.current_mode,
    dialect.MAVLINK_MSG_ID_HIL_STATE_QUATERNION: truth.hil_state_quaternion,
}
"""Messages of the autopilot that can be streamed, in the order in which they leave."""

REQUESTABLE: dict[int, Builder] = BUILDERS | {
    dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION: status.autopilot_version,
    300: status.protocol_version,
    dialect.MAVLINK_MSG_ID_AVAILABLE_MODES_MONITOR: status.available_modes_monitor,
    dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: status.gps_global_origin,
}
"""Messages that REQUEST_MESSAGE brings; AVAILABLE_MODES, which takes an index, besides."""

TRUTH_BUILDERS: dict[int, Builder] = {
    dialect.MAVLINK_MSG_ID_ODOMETRY: truth.truth_odometry,
    dialect.MAVLINK_MSG_ID_DEBUG_VECT: truth.wind_acceleration,
    dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT: truth.event,
}
"""Messages of the truth's component."""

TRUTH_RATES_HZ: dict[int, float] = {
    dialect.MAVLINK_MSG_ID_ODOMETRY: 100.0,
    dialect.MAVLINK_MSG_ID_DEBUG_VECT: 25.0,
    dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT: 5.0,
}

_ONBOARD_RATES_HZ: dict[int, float] = {
    HEARTBEAT_ID: 1.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE: 100.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 50.0,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 50.0,
    dialect.MAVLINK_MSG_ID_HIGHRES_IMU: 50.0,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 30.0,
    dialect.MAVLINK_MSG_ID_ODOMETRY: 30.0,
    TIMESYNC_ID: 10.0,
    dialect.MAVLINK_MSG_ID_ALTITUDE: 10.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET: 10.0,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 10.0,
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 10.0,
    dialect.MAVLINK_MSG_ID_VFR_HUD: 10.0,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: 8.0,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 5.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    dialect.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    PING_ID: 1.0,
    dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 1.0,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: 0.5,
    dialect.MAVLINK_MSG_ID_HOME_POSITION: 0.5,
    dialect.MAVLINK_MSG_ID_VIBRATION: 0.5,
    dialect.MAVLINK_MSG_ID_CURRENT_MODE: 0.5,
}
_GROUND_STATION_RATES_HZ: dict[int, float] = {
    HEARTBEAT_ID: 1.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE: 50.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 50.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET: 50.0,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 50.0,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 50.0,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 50.0,
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 50.0,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: 5.0,
    dialect.MAVLINK_MSG_ID_VFR_HUD: 4.0,
    dialect.MAVLINK_MSG_ID_ALTITUDE: 1.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 1.0,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 1.0,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: 0.5,
    dialect.MAVLINK_MSG_ID_CURRENT_MODE: 0.5,
    dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 0.5,
    dialect.MAVLINK_MSG_ID_HOME_POSITION: 0.5,
    PING_ID: 0.1,
    dialect.MAVLINK_MSG_ID_VIBRATION: 0.1,
}
RATES_HZ: dict[LinkKind, Mapping[int, float]] = {
    LinkKind.ONBOARD: _ONBOARD_RATES_HZ,
    LinkKind.GROUND_STATION: _GROUND_STATION_RATES_HZ,
}
"""Rates at which each kind of link starts, by message id."""

_EVERY_TICK_US = 4_000
_SLOW_IDS = frozenset(
    {
        dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
        dialect.MAVLINK_MSG_ID_ODOMETRY,
        dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET,
    }
)
"""These come when the estimator publishes: PX4's by default at every second tick, at 125 Hz."""


ABOUT_STATUS = frozenset({dialect.MAVLINK_MSG_ID_CURRENT_MODE})
"""PX4 sends these when its commander has published, however often they are asked for."""


_NEVER_US = 2**62

_Due = tuple[int, int, int, int, Builder]
"""When a message is due (µs), its place among those that leave together, its id, its interval, and
who makes it.  No two have the same place."""

_place = itemgetter(0)


class StreamSet:
    """The streams of one component on one link.

    Args:
        builders: messages that exist, in the order in which they leave.
        rates_hz: those that stream from the start.
        estimate_interval_us: how often the estimator publishes.
        grid_origin_us: due times are whole intervals from here.
        begin_us: nothing is due before.
        fixed: messages whose rate nobody may change.
        about_status: messages that, once due, wait until the status is published anew.
    """

    __slots__ = (
        "_about_status",
        "_builders",
        "_defaults",
        "_estimate_interval_us",
        "_fixed",
        "_grid_origin_us",
        "_intervals",
        "_queue",
        "_seen",
        "_told",
        "_waiting",
        "next_us",
    )

    def __init__(
        self,
        builders: Mapping[int, Builder],
        rates_hz: Mapping[int, float],
        estimate_interval_us: int,
        *,
        grid_origin_us: int,
        begin_us: int,
        fixed: frozenset[int] = frozenset(),
        about_status: frozenset[int] = frozenset(),
    ) -> None:
        self._about_status = about_status
        self._told: dict[int, Hashable] = {}
        self._seen: Hashable = None
        self._builders = builders
        self._defaults = {key: round(1e6 / rate) for key, rate in rates_hz.items()}
        self._estimate_interval_us = estimate_interval_us
        self._fixed = fixed
        self._grid_origin_us = grid_origin_us
        self._intervals = dict(self._defaults)
        self._queue: list[_Due] = []
        self._waiting: list[_Due] = []
        self.next_us = _NEVER_US
        """When anything is due next: before, there is no use in asking."""
        self._schedule(begin_us)

    def interval_us(self, message_id: int) -> int | None:
        """The interval asked for; -1 when stopped, None for a message that is no stream."""
        if message_id not in self._builders:
            return None
        return self._intervals.get(message_id, -1)

    def set_interval(self, message_id: int, interval_us: int, now_us: int) -> bool:
        """Change a rate: negative stops, 0 restores.  False if there is no such stream."""
        if message_id not in self._builders or message_id in self._fixed:
            return False
        if interval_us == 0:
            interval_us = self._defaults.get(message_id, -1)
        if interval_us < 0:
            self._intervals.pop(message_id, None)
        else:
            self._intervals[message_id] = interval_us
        self._schedule(now_us)
        return True

    def due(
        self, now_us: int, published: Callable[[], Hashable] = lambda: None
    ) -> Sequence[Builder]:
        """Builders of the messages that are due now; call it at every tick from `next_us` on.

        Args:
            now_us: boot time.
            published: differs as soon as the status was published anew.
        """
        queue = self._queue
        if self._waiting:
            status = published()
            if status != self._seen:
                for entry in self._waiting:
                    heappush(queue, entry)
                self._waiting = []
            elif not queue or queue[0][0] > now_us:
                return ()
        ready: list[tuple[int, Builder]] = []
        about_status = self._about_status
        while queue and queue[0][0] <= now_us:
            due_us, place, message_id, interval_us, builder = queue[0]
            if message_id in about_status and not self._is_news(message_id, published()):
                self._waiting.append(heappop(queue))
                continue
            ready.append((place, builder))
            due_us += interval_us
            if due_us <= now_us:  # ticks were skipped: do not send in bursts
                due_us = self._next_on_grid(now_us, interval_us)
            heapreplace(queue, (due_us, place, message_id, interval_us, builder))
        self.next_us = now_us if self._waiting else queue[0][0] if queue else _NEVER_US
        if len(ready) > 1:
            ready.sort(key=_place)
        return [builder for _, builder in ready]

    def _is_news(self, message_id: int, status: Hashable) -> bool:
        self._seen = status
        if message_id in self._told and self._told[message_id] == status:
            return False
        self._told[message_id] = status
        return True

    def _schedule(self, now_us: int) -> None:
        self._queue, self._waiting = [], []
        for place, (message_id, builder) in enumerate(self._builders.items()):
            asked = self._intervals.get(message_id)
            if asked is not None:
                slow = message_id in _SLOW_IDS
                interval = max(asked, self._estimate_interval_us if slow else _EVERY_TICK_US)
                due_us = self._next_on_grid(now_us, interval)
                self._queue.append((due_us, place, message_id, interval, builder))
        heapify(self._queue)
        self.next_us = self._queue[0][0] if self._queue else _NEVER_US

    def _next_on_grid(self, now_us: int, interval_us: int) -> int:
        origin_us = self._grid_origin_us
        steps = (now_us - origin_us) // interval_us + 1
        return origin_us + steps * interval_us
