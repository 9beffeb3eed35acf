"""The simulated vehicle: plant, estimator and autopilot, stepped together at 250 Hz."""

from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path

from sitl_shim.autopilot.flavours import aiding_of, make_autopilot
from sitl_shim.autopilot.interface import TICK_S, TICK_US, Autopilot, BatteryReport
from sitl_shim.faults.schema import NO_FAULTS, load_faults
from sitl_shim.faults.vehicle_acts import VehicleFaults
from sitl_shim.faults.vehicle_clock import BootClock
from sitl_shim.faults.vehicle_estimate import step_between
from sitl_shim.faults.vehicle_events import link_happened
from sitl_shim.frames import Vector3
from sitl_shim.plant.payload import refuse_too_light
from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.state import PlantState
from sitl_shim.plant.vehicle import VehicleModel, load_vehicle
from sitl_shim.sensors.aided_estimator import AidedEstimator
from sitl_shim.sensors.aiding import ExternalPose, nothing_of
from sitl_shim.sensors.estimator import Estimate
from sitl_shim.sensors.heading_error import turned
from sitl_shim.sensors.profile import load_profile
from sitl_shim.wind import (
    Moments,
    OwnWind,
    OwnWindFunction,
    Scenario,
    SumOfWinds,
    Wind,
    load_scenario,
    make_wind,
)
from sitl_shim.wind.happened import Happened, awaits_setpoints, happened

_BATTERY_PERIOD_US = 100_000


@dataclass(frozen=True, slots=True)
class ShimOptions:
    """What is simulated, and as which MAVLink system it answers."""

    autopilot: str = "px4"
    """Flavour, see `sitl_shim.autopilot.flavours`."""
    vehicle: str | Path = "bebop2"
    """Name of a vehicle, or path of a vehicle file."""
    scenario: str | Path = "calm"
    """Name of a scenario of winds and events, or path of a scenario file."""
    faults: str | Path | None = None
    """What goes wrong on purpose: the name of a file of faults, the path of one, or its text."""
    sensors: str | Path | None = None
    """Name of a sensor profile, or path of one, in place of the vehicle's own."""
    seed: int = 0
    """Draws everything that is random."""
    system_id: int = 1
    """MAVLink system id of the vehicle."""
    speed: float = 1.0
    """Simulated seconds per second of the driver's clock."""
    airborne_at_enu_m: Vector3 | None = None
    """Begin booted, armed and holding there, instead of standing at the origin."""
    parameters: dict[str, float] = field(default_factory=dict)
    """Autopilot parameters that differ from the vehicle's and from the faults', by name."""
    boot_scale: float = 1.0
    """The times of ArduPilot's long boot (40 s to a position) are multiplied by it."""
    truth: bool = True
    """Whether the simulator's truth is streamed (from component 240) on the onboard link."""
    signing_key: bytes | None = field(default=None, repr=False)
    """32 bytes, with which packets are signed and must be signed; None: they need not be."""
    own_wind: OwnWindFunction | None = field(default=None, repr=False)
    """Blows beside the scenario's winds; only for a simulation within the caller's process."""


@dataclass(frozen=True, slots=True)
class GlobalOrigin:
    """Where on Earth the local frame's origin is: by default where PX4's simulation begins."""

    latitude_deg: float = 47.3977418
    longitude_deg: float = 8.5455938
    altitude_amsl_m: float = 489.4


_ORIGINS = {"ardupilot": GlobalOrigin(-35.3632610, 149.1652299, 584.09)}


