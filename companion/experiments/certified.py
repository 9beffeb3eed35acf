"""What is certified, from configuration: the law that flies, its constraints far away."""

from companion.config.models import GeofenceConfig
from companion.config.resolve import FlightConfig
from companion.config.yaml_source import ConfigError
from companion.control.inner import L1Controller
from companion.control.interfaces import OuterController
from companion.control.plus.stack import PlusStack
from companion.flight.assemble import make_paper_stack, make_stack
from companion.flight.assemble_plus import thrust_before_asking
from companion.theory.certificate import Subject
from companion.theory.envelope import Air, ThrustLoop
from companion.theory.plus_certificate import PlusSubject

_FAR = 1e6


def certificate_subject(config: FlightConfig, wind_m_s: float) -> Subject:
    """What is certified.

    Args:
        config: of the controller, the vehicle, and the rate of the state's samples.
        wind_m_s: largest wind that the drag and the bounds reckon with.

    Raises:
        ConfigError: no L1 controller, or a vehicle without stated dynamics.
    """
    controller, vehicle = config.controller, config.vehicle
    if controller.l1 is None:
        raise ConfigError(
            f"{config.mission.controller}: certify speaks of L1 controllers, and the framework "
            f"{controller.framework} has none: there is no norm condition to check. Give a "
            "controller of the frameworks mpc-l1-plus, mpc-l1, pid-l1, lqr-l1 or l1."
        )
    if vehicle.dynamics is None:
        raise ConfigError(
            f"{config.mission.vehicle}: the vehicle's file has no section 'dynamics', so that A(s) "
            "is not known. Let `companion identify` find it, or state it."
        )
    inner, outer = _unlimited(config)
    return Subject(
        gains=inner.gains,
        outer=outer,
        vehicle=vehicle,
        dynamics=vehicle.dynamics,
        thrust=ThrustLoop(
            controller.thrust.proportional, controller.thrust.maximum_acceleration_m_s2
        ),
        air=Air(wind_m_s=wind_m_s),
        sample_s=1.0 / config.mission.state_rate_hz,
    )


def plus_subject(config: FlightConfig, wind_m_s: float) -> PlusSubject:
    """What is certified of MPC-L1+; arguments as for `certificate_subject`.

    The thrust field is taken for what the vehicle's file says that it is.

    Raises:
        ConfigError: the vehicle's file says too little.
    """
    controller, vehicle = config.controller, config.vehicle
    thrust = thrust_before_asking(vehicle)
    stack, cautious = (
        make_stack(controller, vehicle, config.mission, thrust=thrust, cautious=careful)
        for careful in (False, True)
    )
    assert isinstance(stack, PlusStack)
    assert isinstance(cautious, PlusStack)
    assert vehicle.dynamics is not None
    return PlusSubject(
        stack=stack,
        cautious=cautious,
        vehicle=vehicle,
        dynamics=vehicle.dynamics,
        air=Air(wind_m_s=wind_m_s),
        sample_s=1.0 / config.mission.state_rate_hz,
    )


def _unlimited(config: FlightConfig) -> tuple[L1Controller, OuterController]:
    """The laws with their constraints far away: what is linear is certified."""
    vehicle = config.vehicle.model_copy(
        update={"speed_limit_m_s": _FAR, "climb_limit_m_s": _FAR, "descent_limit_m_s": _FAR}
    )
    everywhere = GeofenceConfig(low_m=(-_FAR, -_FAR, -_FAR), high_m=(_FAR, _FAR, _FAR))
    mission = config.mission.model_copy(update={"geofence": everywhere})
    controller = config.controller
    if controller.mpc is not None:
        mpc = controller.mpc.model_copy(update={"r_max_m_s2": _FAR})
        controller = controller.model_copy(update={"mpc": mpc})
    stack = make_paper_stack(controller, vehicle, mission)
    assert isinstance(stack.inner, L1Controller)
    return stack.inner, stack.outer
