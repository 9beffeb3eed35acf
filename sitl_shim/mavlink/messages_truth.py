"""The simulator's truth: for recorders and judges, never for controllers.

Once as PX4's simulator gives it (HIL_STATE_QUATERNION: steps of 1.1 cm and 1 cm/s, no time),
and once exactly, from a component of its own (ODOMETRY in float metres with the autopilot's
time, the acceleration that the wind causes as DEBUG_VECT, and the events of the scenario
and of the faults as NAMED_VALUE_FLOAT).
"""

import math

from sitl_shim.frames import attitude_to_wire, rotate_inverse, swap_enu_ned, swap_flu_frd
from sitl_shim.mavlink.geodesy import global_position
from sitl_shim.mavlink.integers import int16, uint16
from sitl_shim.mavlink.messages_motion import ODOMETRY
from sitl_shim.mavlink.packets import Layout, Packet
from sitl_shim.mavlink.wire import Message, dialect
from sitl_shim.simulation import Simulation

TRUTH_COMPONENT_ID = 240
"""Component that sends the exact truth."""

_GRAVITY_M_S2 = 9.80665
_FRAME_LOCAL_NED = 1
_ESTIMATOR_NAIVE = 1
_EXACT = bytes(42 * 4)
"""Both covariances of ODOMETRY."""
_DEBUG_VECT = Layout(dialect.MAVLink_debug_vect_message)
_WIND = b"wind_acc"
_EVENT_PERIOD_US = 200_000


def truth_odometry(sim: Simulation) -> Packet:
    """ODOMETRY (331) of the true state, in the frames of the autopilot's own ODOMETRY."""
    state = sim.state
    x, y, z = swap_enu_ned(state.position_enu_m)
    vx, vy, vz = swap_enu_ned(state.velocity_enu_m_s)
    p, q, r = swap_flu_frd(state.rate_flu_rad_s)
    content = ODOMETRY.pack(
        sim.stamp_us,
        x,
        y,
        z,
        *attitude_to_wire(state.attitude_flu_to_enu),
        vx,
        vy,
        vz,
        p,
        q,
        r,
        _EXACT,
        _FRAME_LOCAL_NED,
        _FRAME_LOCAL_NED,
        0,
        _ESTIMATOR_NAIVE,
        100,
    )
    return Packet(ODOMETRY, content)


def wind_acceleration(sim: Simulation) -> Packet:
    """DEBUG_VECT (250) ``wind_acc``: what the wind does to the vehicle, NED, m/s²."""
    x, y, z = swap_enu_ned(sim.state.wind_acceleration_enu_m_s2)
    return Packet(_DEBUG_VECT, _DEBUG_VECT.pack(sim.stamp_us, x, y, z, _WIND))


def event(sim: Simulation) -> Message | None:
    """NAMED_VALUE_FLOAT (251) of an event of the scenario or of the faults, at its time.

    They are told again and again, in turn, so that one that is lost on its way is missed by nobody.
    """
    events = sim.happened
    if not events:
        return None
    told = events[sim.elapsed_us // _EVENT_PERIOD_US % len(events)]
    return dialect.MAVLink_named_value_float_message(
        round(told.time_s * 1e3) & 0xFFFFFFFF, told.name.encode(), told.value
    )


def hil_state_quaternion(sim: Simulation) -> Message:
    """HIL_STATE_QUATERNION (115) as PX4's simulator fills it: no time, coarse steps."""
    state = sim.state
    latitude, longitude, altitude_mm = global_position(sim.origin, state.position_enu_m)
    vx, vy, vz = swap_enu_ned(state.velocity_enu_m_s)
    frd_to_ned = attitude_to_wire(state.attitude_flu_to_enu)
    ax, ay, az = swap_enu_ned(state.acceleration_enu_m_s2)
    force = rotate_inverse(frd_to_ned, (ax, ay, az - _GRAVITY_M_S2))
    p, q, r = swap_flu_frd(state.rate_flu_rad_s)
    speed = uint16(math.sqrt(vx * vx + vy * vy + vz * vz) * 100.0)
    mg = [int16(component / _GRAVITY_M_S2 * 1000.0) for component in force]
    return dialect.MAVLink_hil_state_quaternion_message(
        0,
        frd_to_ned,
        p,
        q,
        r,
        latitude,
        longitude,
        altitude_mm,
        int16(vx * 100.0),
        int16(vy * 100.0),
        int16(vz * 100.0),
        speed,
        speed,
        *mg,
    )
