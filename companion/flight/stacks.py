"""The stacks of controllers that a flight may be flown by."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.config.monitor_models import SwitchConfig
from companion.config.relief import PLUS
from companion.config.resolve import FlightConfig
from companion.control.flight_stack import FlightStack
from companion.control.monitor import MonitorLimits
from companion.control.qp.port import QpSolverFactory
from companion.flight.assemble import make_stack
from companion.frames import Vector3
from companion.thrust_meaning import COLLECTIVE, ThrustMeaning

Level = Literal["nominal", "reduced", "robust"]
"""How much of what was configured is flown: it, the same with less gain, its fallback."""


@dataclass(frozen=True, slots=True)
class NamedStack:
    """A stack, and what a person calls it."""

    name: str
    stack: FlightStack
    level: Level = "nominal"

    def about(self, anchor_enu_m: Vector3) -> "NamedStack":
        """The same where its geofence lies about a point (ENU m)."""
        return replace(self, stack=self.stack.about(anchor_enu_m))


Ladder = tuple[NamedStack, ...]
"""As configured, then what is flown when that does not do: each more cautious than the last."""


@dataclass(frozen=True, slots=True)
class Stacks:
    """All that may fly, and when."""

    ladder: Ladder
    """Of the configured controller; never empty."""
    others: Mapping[str, Ladder] = field(default_factory=dict)
    """Of the controllers of planned hand-overs, by name."""
    switches: tuple[SwitchConfig, ...] = ()
    """Planned hand-overs, in the order of their times."""
    monitor: MonitorLimits | None = None
    """None: nobody watches."""
    acts: bool = True
    """The monitor's verdict leads down the ladder; False: it is only shown."""

    def about(self, anchor_enu_m: Vector3) -> "Stacks":
        """The same where their geofences lie about a point (ENU m)."""
        return replace(
            self,
            ladder=_about(self.ladder, anchor_enu_m),
            others={name: _about(ladder, anchor_enu_m) for name, ladder in self.others.items()},
        )


def only(stack: FlightStack, name: str = "controller") -> Stacks:
    """One stack and nothing else, unwatched."""
    return Stacks((NamedStack(name, stack),))


def make_stacks(
    config: FlightConfig,
    make_solver: QpSolverFactory | None = None,
    *,
    thrust: ThrustMeaning = COLLECTIVE,
) -> Stacks:
    """The stacks of a flight: the configured one, what it falls back to, who may relieve it.

    Args:
        config: mission, vehicle, controllers.
        make_solver: a solver in place of the ones that the controllers' files name.
        thrust: what the autopilot makes of the thrust field.

    Raises:
        ConfigError: see `make_stack`.
    """
    mission, vehicle = config.mission, config.vehicle

    def made(controller: ControllerConfig, *, cautious: bool = False) -> FlightStack:
        return make_stack(
            controller, vehicle, mission, make_solver, thrust=thrust, cautious=cautious
        )

    def ladder(name: str, controller: ControllerConfig) -> Ladder:
        rungs = [NamedStack(name, made(controller))]
        if controller.framework == PLUS:
            rungs.append(
                NamedStack(f"{name}, cautious", made(controller, cautious=True), "reduced")
            )
        if controller.fallback is not None:
            fallback = config.others[controller.fallback]
            called = controller.fallback + (", fallback" if controller.fallback == name else "")
            rungs.append(NamedStack(called, made(fallback), "robust"))
        return tuple(rungs)

    targets = {switch.controller for switch in mission.switch}
    named = {mission.controller: config.controller, **config.others}
    return Stacks(
        ladder=ladder(mission.controller, config.controller),
        others={name: ladder(name, named[name]) for name in sorted(t for t in targets if t)},
        switches=tuple(sorted(mission.switch, key=lambda switch: switch.at_s)),
        monitor=monitor_limits(mission, vehicle),
        acts=mission.monitor.act,
    )


def monitor_limits(mission: MissionConfig, vehicle: VehicleConfig) -> MonitorLimits:
    """The monitor's bounds for a vehicle; it knows no delay if the vehicle's file states none."""
    m, dynamics = mission.monitor, vehicle.dynamics
    # An estimate that wanders shakes the command of a loop that is well.
    noise = 0.0 if vehicle.noise is None else max(vehicle.noise.acceleration_m_s2_sqrt_hz[:2])
    return MonitorLimits(
        smoothing_s=m.smoothing_s,
        y_tilde_share=m.y_tilde_share,
        sigma_share=m.sigma_share,
        slew_floor_rad_s=m.slew_floor_rad_s + m.slew_per_noise * noise,
        slew_factor=m.slew_factor,
        delay_made_for_s=math.nan if dynamics is None else dynamics.loop_delay_s,
        delay_margin_s=m.delay_margin_s,
        severe=m.severe,
        calm=m.calm,
        alarm_after_s=m.alarm_after_s,
        ascend_after_s=m.ascend_after_s,
        ascents=m.ascents,
    )


def _about(ladder: Ladder, anchor_enu_m: Vector3) -> Ladder:
    return tuple(rung.about(anchor_enu_m) for rung in ladder)
