"""From validated configuration to the objects that fly."""

import math
from pathlib import Path

from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.control.frameworks import Limits, MpcL1
from companion.control.l1_adaptive import L1Gains
from companion.control.mpc import Mpc, MpcSettings
from companion.control.qp.condensed import Weights
from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.qp.port import QpSolverFactory
from companion.control.thrust import ThrustGains
from companion.control.yaw import YawGains
from companion.flight.supervisor import SupervisorLimits
from companion.trajectories.feasibility import MotionLimits, problems_of
from companion.trajectories.from_file import load_trajectory
from companion.trajectories.harmonic import TEST_TRAJECTORIES
from companion.trajectories.trajectory import Trajectory

_SOLVERS = {"osqp": OsqpSolver}


def make_trajectory(mission: MissionConfig) -> Trajectory:
    """The trajectory that a mission names.

    Raises:
        TrajectoryFileError: a file that can't be used, or a number that no test trajectory has.
    """
    if isinstance(mission.trajectory, int):
        return TEST_TRAJECTORIES[mission.trajectory]
    return load_trajectory(Path(mission.trajectory))


def infeasibilities(
    trajectory: Trajectory, mission: MissionConfig, vehicle: VehicleConfig
) -> list[str]:
    """What of a trajectory does not fit the vehicle or the geofence, in sentences."""
    low, high, origin = mission.geofence.low_m, mission.geofence.high_m, mission.origin_enu_m
    limits = MotionLimits(
        vehicle.speed_limit_m_s,
        vehicle.acceleration_limit_m_s2,
        (low[0] - origin[0], low[1] - origin[1], low[2] - origin[2]),
        (high[0] - origin[0], high[1] - origin[1], high[2] - origin[2]),
    )
    return problems_of(trajectory, limits)


def make_stack(
    controller: ControllerConfig,
    vehicle: VehicleConfig,
    mission: MissionConfig,
    make_solver: QpSolverFactory | None = None,
) -> MpcL1:
    """The stack of control laws that a controller's file describes.

    Args:
        controller: its gains.
        vehicle: its limits.
        mission: its geofence.
        make_solver: a solver in place of the one that the controller's file names.
    """
    l1, mpc = controller.l1, controller.mpc
    speed = vehicle.speed_limit_m_s
    settings = MpcSettings(
        m=l1.m,
        gain_k=l1.k,
        period_s=mpc.period_s,
        horizon=mpc.horizon,
        weights=Weights(mpc.q, mpc.r, mpc.s),
        r_max_m_s2=mpc.r_max_m_s2,
        velocity_limit_m_s=(speed, speed, max(vehicle.climb_limit_m_s, vehicle.descent_limit_m_s)),
        box_low_m=mission.geofence.low_m,
        box_high_m=mission.geofence.high_m,
        penalise_absolute_r=mpc.penalise == "absolute_r",
    )
    thrust = controller.thrust
    return MpcL1(
        outer=Mpc(settings, make_solver or _SOLVERS[mpc.solver]),
        inner=L1Gains(l1.m, l1.omega, l1.k, l1.gamma, l1.sigma_bound, l1.projection_margin),
        thrust=ThrustGains(
            proportional=thrust.proportional,
            integral=thrust.integral,
            hover_thrust=vehicle.hover_thrust,
            thrust_curve=vehicle.thrust_curve,
            minimum_thrust=vehicle.minimum_thrust,
            maximum_thrust=vehicle.maximum_thrust,
            maximum_acceleration_m_s2=thrust.maximum_acceleration_m_s2,
            hover_drift=thrust.hover_drift,
            acceleration_noise_m_s2=thrust.acceleration_noise_m_s2,
        ),
        yaw=YawGains(controller.yaw.gain, controller.yaw.rate_limit_rad_s),
        limits=Limits(
            math.radians(vehicle.tilt_limit_deg), vehicle.climb_limit_m_s, vehicle.descent_limit_m_s
        ),
    )


def supervisor_limits(mission: MissionConfig) -> SupervisorLimits:
    """The ladder's limits."""
    s = mission.supervisor
    return SupervisorLimits(s.state_age_limit_s, s.hand_over_after_s, s.failed_solves_s)
