"""From validated configuration to the objects that fly."""

import math
import tempfile
from pathlib import Path

from companion.config.models import (
    ControllerConfig,
    L1Config,
    MissionConfig,
    MpcConfig,
    PidConfig,
    ThrustConfig,
    TransferFunctionConfig,
    VehicleConfig,
)
from companion.config.resolve import FlightConfig
from companion.config.yaml_source import ConfigError
from companion.control.attitude import AttitudeGains
from companion.control.feedback import FeedbackController, direct
from companion.control.flight_stack import FlightStack
from companion.control.frameworks import Limits, Stack
from companion.control.inner import L1Controller, PidController, y_tilde_bounds_m_s
from companion.control.interfaces import InnerController, OuterController
from companion.control.l1_adaptive import L1Gains
from companion.control.lqr import LqrWeights, lqr_gains
from companion.control.mpc import Mpc, MpcSettings
from companion.control.pid import PidGains
from companion.control.qp.condensed import Weights
from companion.control.qp.port import QpSolverFactory
from companion.control.qp.solvers import SolverName, solver_factory
from companion.control.reference_model import PositionModel
from companion.control.thrust import ThrustGains
from companion.control.thrust_laws import (
    ClimbRateField,
    CollectiveThrust,
    ThrustLaw,
    VerticalThrust,
)
from companion.control.transfer_function import TransferFunction, first_order
from companion.control.yaw import YawGains
from companion.extras import install_extra
from companion.flight.assemble_plus import make_plus_stack
from companion.flight.setpoints.placement import (
    PlacedTrajectory,
    Placement,
    about_anchor,
    known_heading_rad,
    place,
)
from companion.flight.setpoints.supervisor import SupervisorLimits
from companion.thrust_meaning import COLLECTIVE, ThrustMeaning
from companion.trajectories.feasibility import (
    Fence,
    MotionLimits,
    fence_problems_of,
    problems_of,
)
from companion.trajectories.from_file import load_trajectory
from companion.trajectories.harmonic import TEST_TRAJECTORIES
from companion.trajectories.trajectory import Trajectory

_USUAL_VELOCITY_NOISE_M_S = (0.02, 0.02, 0.02)
"""Of the reported velocity, of a vehicle whose file states none."""


def make_trajectory(mission: MissionConfig) -> Trajectory:
    """The trajectory that a mission names.

    Raises:
        TrajectoryFileError: a file that can't be used, or a number that no test trajectory has.
    """
    if isinstance(mission.trajectory, int):
        return TEST_TRAJECTORIES[mission.trajectory]
    return load_trajectory(Path(mission.trajectory))


def recorded_trajectory(config: FlightConfig, text: str) -> Trajectory:
    """The trajectory of a recorded flight, whose file is in the log.

    Args:
        config: the flight's.
        text: of the trajectory's file; empty for one of the test trajectories.

    Raises:
        TrajectoryFileError: the text is none of a trajectory.
        OSError: there is no room for a temporary file.
    """
    mission = config.mission
    if isinstance(mission.trajectory, int):
        return make_trajectory(mission)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / Path(mission.trajectory).name
        path.write_text(text, encoding="utf-8")
        return load_trajectory(path)


def infeasibilities(
    trajectory: Trajectory, mission: MissionConfig, vehicle: VehicleConfig
) -> list[str]:
    """What of a trajectory does not fit the vehicle or the geofence, in sentences.

    Whether it fits the geofence is known only with its heading; with one that is the vehicle's
    `fence_infeasibilities` tells at engagement.
    """
    limits = MotionLimits(vehicle.speed_limit_m_s, vehicle.acceleration_limit_m_s2)
    found = problems_of(trajectory, limits)
    if known_heading_rad(mission.origin) is not None:
        found += fence_infeasibilities(trajectory, mission, place(mission.origin, None, 0.0))
    return found


def fence_infeasibilities(
    trajectory: Trajectory, mission: MissionConfig, placement: Placement
) -> list[str]:
    """What of a trajectory, placed, does not fit the geofence; told about the fence's anchor."""
    placed = PlacedTrajectory(trajectory, about_anchor(placement))
    return fence_problems_of(placed, Fence(mission.geofence.low_m, mission.geofence.high_m))


