"""What of a configured flight the checks before it need to know."""

import math

import numpy as np

from companion.config.resolve import FlightConfig
from companion.flight.assemble import infeasibilities
from companion.flight.setpoints.placement import PlacedTrajectory, known_heading_rad, place
from companion.preflight.facts import Plan
from companion.trajectories.trajectory import Trajectory

_STEP_S = 0.05


def plan_to_check(config: FlightConfig, trajectory: Trajectory, our_system_id: int) -> Plan:
    """The plan of a flight.

    Args:
        config: mission and vehicle.
        trajectory: what is to be tracked.
        our_system_id: whose heartbeats we send.
    """
    mission, vehicle = config.mission, config.vehicle
    reach_m, height_m = _extent_m(config, trajectory)
    dynamics = vehicle.dynamics
    return Plan(
        our_system_id=our_system_id,
        setpoint=mission.setpoint,
        state_rate_hz=mission.state_rate_hz,
        state_age_limit_s=mission.supervisor.state_age_limit_s,
        hover_thrust=vehicle.hover_thrust,
        tilt_limit_deg=vehicle.tilt_limit_deg,
        climb_limit_m_s=vehicle.climb_limit_m_s,
        descent_limit_m_s=vehicle.descent_limit_m_s,
        loop_delay_s=None if dynamics is None else dynamics.loop_delay_s,
        problems=tuple(infeasibilities(trajectory, mission, vehicle)),
        reach_m=reach_m,
        height_m=height_m,
        controller=mission.controller,
        vehicle=mission.vehicle,
        certifiable=config.controller.l1 is not None,
        mocap=mission.mocap is not None,
        battery_refuse_below=mission.preflight.battery_refuse_below,
        battery_warn_below=mission.preflight.battery_warn_below,
        thrust_field=mission.preflight.thrust_field,
    )


def _extent_m(config: FlightConfig, trajectory: Trajectory) -> tuple[float, float]:
    """How far the trajectory goes from the place of take-off, and how high above the ground."""
    origin = config.mission.origin
    times = np.arange(0.0, trajectory.end_s + _STEP_S, _STEP_S)
    heading = known_heading_rad(origin)
    placed = PlacedTrajectory(trajectory, place(origin, None, 0.0))
    position = placed.position(times)
    if heading is None:  # it may be turned anyhow about its origin
        east, north, _ = origin.offset_enu_m
        own = np.hypot(*trajectory.position(times)[:, :2].T)
        reach = math.hypot(east, north) + float(own.max())
    else:
        reach = float(np.hypot(*position[:, :2].T).max())
    return reach, float(position[:, 2].max())
