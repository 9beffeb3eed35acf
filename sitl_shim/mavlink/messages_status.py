"""Messages about what the vehicle is and what state it is in.

Field meanings: https://mavlink.io/en/messages/common.html.
"""

import math

from sitl_shim.autopilot.mission_plan import MissionState
from sitl_shim.frames import attitude_to_wire, swap_enu_ned
from sitl_shim.mavlink.geodesy import global_position
from sitl_shim.mavlink.packets import Layout, Packet
from sitl_shim.mavlink.protocol_version import ProtocolVersion
from sitl_shim.mavlink.wire import Message, dialect
from sitl_shim.simulation import Simulation

_SYS_STATUS = Layout(dialect.MAVLink_sys_status_message)
_EXTENDED_STATE = Layout(dialect.MAVLink_extended_sys_state_message)

_MAVLINK_VERSION = 3
_CAPABILITIES = 0xE8FF
_FLIGHT_SW_VERSION = 17891392
_UID = 5283920058631409231
_EPOCH_UNIX_US = 1_767_225_600_000_000
"""Wall time of every boot, the beginning of 2026: a simulation has no business with today."""
_UNKNOWN_TOTAL = 65535
_IN_MISSION_MODE, _MISSION_SUSPENDED = 1, 2
_ESTIMATOR_ALL_GOOD = 1023
_LOCAL_POSITION_FLAGS, _GLOBAL_POSITION_FLAGS = 2 | 8 | 256, 16 | 512


def heartbeat(sim: Simulation) -> Message:
    """HEARTBEAT (0)."""
    beat = sim.autopilot.heartbeat
    return dialect.MAVLink_heartbeat_message(
        beat.vehicle_type,
        beat.autopilot,
        beat.base_mode,
        beat.custom_mode,
        beat.system_status,
        _MAVLINK_VERSION,
    )


def sys_status(sim: Simulation) -> Packet:
    """SYS_STATUS (1)."""
    sensors = sim.autopilot.sensor_health
    content = _SYS_STATUS.pack(
        sensors.present,
        sensors.enabled,
        sensors.health,
        180,  # load, per mille
        round(sim.battery.voltage_v * 1000.0),
        -1,  # current is not measured
        0,
        0,
        0,
        0,
        0,
        0,
        _battery_percent(sim),
        0,
        0,
        1,
    )
    return Packet(_SYS_STATUS, content)


def battery_status(sim: Simulation) -> Message:
    """BATTERY_STATUS (147)."""
    millivolts = round(sim.battery.voltage_v * 1000.0)
    return dialect.MAVLink_battery_status_message(
        0,
        1,  # for all flight systems
        1,  # lithium polymer
        32767,
        [millivolts, *([65535] * 9)],
        -1,
        -1,
        -1,
        _battery_percent(sim),
        0,
        1,
    )


def system_time(sim: Simulation) -> Message:
    """SYSTEM_TIME (2)."""
    return dialect.MAVLink_system_time_message(_EPOCH_UNIX_US + sim.elapsed_us, sim.stamp_ms)


def extended_sys_state(sim: Simulation) -> Packet:
    """EXTENDED_SYS_STATE (245)."""
    return Packet(_EXTENDED_STATE, _EXTENDED_STATE.pack(0, sim.autopilot.landed_state))


def current_mode(sim: Simulation) -> Message:
    """CURRENT_MODE (436)."""
    autopilot = sim.autopilot
    return dialect.MAVLink_current_mode_message(
        autopilot.standard_mode,
        autopilot.heartbeat.custom_mode,
        autopilot.intended_custom_mode,
    )


def available_modes(sim: Simulation, index: int) -> Message | None:
    """AVAILABLE_MODES (435) of one row, counted from 1; None past the end."""
    rows = sim.autopilot.available_modes
    if not 1 <= index <= len(rows):
        return None
    row = rows[index - 1]
    return dialect.MAVLink_available_modes_message(
        len(rows), index, row.standard_mode, row.custom_mode, row.properties, row.name.encode()
    )


def available_modes_monitor(_: Simulation) -> Message:
    """AVAILABLE_MODES_MONITOR (437): the modes that there are never change."""
    return dialect.MAVLink_available_modes_monitor_message(0)


def mission_current(
    sim: Simulation, *, uncounted: int = 0, total_of_none: int = _UNKNOWN_TOTAL
) -> Message:
    """MISSION_CURRENT (42).

    Args:
        sim: of the vehicle.
        uncounted: items of the mission that the total leaves out.
        total_of_none: the total where there is no mission.
    """
    plan = sim.autopilot.mission
    total = len(plan) - uncounted if plan.items else total_of_none
    mode = _IN_MISSION_MODE if plan.state is MissionState.ACTIVE else _MISSION_SUSPENDED
    return dialect.MAVLink_mission_current_message(plan.current, total, plan.state.value, mode)


def home_position(sim: Simulation) -> Message | None:
    """HOME_POSITION (242); None until home is known."""
    home = sim.autopilot.home_enu_m
    if home is None:
        return None
    latitude, longitude, altitude_mm = global_position(sim.origin, home)
    x, y, z = swap_enu_ned(home)
    q = attitude_to_wire(sim.autopilot.home_attitude_flu_to_enu)
    return dialect.MAVLink_home_position_message(
        latitude, longitude, altitude_mm, x, y, z, q, 0.0, 0.0, 0.0, sim.stamp_us
    )


def gps_global_origin(sim: Simulation) -> Message:
    """GPS_GLOBAL_ORIGIN (49)."""
    latitude, longitude, altitude_mm = global_position(sim.origin, (0.0, 0.0, 0.0))
    return dialect.MAVLink_gps_global_origin_message(latitude, longitude, altitude_mm, sim.stamp_us)


def estimator_status(sim: Simulation) -> Message:
    """ESTIMATOR_STATUS (230)."""
    return dialect.MAVLink_estimator_status_message(
        sim.stamp_us, _estimator_flags(sim), 0.01, 0.04, 0.02, 0.07, 0.0, math.nan, 0.29, 0.06
    )


def _estimator_flags(sim: Simulation) -> int:
    """ESTIMATOR_STATUS_FLAGS, less what the estimator does not know."""
    flags = _ESTIMATOR_ALL_GOOD
    if not sim.estimate.local_position_valid:
        flags &= ~_LOCAL_POSITION_FLAGS
    if not sim.estimate.global_position_valid:
        flags &= ~_GLOBAL_POSITION_FLAGS
    return flags


def vibration(sim: Simulation) -> Message:
    """VIBRATION (241): that of rotors that are in balance."""
    turning = 1.0 if sim.autopilot.armed else 0.1
    return dialect.MAVLink_vibration_message(
        sim.stamp_us, 0.0, 0.1 * turning, 1.4 * turning, 0, 0, 0
    )


def autopilot_version(_: Simulation) -> Message:
    """AUTOPILOT_VERSION (148)."""
    nothing = bytes(8)
    return dialect.MAVLink_autopilot_version_message(
        _CAPABILITIES,
        _FLIGHT_SW_VERSION,
        _FLIGHT_SW_VERSION,
        0,
        1,
        nothing,
        nothing,
        nothing,
        0,
        0,
        _UID,
    )


def protocol_version(_: Simulation) -> Message:
    """PROTOCOL_VERSION (300)."""
    return ProtocolVersion()


def _battery_percent(sim: Simulation) -> int:
    return max(0, min(100, round(sim.battery.remaining * 100.0)))