def make_stack(
    controller: ControllerConfig,
    vehicle: VehicleConfig,
    mission: MissionConfig,
    make_solver: QpSolverFactory | None = None,
    *,
    thrust: ThrustMeaning = COLLECTIVE,
    cautious: bool = False,
) -> FlightStack:
    """The stack of control laws that a controller's file describes.

    Args:
        controller: its gains.
        vehicle: its limits.
        mission: its geofence.
        make_solver: a solver in place of the one that the controller's file names.
        thrust: what the autopilot makes of the thrust field.
        cautious: the same with less gain, of a framework that has such a variant.

    Raises:
        ConfigError: transfer functions or weights that the laws are not made for, a solver that
            is not installed, or setpoints of body rates without an attitude loop.
    """
    if controller.plus is not None:
        return make_plus_stack(
            controller,
            vehicle,
            mission,
            thrust_law(controller.thrust, vehicle, thrust),
            thrust,
            attitude_gains(vehicle) if mission.setpoint == "rates" else None,
            make_solver or _solver("plus", controller.plus.solver),
            cautious=cautious,
        )
    return make_paper_stack(controller, vehicle, mission, make_solver, thrust=thrust)


def make_paper_stack(
    controller: ControllerConfig,
    vehicle: VehicleConfig,
    mission: MissionConfig,
    make_solver: QpSolverFactory | None = None,
    *,
    thrust: ThrustMeaning = COLLECTIVE,
) -> Stack:
    """The stack of an outer and an inner controller; arguments as for `make_stack`.

    Raises:
        ConfigError: the controller is none of these, or as for `make_stack`.
    """
    if controller.plus is not None:
        raise ConfigError(
            "this needs a controller of an outer and an inner loop, which mpc-l1-plus is not. "
            "Name another one, mpc-l1 for instance."
        )
    climb, descent = vehicle.climb_limit_m_s, vehicle.descent_limit_m_s
    if thrust.kind == "climb_rate":
        climb, descent = min(climb, thrust.climb_m_s), min(descent, thrust.descent_m_s)
        controller = _over_the_autopilots_loop(controller)
    return Stack(
        outer=_outer(controller, vehicle, mission, make_solver),
        inner=_inner(controller, vehicle),
        thrust=thrust_law(controller.thrust, vehicle, thrust),
        yaw=YawGains(controller.yaw.gain, controller.yaw.rate_limit_rad_s),
        limits=Limits(math.radians(vehicle.tilt_limit_deg), climb, descent),
        attitude_loop=attitude_gains(vehicle) if mission.setpoint == "rates" else None,
    )


def _over_the_autopilots_loop(controller: ControllerConfig) -> ControllerConfig:
    """The controller with the gains of its vertical axis that go with a climb-rate field."""
    l1 = controller.l1
    if l1 is None or l1.climb_rate is None:
        return controller
    z = l1.climb_rate
    values = {"k": (*l1.k[:2], z.k), "gamma": (*l1.gamma[:2], z.gamma)}
    values["sigma_bound"] = (*l1.sigma_bound[:2], z.sigma_bound)
    if l1.m is not None:
        values["m"] = (*l1.m[:2], z.m)
    if l1.omega is not None:
        values["omega"] = (*l1.omega[:2], z.omega)
    slower = l1.model_copy(update=values)
    return controller.model_copy(update={"l1": slower})


def attitude_gains(vehicle: VehicleConfig) -> AttitudeGains:
    """The vehicle's attitude loop.

    Raises:
        ConfigError: its file has none.
    """
    loop = vehicle.attitude_loop
    if loop is None:
        raise ConfigError(
            f"the vehicle '{vehicle.name}' states no attitude loop of the companion's, which "
            "setpoints of body rates need. Add `attitude_loop` to its file, or leave "
            "`setpoint: rates` out."
        )
    return AttitudeGains(
        loop.tilt_gain_1_s,
        loop.yaw_gain_1_s,
        loop.tilt_rate_limit_rad_s,
        loop.yaw_rate_limit_rad_s,
    )


def thrust_law(loop: ThrustConfig, vehicle: VehicleConfig, meaning: ThrustMeaning) -> ThrustLaw:
    """What makes the thrust field, by what the autopilot makes of it."""
    if meaning.kind == "climb_rate":
        return ClimbRateField(meaning.climb_m_s, meaning.descent_m_s)
    collective = CollectiveThrust(
        ThrustGains(
            proportional=loop.proportional,
            integral=loop.integral,
            hover_thrust=vehicle.hover_thrust,
            thrust_curve=vehicle.thrust_curve,
            minimum_thrust=vehicle.minimum_thrust,
            maximum_thrust=vehicle.maximum_thrust,
            maximum_acceleration_m_s2=loop.maximum_acceleration_m_s2,
            hover_drift=loop.hover_drift,
            acceleration_noise_m_s2=loop.acceleration_noise_m_s2,
        )
    )
    return VerticalThrust(collective) if meaning.kind == "vertical" else collective


