"""MPC-L1+ from validated configuration."""

import math

from companion.config.models import (
    ControllerConfig,
    DynamicsConfig,
    MissionConfig,
    NoiseConfig,
    ResponseConfig,
    VehicleConfig,
)
from companion.config.plus_models import PlusConfig
from companion.config.yaml_source import ConfigError
from companion.control.attitude import AttitudeGains
from companion.control.frameworks import Limits
from companion.control.plus.constrained import Horizon
from companion.control.plus.feedback import FeedbackSettings
from companion.control.plus.lag import LagSettings
from companion.control.plus.mismatch import MismatchSettings
from companion.control.plus.nominal_plant import Actuation, Interface, NominalPlant
from companion.control.plus.planner import Planner, PlannerLimits
from companion.control.plus.predictor import PredictorNoise
from companion.control.plus.settings import PlusSettings
from companion.control.plus.stack import PlusStack
from companion.control.qp.port import QpSolverFactory
from companion.control.thrust import GRAVITY_M_S2
from companion.control.thrust_laws import ThrustLaw
from companion.control.yaw import YawGains
from companion.thrust_meaning import COLLECTIVE, ThrustMeaning

_UNKNOWN_NOISE = NoiseConfig(
    position_m=(2e-3, 2e-3, 2e-3),
    velocity_m_s=(2e-2, 2e-2, 2e-2),
    acceleration_m_s2_sqrt_hz=(5e-2, 5e-2, 5e-2),
    tilt_rad=2e-3,
)
"""Of a vehicle whose file states none: a careful guess."""
_LEAST_DENSITY = 0.01
"""m/s² per √Hz."""
Triple = tuple[float, float, float]
_REMEDY = "`companion identify` finds it and writes it."


def make_plus_stack(
    controller: ControllerConfig,
    vehicle: VehicleConfig,
    mission: MissionConfig,
    law: ThrustLaw,
    thrust: ThrustMeaning,
    attitude_loop: AttitudeGains | None,
    make_solver: QpSolverFactory,
    *,
    cautious: bool,
) -> PlusStack:
    """MPC-L1+ on what the vehicle's file says of its dynamics.

    Args:
        controller: with the section `plus`.
        vehicle: with `dynamics`.
        mission: its geofence.
        law: makes the thrust field.
        thrust: what the autopilot makes of that.
        attitude_loop: the companion's own, or None.
        make_solver: sets QP solvers up.
        cautious: with the bandwidths lowered.

    Raises:
        ConfigError: the vehicle's file says too little, or no gains can be reckoned.
    """
    plus, dynamics = controller.plus, vehicle.dynamics
    assert plus is not None
    if dynamics is None:
        raise ConfigError(
            f"mpc-l1-plus flies on the dynamics of the vehicle, and the file of '{vehicle.name}' "
            f"has no `dynamics`. {_REMEDY}"
        )
    climbing = thrust.kind == "climb_rate"
    if climbing and plus.climb_rate is not None:
        plus = _over_a_climb_rate(plus)
    if cautious:
        plus = _cautious(plus)
    plant = nominal_plant(vehicle, dynamics, thrust)
    noise = vehicle.noise or _UNKNOWN_NOISE
    climb, descent = vehicle.climb_limit_m_s, vehicle.descent_limit_m_s
    if climbing:
        climb, descent = min(climb, thrust.climb_m_s), min(descent, thrust.descent_m_s)
        vertical = (-descent, climb)
    else:
        most = controller.thrust.maximum_acceleration_m_s2
        vertical = (-most, most)
    tilt_limit = math.radians(vehicle.tilt_limit_deg)
    force = GRAVITY_M_S2 * plant.tilt_gain
    speed, fence = vehicle.speed_limit_m_s, mission.geofence
    settings = PlusSettings(
        plant=plant,
        quadratic_drag_1_m=dynamics.quadratic_drag_1_m,
        noise=PredictorNoise(
            noise.position_m,
            noise.velocity_m_s,
            _at_least(noise.acceleration_m_s2_sqrt_hz),
            plus.sigma_walk,
        ),
        low_pass_rad_s=plus.low_pass_rad_s,
        sigma_bound_m_s2=plus.sigma_bound_m_s2,
        tilt_rate_limit_rad_s=plus.tilt_rate_limit_rad_s,
        vertical_limit=vertical,
        lag=None if plus.lag is None else LagSettings(**plus.lag.model_dump()),
        mismatch=None if plus.mismatch is None else MismatchSettings(**plus.mismatch.model_dump()),
    )
    try:
        planner = Planner(
            FeedbackSettings(plus.bandwidth_rad_s, plus.rate_time_s, 1.0 / mission.state_rate_hz),
            plant,
            Horizon(plus.step_s, plus.horizon),
            PlannerLimits(
                horizontal_m_s2=force * math.tan(tilt_limit),
                horizontal_rate_m_s3=force * plus.tilt_rate_limit_rad_s,
                vertical_low=vertical[0],
                vertical_high=vertical[1],
                speed_m_s=(speed, speed, max(climb, descent)),
                box_low_m=fence.low_m,
                box_high_m=fence.high_m,
            ),
            dynamics.quadratic_drag_1_m,
            make_solver,
        )
    except ValueError as error:
        raise ConfigError(f"section plus: {error}.") from error
    return PlusStack(
        settings=settings,
        planner=planner,
        thrust=law,
        yaw=YawGains(controller.yaw.gain, controller.yaw.rate_limit_rad_s),
        limits=Limits(tilt_limit, climb, descent),
        attitude_loop=attitude_loop,
    )


