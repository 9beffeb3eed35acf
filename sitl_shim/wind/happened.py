"""What has happened to a vehicle, for whoever records the truth: a scenario's events."""

from dataclasses import dataclass
from math import hypot

from sitl_shim.wind.events import Load, Moments, Motor, Timed
from sitl_shim.wind.scenario import Front, Scenario


@dataclass(frozen=True, slots=True)
class Happened:
    """One event."""

    time_s: float
    """Simulated time, or what the autopilot's clock showed then."""
    name: str
    """At most ten letters: ``payload``, ``motor1`` … ``motor4``, ``front``; or a fault's, see
    `sitl_shim.faults.vehicle_events`."""
    value: float
    """Mass carried from now on (kg), the motor's thrust factor, the front's speed (m/s), or what
    is told of a fault."""


def events_of(scenario: Scenario) -> tuple[Load | Motor | Front, ...]:
    """All that has a moment, in the order of the file."""
    fronts = tuple(wind for wind in scenario.winds if isinstance(wind, Front))
    return (*scenario.payload, *scenario.motors, *fronts)


def happened(
    scenario: Scenario, moments: Moments, vehicle_mass_kg: float, time_s: float
) -> list[Happened]:
    """What has happened so far, in its order; what was so from the boot on is no event.

    Args:
        scenario: its file's content.
        moments: what the times count from.
        vehicle_mass_kg: without any load.
        time_s: simulated time since boot, now.
    """
    found = [
        Happened(moments.time_s(event), *_said(event, vehicle_mass_kg))
        for event in events_of(scenario)
        if 0.0 < moments.time_s(event) <= time_s
    ]
    return sorted(found, key=lambda event: event.time_s)


def awaits_setpoints(scenario: Scenario) -> bool:
    """Whether anything counts from the first setpoints."""
    events: tuple[Timed, ...] = events_of(scenario)
    return any(event.since == "setpoints" for event in events)


def _said(event: Load | Motor | Front, vehicle_mass_kg: float) -> tuple[str, float]:
    if isinstance(event, Load):
        return "payload", event.mass_on(vehicle_mass_kg)
    if isinstance(event, Motor):
        return f"motor{event.rotor}", event.thrust_factor
    return "front", hypot(*event.velocity_enu_m_s)