def l1_gains(l1: L1Config) -> L1Gains:
    """The L1 controller's gains from its section.

    Raises:
        ConfigError: an M(s) or C(s) that the law is not made for.
    """
    try:
        return L1Gains(
            reference_model=_transfer_functions(l1.m, l1.reference_model),
            low_pass=_transfer_functions(l1.omega, l1.low_pass),
            gain_k=l1.k,
            gamma=l1.gamma,
            sigma_bound=l1.sigma_bound,
            projection_margin=l1.projection_margin,
            discretisation=l1.discretisation,
        )
    except ValueError as error:
        raise ConfigError(f"section l1: {error}. Change it.") from error


def position_model(controller: ControllerConfig) -> PositionModel | None:
    """D(s) as the outer controller knows it; None if there is none of second order."""
    if controller.mpc_model is not None:
        return PositionModel(controller.mpc_model.m, controller.mpc_model.k)
    if controller.l1 is not None and controller.l1.m is not None:
        return PositionModel(controller.l1.m, controller.l1.k)
    return None


def _transfer_functions(
    bandwidths: tuple[float, ...] | None, functions: tuple[TransferFunctionConfig, ...] | None
) -> tuple[TransferFunction, ...]:
    if bandwidths is not None:
        return tuple(first_order(value) for value in bandwidths)
    assert functions is not None
    return tuple(TransferFunction(f.numerator, f.denominator) for f in functions)


def _pid_gains(pid: PidConfig) -> PidGains:
    return PidGains(pid.kp, pid.ki, pid.kd, pid.integral_limit)


def _outer(
    controller: ControllerConfig,
    vehicle: VehicleConfig,
    mission: MissionConfig,
    make_solver: QpSolverFactory | None,
) -> OuterController:
    model = position_model(controller)
    if controller.mpc is not None:
        assert model is not None
        return _mpc(controller.mpc, model, vehicle, mission, make_solver)
    if controller.outer_pid is not None:
        outer_pid = controller.outer_pid
        return FeedbackController(_pid_gains(outer_pid), derivative=outer_pid.derivative)
    if controller.lqr is not None:
        assert model is not None
        lqr = controller.lqr
        weights = LqrWeights(lqr.position, lqr.velocity, lqr.integral, lqr.reference)
        try:
            gains = lqr_gains(model, weights, lqr.period_s, lqr.integral_limit)
        except ValueError as error:
            raise ConfigError(f"section lqr: {error}.") from error
        return FeedbackController(gains, lqr.period_s)
    return direct(3)


def _inner(controller: ControllerConfig, vehicle: VehicleConfig) -> InnerController:
    if controller.l1 is not None:
        gains = l1_gains(controller.l1)
        level, climb = vehicle.speed_limit_m_s, vehicle.climb_limit_m_s
        noise, wander = _USUAL_VELOCITY_NOISE_M_S, (0.0, 0.0, 0.0)
        if vehicle.noise is not None:
            noise = vehicle.noise.velocity_m_s
            wander = vehicle.noise.acceleration_m_s2_sqrt_hz
        bounds = y_tilde_bounds_m_s(
            gains, vehicle.acceleration_limit_m_s2, (level, level, climb), noise, wander
        )
        return L1Controller(gains, bounds)
    assert controller.inner_pid is not None
    return PidController(_pid_gains(controller.inner_pid))


def _mpc(
    mpc: MpcConfig,
    model: PositionModel,
    vehicle: VehicleConfig,
    mission: MissionConfig,
    make_solver: QpSolverFactory | None,
) -> Mpc:
    speed = vehicle.speed_limit_m_s
    settings = MpcSettings(
        model=model,
        period_s=mpc.period_s,
        horizon=mpc.horizon,
        weights=Weights(mpc.q, mpc.r, mpc.s),
        r_max_m_s2=mpc.r_max_m_s2,
        velocity_limit_m_s=(speed, speed, max(vehicle.climb_limit_m_s, vehicle.descent_limit_m_s)),
        box_low_m=mission.geofence.low_m,
        box_high_m=mission.geofence.high_m,
        penalise_absolute_r=mpc.penalise == "absolute_r",
    )
    return Mpc(settings, make_solver or _solver("mpc", mpc.solver))


def _solver(section: str, name: SolverName) -> QpSolverFactory:
    """What a section's `solver` names.

    Raises:
        ConfigError: it is an extra that is not installed.
    """
    try:
        return solver_factory(name)
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"section {section}, solver: {error}. Install it: {install_extra(name)}; or take osqp."
        ) from error


def supervisor_limits(mission: MissionConfig) -> SupervisorLimits:
    """The ladder's limits."""
    s, fence = mission.supervisor, mission.geofence
    return SupervisorLimits(
        s.state_age_limit_s,
        s.hand_over_after_s,
        s.failed_solves_s,
        s.loop_delay_limit_s,
        s.jump_limit_m,
        fence.low_m,
        fence.high_m,
    )
