"""A person's own controller, in the place of the configured one: the stacks that fly it.

Only for simulated flights: see docs/decisions/0024.
"""

import math
from dataclasses import dataclass, replace

from companion.config.resolve import FlightConfig
from companion.control.frameworks import Limits
from companion.control.own_controller import Controller, OwnStack
from companion.control.yaw import YawGains
from companion.flight.assemble import attitude_gains, thrust_law
from companion.flight.stacks import NamedStack, Stacks, make_stacks
from companion.thrust_meaning import ThrustMeaning


@dataclass(frozen=True, slots=True)
class OwnController:
    """A controller, what it is called, and whether another one stands by."""

    controller: Controller
    name: str
    fallback: str | None
    """What the configured controller is called, which takes over if this one fails or the monitor
    says so; None: nothing is below it but the supervisor's ladder."""


def own_stacks(config: FlightConfig, own: OwnController, thrust: ThrustMeaning) -> Stacks:
    """The stacks of a flight by a controller of one's own.

    Limits, thrust loop and yaw law are those of the vehicle's and the configured controller's file.

    Args:
        config: mission, vehicle, and the controller that it falls back to.
        own: the controller.
        thrust: what the autopilot makes of the thrust field.

    Raises:
        ConfigError: see `make_stacks`.
    """
    mission, vehicle, gains = config.mission, config.vehicle, config.controller
    climb, descent = vehicle.climb_limit_m_s, vehicle.descent_limit_m_s
    if thrust.kind == "climb_rate":
        climb, descent = min(climb, thrust.climb_m_s), min(descent, thrust.descent_m_s)
    stack = OwnStack(
        controller=own.controller,
        thrust=thrust_law(gains.thrust, vehicle, thrust),
        yaw=YawGains(gains.yaw.gain, gains.yaw.rate_limit_rad_s),
        limits=Limits(math.radians(vehicle.tilt_limit_deg), climb, descent),
        vertical_limit_m_s2=gains.thrust.maximum_acceleration_m_s2,
        attitude_loop=attitude_gains(vehicle) if mission.setpoint == "rates" else None,
    )
    flown = NamedStack(own.name, stack)
    stacks = make_stacks(config, thrust=thrust)
    if own.fallback is None:
        return replace(stacks, ladder=(flown,))
    below = replace(stacks.ladder[-1], name=own.fallback, level="robust")
    return replace(stacks, ladder=(flown, below))