def _at_least(densities: Triple) -> Triple:
    """Densities of unexplained acceleration; calmer than a certain one is no air."""
    x, y, z = (max(_LEAST_DENSITY, density) for density in densities)
    return x, y, z


def nominal_plant(
    vehicle: VehicleConfig, dynamics: DynamicsConfig, thrust: ThrustMeaning
) -> NominalPlant:
    """The model of a vehicle under an autopilot's meaning of the thrust field.

    Raises:
        ConfigError: its file does not say how its thrust answers.
    """
    interface: Interface = "climb_rate" if thrust.kind == "climb_rate" else "acceleration"
    vertical = dynamics.climb if interface == "climb_rate" else dynamics.lift
    if vertical is None:
        raise ConfigError(
            f"mpc-l1-plus commands thrust here, and the file of '{vehicle.name}' does not say how "
            f"the vehicle answers it: `dynamics.lift` is missing. {_REMEDY}"
        )
    return NominalPlant(
        tilt=_actuation(dynamics.attitude, "acceleration"),
        vertical=_actuation(vertical, interface),
        linear_drag_1_s=dynamics.linear_drag_1_s,
        tilt_gain=dynamics.tilt_gain,
    )


def thrust_before_asking(vehicle: VehicleConfig) -> ThrustMeaning:
    """What to take the thrust field for until the autopilot has been asked.

    A vehicle that was identified over climb rates alone can't be reckoned with otherwise.
    """
    dynamics = vehicle.dynamics
    if dynamics is not None and dynamics.lift is None:
        return ThrustMeaning("climb_rate", vehicle.climb_limit_m_s, vehicle.descent_limit_m_s)
    return COLLECTIVE


def _actuation(response: ResponseConfig, interface: Interface) -> Actuation:
    return Actuation(
        response.natural_frequency_rad_s, response.damping, response.delay_s, interface
    )


def _over_a_climb_rate(plus: PlusConfig) -> PlusConfig:
    z = plus.climb_rate
    assert z is not None
    return plus.model_copy(
        update={
            key: (*getattr(plus, key)[:2], getattr(z, key))
            for key in ("bandwidth_rad_s", "rate_time_s", "low_pass_rad_s", "sigma_walk")
        }
    )


def _cautious(plus: PlusConfig) -> PlusConfig:
    return plus.model_copy(
        update={
            key: tuple(plus.caution * value for value in getattr(plus, key))
            for key in ("bandwidth_rad_s", "low_pass_rad_s", "sigma_walk")
        }
    )
