"""The plant: one vehicle in its wind, stepped with a fixed step."""

from collections.abc import Sequence

import numpy as np

from sitl_shim.compiled import FLOAT, compiled
from sitl_shim.frames import Vector3
from sitl_shim.plant import equations
from sitl_shim.plant.battery import BatteryPack
from sitl_shim.plant.equations import Four, Motion
from sitl_shim.plant.ground import Ground
from sitl_shim.plant.payload import loaded
from sitl_shim.plant.rigid_body import body_of
from sitl_shim.plant.rotors import arms_of, lag_of, sane_commands, thrust_map_of
from sitl_shim.plant.state import PlantState
from sitl_shim.plant.timeline import Timeline
from sitl_shim.plant.vehicle import VehicleModel
from sitl_shim.wind import Load, Moments, Motor, Wind

_SEED_STREAM = 1
_ROTORS = (equations.lag_signals, equations.thrusts_of, equations.wrench_of)
_BODY = (equations.derivative, equations.drag_acceleration)
_FLIGHT = (
    *_ROTORS,
    *_BODY,
    equations.runge_kutta_step,
    equations.observe,
    equations.discharge,
)
_STILL: Motion = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Plant:
    """A quadrotor's motion from its four rotor commands and the wind.

    Commands are held over a step; the rotors' lag is solved exactly, the rigid body by
    Runge-Kutta of fourth order, with the wind held at its value at the start of the step.
    """

    def __init__(
        self,
        vehicle: VehicleModel,
        wind: Wind,
        *,
        seed: int,
        step_s: float = 0.004,
        airborne_at_enu_m: Vector3 | None = None,
        events: Sequence[Load | Motor] = (),
        moments: Moments | None = None,
    ) -> None:
        """Make the plant, at rest.

        Args:
            vehicle: what flies.
            wind: in what it flies.
            seed: draws what makes this very vehicle differ from its type.
            step_s: length of a step.
            airborne_at_enu_m: hover there at first, rotors turning; else stand on the ground
                at the origin, rotors stopped, nose to the east.
            events: what happens to it when.
            moments: what their times count from; by default setpoints never come.

        Raises:
            ValueError: the step is not positive.
        """
        if not step_s > 0.0:
            raise ValueError(f"step_s must be positive, not {step_s}")
        spread = vehicle.spread.thrust_fraction
        generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM,)))
        self._thrust_scale = 1.0 + float(generator.uniform(-spread, spread))
        self._factors: Four = (1.0, 1.0, 1.0, 1.0)
        self._wind = wind
        self._step_s = step_s
        self._steps = 0
        self._vehicle = vehicle
        self._moments = moments or Moments()
        self._timeline = Timeline(events, self._moments, step_s)
        self._drive = compiled(equations.drive, 2, 8, 12, 4, 4, parts=_ROTORS)
        self._fly = compiled(
            equations.fly,
            *(12, 2, 8, 12, 4, 4, 10, 10, 3, FLOAT, 6, FLOAT, FLOAT),
            parts=_FLIGHT,
        )
        self._look = compiled(equations.observe, 12, 10, 4, 3, parts=_BODY)
        self._arms = arms_of(vehicle)
        self._lag = lag_of(vehicle.propulsion.time_constant_s, step_s)
        self._thrust_map = thrust_map_of(vehicle, self._thrust_scale)
        self._set_mass(vehicle)
        while self._timeline.next_step == 0:
            self._happen(self._timeline.take())
        self._battery = BatteryPack(vehicle.battery)

        airborne = airborne_at_enu_m is not None
        signal = min(1.0, self._carrying.hover_signal) if airborne else 0.0
        self._signals: Four = (signal, signal, signal, signal)
        self._position: Vector3 = airborne_at_enu_m or (0.0, 0.0, 0.0)
        self._motion = _STILL
        self._standing = not airborne
        self._wind_now = wind.velocity_enu_m_s(0.0, self._position)
        thrusts = equations.thrusts_of(self._thrust_map, self._signals)
        wrench = equations.wrench_of(self._arms, thrusts)
        self._slope, push = self._look(self._body, self._motion, wrench, self._wind_now)
        acceleration = self._slope[:3] if airborne else (0.0, 0.0, 0.0)
        self.state = self._observe(thrusts, acceleration, push, on_ground=not airborne)

    def step(self, rotor_commands: Sequence[float]) -> PlantState:
        """Advance by one step.

        Args:
            rotor_commands: four, in [0, 1], in the order of the vehicle's rotors; others are
                taken as a speed controller takes them (see `sane_commands`).

        Raises:
            ValueError: there are not four commands.
        """
        step_s = self._step_s
        a, b, c, d = sane_commands(rotor_commands)
        battery = self._battery
        factor = battery.signal_factor
        targets = (factor * a, factor * b, factor * c, factor * d)
        before = self._motion
        wind = self._wind_now
        touching = False
        if self._standing:
            end, thrusts, wrench = self._drive(
                self._lag, self._thrust_map, self._arms, self._signals, targets
            )
            touching = self._rests(wrench)
        if touching:
            battery.draw(end, step_s)
        else:
            self._standing = False
            end, thrusts, wrench, (sx, sy, sz), self._motion, seen, left = self._fly(
                self._body,
                self._lag,
                self._thrust_map,
                self._arms,
                self._signals,
                targets,
                before,
                self._slope,
                wind,
                step_s,
                battery.cells,
                battery.remaining,
                battery.voltage_v,
            )
            battery.remaining, battery.voltage_v = left
            x, y, z = self._position
            self._position = (x + sx, y + sy, z + sz)
            touching = self._ground.near(z + sz) and self._touch_down(wrench)
        self._signals = end

        self._steps += 1
        body = self._body
        while self._timeline.next_step == self._steps:
            self._happen(self._timeline.take())
        self._wind_now = self._wind.velocity_enu_m_s(self._steps * step_s, self._position)
        motion = self._motion
        if touching or self._wind_now is not wind or self._body is not body:
            seen = self._look(self._body, motion, wrench, self._wind_now)
        slope, push = seen
        self._slope = slope
        acceleration = (
            (
                (motion[0] - before[0]) / step_s,
                (motion[1] - before[1]) / step_s,
                (motion[2] - before[2]) / step_s,
            )
            if touching
            else (slope[0], slope[1], slope[2])
        )
        self.state = self._observe(thrusts, acceleration, push, on_ground=touching)
        return self.state

    def follow_setpoints(self) -> None:
        """From now on the vehicle follows a client's setpoints: some events count from here."""
        self._moments.setpoints_s = self._steps * self._step_s
        self._timeline.moments_known(self._steps + 1)

    def _happen(self, event: Load | Motor) -> None:
        if isinstance(event, Load):
            self._set_mass(loaded(self._vehicle, event))
            return
        first, second, third, fourth = (
            event.thrust_factor if rotor == event.rotor else factor
            for rotor, factor in enumerate(self._factors, start=1)
        )
        self._factors = (first, second, third, fourth)
        self._thrust_map = thrust_map_of(self._vehicle, self._thrust_scale, self._factors)

    def _set_mass(self, vehicle: VehicleModel) -> None:
        """Make anew what depends on the mass."""
        self._carrying = vehicle
        self._body = body_of(vehicle)
        self._ground = Ground(vehicle)

    def _touch_down(self, wrench: Four) -> bool:
        """Meet the ground, if anything touches it; stand, if that leaves the vehicle still."""
        x, y, z = self._position
        met = self._ground.resolve(z, self._motion)
        if met is None:
            return False
        lift, self._motion = met
        self._position = (x, y, z + lift)
        if self._ground.stands(z + lift, self._motion) and self._rests(wrench):
            self._standing = True
            self._motion = (0.0, 0.0, 0.0, *self._motion[3:7], 0.0, 0.0, 0.0)
        return True

    def _rests(self, wrench: Four) -> bool:
        """Whether the ground holds the vehicle still against rotors and wind."""
        _, _, _, w, x, y, z, _, _, _ = self._motion
        still = (0.0, 0.0, 0.0, w, x, y, z, 0.0, 0.0, 0.0)
        pull, _ = self._look(self._body, still, wrench, self._wind_now)
        return self._ground.holds(pull)

    def _observe(
        self, thrusts: Four, acceleration: Vector3, push: Vector3, *, on_ground: bool
    ) -> PlantState:
        vx, vy, vz, w, x, y, z, p, q, r = self._motion
        return PlantState(
            self._steps * self._step_s,
            self._position,
            (vx, vy, vz),
            (w, x, y, z),
            (p, q, r),
            thrusts,
            acceleration,
            push,
            on_ground,
            self._battery.voltage_v,
            self._battery.remaining,
        )