class Simulation:
    """One vehicle under its autopilot.

    Raises:
        ValueError: an unknown vehicle, scenario, sensor profile, flavour or parameter, faults that
            are none, a scenario that does not suit the vehicle, or a start below the ground; the
            text says which and what there is.
    """

    def __init__(self, options: ShimOptions) -> None:
        self.vehicle: VehicleModel = load_vehicle(options.vehicle)
        scenario = load_scenario(options.scenario)
        refuse_too_light(scenario, self.vehicle, options.scenario)
        airborne = options.airborne_at_enu_m
        if airborne is not None and not (all(map(isfinite, airborne)) and airborne[2] > 0.0):
            raise ValueError(f"a flight cannot begin in the air at {airborne} m, ENU")
        self.moments = Moments()
        """What the times of events and faults count from."""
        self.faults = NO_FAULTS if options.faults is None else load_faults(options.faults)
        """What goes wrong on purpose."""
        self._scenario = scenario
        self._awaits_setpoints = awaits_setpoints(scenario) or self.faults.await_setpoints
        self._plant = Plant(
            self.vehicle,
            _wind(scenario, options, self.moments),
            seed=options.seed,
            step_s=TICK_S,
            airborne_at_enu_m=airborne,
            events=(*scenario.payload, *scenario.motors),
            moments=self.moments,
        )
        own = self.vehicle.sensor_profile
        profile = load_profile(own if options.sensors is None else options.sensors)
        self._estimator = AidedEstimator(profile, self.vehicle, seed=options.seed)
        self.origin = _ORIGINS.get(options.autopilot, GlobalOrigin())

        def make() -> Autopilot:
            return make_autopilot(
                options.autopilot,
                {
                    **self.vehicle.parameters_of(options.autopilot),
                    **self.faults.parameters_of(options.autopilot),
                    **options.parameters,
                },
                seed=options.seed,
                origin_altitude_amsl_m=self.origin.altitude_amsl_m,
                airborne=airborne is not None and self.boots == 0,
                speed=options.speed,
                boot_scale=options.boot_scale,
                system_id=options.system_id,
            )

        self.boots = 0
        """How often the autopilot has been started again."""
        self._befalls: VehicleFaults | None = None
        self._regained = False
        self._make_autopilot = make
        self.autopilot: Autopilot = make()
        self._flavour = options.autopilot
        self._revision = -1
        self._position_there = True
        self._tell_estimator()
        self.clock = BootClock()
        """The autopilot's."""
        self.elapsed_us = 0
        """Simulated time, µs: a multiple of 4000."""
        self.time_us = 0
        """Time since the autopilot's boot, µs: what it counts and waits by."""
        self.stamp_us = 0
        """What it says of its time since boot, µs: its clock may have jumped."""
        self.state: PlantState = self._plant.state
        """The truth now."""
        if self.faults.vehicle:
            self._befalls = VehicleFaults(
                self.faults, options.autopilot, self.moments, self.vehicle.battery
            )
        self._motion: Estimate = self._estimate()
        self.estimate: Estimate = self._motion
        """What the autopilot says that it believes: what it believes now, unless that is frozen."""
        self.estimate_us = 0
        """Its time stamp, µs."""
        self.estimate_resets = 0
        """How many resets of it have been announced."""
        self._commands = self.autopilot.step(0, self._motion)

    @property
    def stamp_ms(self) -> int:
        """`stamp_us` in ms, as 32 bits hold it."""
        return self.stamp_us // 1000 & 0xFFFFFFFF

    @property
    def estimate_ms(self) -> int:
        """`estimate_us` in ms, as 32 bits hold it."""
        return self.estimate_us // 1000 & 0xFFFFFFFF

    def sense(self) -> None:
        """Advance by 4 ms: the plant under the last commands, then the estimate."""
        self.elapsed_us += TICK_US
        self.time_us += TICK_US
        self.stamp_us += TICK_US
        self.state = self._plant.step(self._commands)
        befalls = self._befalls
        if befalls is not None:
            befalls.act(self.elapsed_us, self)
            self.stamp_us = self.time_us + self.clock.jump_us
        if self.autopilot.parameters.revision != self._revision:
            self._tell_estimator()
        if self.time_us % _BATTERY_PERIOD_US == 0:
            self.autopilot.battery = self.battery
        self._motion = estimate = self._estimate()
        if befalls is None or not befalls.frozen:
            self.estimate = estimate
            self.estimate_us = self.stamp_us
        elif not befalls.stamps_frozen:
            self.estimate_us = self.stamp_us

    def _estimate(self) -> Estimate:
        estimate = self._estimator.update(self.state)
        error_rad = self.autopilot.estimator.yaw_error_rad
        if error_rad != 0.0:
            estimate = turned(estimate, error_rad)
        return estimate if self._befalls is None else self._befall(self._befalls, estimate)

    def _befall(self, befalls: VehicleFaults, estimate: Estimate) -> Estimate:
        """What faults make of an estimate."""
        estimate = befalls.estimate.of(estimate)
        if self._regained:
            self._regained = False
            step = step_between(self._motion, estimate)
            befalls.estimate.count(step)
            self.autopilot.note_reset(step)
        if not befalls.frozen:
            self.estimate_resets = befalls.estimate.resets
        return estimate

    def receive_pose(self, pose: ExternalPose) -> None:
        """Take a pose that was measured from outside."""
        self._estimator.take(pose)

    def _tell_estimator(self) -> None:
        """Let the estimator lean on what the autopilot's parameters say."""
        self._revision = self.autopilot.parameters.revision
        aiding = aiding_of(self._flavour, self.autopilot.parameters)
        self._estimator.aiding = aiding if self._position_there else nothing_of(aiding)

    @property
    def battery(self) -> BatteryReport:
        """What the battery says."""
        if self._befalls is not None:
            return self._befalls.battery.of(self.state)
        return BatteryReport(self.state.battery_remaining, self.state.battery_voltage_v)

    def control(self) -> None:
        """Let the autopilot act on the estimate; belongs after each `sense`."""
        self._commands = self.autopilot.step(self.time_us, self._motion)
        if self._awaits_setpoints and self.autopilot.follows_setpoints and not self.state.on_ground:
            self._awaits_setpoints = False
            self._plant.follow_setpoints()

    # --- what befalls it ---

    def reboot(self) -> None:
        """Begin the autopilot anew; what was set of its parameters it has kept."""
        self.boots += 1
        kept = self.autopilot.parameters
        self.autopilot = self._make_autopilot()
        store = self.autopilot.parameters
        for name in store.names:
            if store[name] != kept[name]:
                store.learn(name, kept[name])
        self.clock.reboot(self.elapsed_us)
        self.time_us = 0
        self._tell_estimator()
        self.autopilot.battery = self.battery

    def rely_on_position(self, there: bool) -> None:
        """Let the estimator have measurements of its position, or none."""
        self._regained = there and not self._position_there
        self._position_there = there
        self._tell_estimator()

    @property
    def happened(self) -> list[Happened]:
        """The events in flight so far, in their order: the scenario's and the faults'."""
        time_s = self.elapsed_us * 1e-6
        found = happened(self._scenario, self.moments, self.vehicle.mass_kg, time_s)
        found += link_happened(self.faults, self.moments, time_s)
        found.sort(key=lambda event: event.time_s)
        told = [replace(event, time_s=self.clock.stamp_s(event.time_s)) for event in found]
        return told if self._befalls is None else told + self._befalls.happened


def _wind(scenario: Scenario, options: ShimOptions, moments: Moments) -> Wind:
    """All that blows."""
    wind = make_wind(scenario, options.seed, moments)
    if options.own_wind is None:
        return wind
    return SumOfWinds((wind, OwnWind(options.own_wind)))
