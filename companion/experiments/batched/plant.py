"""Many vehicles as points under a thrust whose direction and size follow what is commanded.

Attitude: second order with a dead time, as the vehicle's file states it, and a limit of its rates.
Thrust: first order, of the rotors.  Yaw stays where it is.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.config.models import ResponseConfig
from companion.control.reference_model import Array, oscillator_exponential
from companion.control.thrust import GRAVITY_M_S2
from companion.experiments.batched.air import Air
from companion.experiments.batched.draws import generator
from companion.experiments.batched.task import Laws, Vehicle

STEP_S = 0.004
_RATE_LIMIT_RAD_S = math.radians(220.0)
"""PX4's MC_ROLLRATE_MAX and MC_PITCHRATE_MAX as shipped."""
_STREAM = 1
_LEAST_S = 0.01
"""No attitude answers sooner."""


@dataclass(frozen=True, slots=True)
class Plants:
    """Figures of the vehicles, (vehicles,) each unless said otherwise."""

    full_thrust_m_s2: Array
    thrust_shape: float
    """c in ``force = c t² + (1 - c) t``."""
    rotor_decay: float
    attitude: Array
    """(4, vehicles): the step's matrix by rows, of (angle minus command, rate)."""
    linear_drag_1_s: Array
    """(3, vehicles)."""
    quadratic_drag_1_m: Array
    trim_rad: Array
    """(2, vehicles): true minus reported roll and pitch."""
    link_delay_s: Array
    """From the state's time until a command decided on it arrives."""
    attitude_delay_s: Array
    """The same until the attitude begins to answer."""


def make_plants(laws: Laws, vehicles: Sequence[Vehicle]) -> Plants:
    """The figures of vehicles of one kind."""
    said, dynamics = laws.plant, laws.config.vehicle.dynamics
    assert dynamics is not None
    attitude, propulsion, spread = dynamics.attitude, said["propulsion"], said["spread"]
    factors = [vehicle.factors for vehicle in vehicles]
    uniform = np.array(
        [generator(v.task.flight.seed, _STREAM).uniform(-1.0, 1.0, 3) for v in vehicles]
    ).T
    mass = said["mass_kg"] * np.array([f.mass for f in factors])
    thrust = np.array([f.thrust for f in factors])
    lag = np.array([f.attitude_lag for f in factors])
    drag = np.array([f.drag for f in factors])
    full_n = len(said["rotors"]) * propulsion["max_thrust_n"]
    frequency, damping = _changed(attitude, lag, thrust)
    delay = said["telemetry_delay_s"] + said["command_delay_s"]
    link = delay + np.array([f.delay_s for f in factors])
    return Plants(
        full_thrust_m_s2=full_n * thrust * (1.0 + spread["thrust_fraction"] * uniform[0]) / mass,
        thrust_shape=propulsion["thrust_shape"],
        rotor_decay=math.exp(-STEP_S / propulsion["time_constant_s"]),
        attitude=np.array([_oscillator(w, z) for w, z in zip(frequency, damping, strict=True)]).T,
        linear_drag_1_s=np.outer(said["drag"]["linear_n_s_m"], drag / mass),
        quadratic_drag_1_m=said["drag"]["quadratic_n_s2_m2"] * drag / mass,
        trim_rad=math.radians(spread["trim_deg"]) * uniform[1:],
        link_delay_s=link,
        attitude_delay_s=link + attitude.delay_s,
    )


class Fleet:
    """The vehicles in the air; ENU, axes first: (3, vehicles)."""

    def __init__(self, plants: Plants, air: Air, position_m: Array) -> None:
        """Hover, level as reported, at positions (3, vehicles)."""
        count = position_m.shape[1]
        self._plants, self._air = plants, air
        self.position_m = position_m.copy()
        self.velocity_m_s = np.zeros((3, count))
        self.tilt_rad = np.zeros((2, count))
        """Roll and pitch as reported, without noise."""
        self._rate_rad_s = np.zeros((2, count))
        self.wind_m_s2 = np.zeros(count)
        """What the wind pushes, at the last step."""
        shape, share = plants.thrust_shape, GRAVITY_M_S2 / plants.full_thrust_m_s2
        self.hover_field = share
        if shape > 0.0:
            linear = 1.0 - shape
            self.hover_field = (np.sqrt(linear**2 + 4.0 * shape * share) - linear) / (2.0 * shape)
        self._thrust_m_s2 = np.full(count, GRAVITY_M_S2)
        self._sent = _Delayed(plants.attitude_delay_s, np.zeros((2, count)))
        self._lift = _Delayed(plants.link_delay_s, self.hover_field[None, :])

    def step(self, tilt_rad: Array, field: Array) -> None:
        """Advance by `STEP_S`.

        Args:
            tilt_rad: (2, vehicles) roll and pitch that the companion has decided on last.
            field: (vehicles,) thrust field, likewise.
        """
        plants, step = self._plants, STEP_S
        wanted = self._sent.next(tilt_rad)
        share = self._lift.next(field[None, :])[0]
        a11, a12, a21, a22 = plants.attitude
        off = self.tilt_rad - wanted
        limit = _RATE_LIMIT_RAD_S
        turned = wanted + a11 * off + a12 * self._rate_rad_s - self.tilt_rad
        self._rate_rad_s = np.clip(a21 * off + a22 * self._rate_rad_s, -limit, limit)
        self.tilt_rad = self.tilt_rad + np.clip(turned, -limit * step, limit * step)
        force = share * (plants.thrust_shape * share + 1.0 - plants.thrust_shape)
        asked = force * plants.full_thrust_m_s2
        self._thrust_m_s2 = asked + plants.rotor_decay * (self._thrust_m_s2 - asked)

        roll, pitch = self.tilt_rad + plants.trim_rad
        level = self._thrust_m_s2 * np.cos(roll)
        velocity = self.velocity_m_s
        acceleration = self._drag(velocity)
        if not self._air.still:
            still = acceleration
            acceleration = self._drag(velocity - self._air.velocity(self.position_m))
            self.wind_m_s2 = np.linalg.norm(acceleration - still, axis=0)
        acceleration[0] += level * np.sin(pitch)
        acceleration[1] -= self._thrust_m_s2 * np.sin(roll)
        acceleration[2] += level * np.cos(pitch) - GRAVITY_M_S2
        self.velocity_m_s = velocity + step * acceleration
        self.position_m = self.position_m + 0.5 * step * (velocity + self.velocity_m_s)

    def park(self, which: Array, position_m: Array) -> None:
        """Hold those that are lost, so that their numbers stay numbers."""
        self.position_m[:, which] = position_m[:, which]
        self.velocity_m_s[:, which] = 0.0
        self.tilt_rad[:, which] = 0.0
        self._rate_rad_s[:, which] = 0.0
        self._thrust_m_s2[which] = GRAVITY_M_S2

    def _drag(self, relative_m_s: Array) -> Array:
        speed = np.sqrt((relative_m_s * relative_m_s).sum(axis=0))
        drag: Array = -relative_m_s * (
            self._plants.linear_drag_1_s + self._plants.quadratic_drag_1_m * speed
        )
        return drag


class _Delayed:
    """What was sent, as it arrives: each vehicle has its own delay, of any length."""

    def __init__(self, delay_s: Array, resting: Array) -> None:
        whole, self._part = np.divmod(delay_s / STEP_S, 1.0)
        self._whole = whole.astype(int)
        self._ring = np.repeat(resting[None], int(self._whole.max()) + 2, axis=0)
        self._columns = np.arange(len(delay_s))
        self._step = 0

    def next(self, sent: Array) -> Array:
        """The mean over the next step of what acts then, of what is sent from now on."""
        size = len(self._ring)
        self._ring[self._step % size] = sent
        newer = (self._step - self._whole) % size
        new, old = (self._ring[at, :, self._columns].T for at in (newer, newer - 1))
        self._step += 1
        mean: Array = new + self._part * (old - new)
        return mean


def _changed(attitude: ResponseConfig, lag: Array, torque: Array) -> tuple[Array, Array]:
    """Natural frequencies and dampings of an attitude that lags more or has more torque.

    With a rate loop below a gain on the angle, of the response's inverse ``1 + L s + Q s² + …`` L
    is the inverse of that gain and Q has the rate loop's lag as a factor, which goes with the
    inverse of the torque.  The dead time stays; what is of second order takes up the rest.

    Args:
        attitude: the response as stated.
        lag: (vehicles,) factors.
        torque: (vehicles,) factors.
    """
    dead_s, stated = attitude.delay_s, attitude.natural_frequency_rad_s
    lag_s = 2.0 * attitude.damping / stated
    first = lag * (lag_s + dead_s) - dead_s
    second = lag / torque * (stated**-2 + lag_s * dead_s + 0.5 * dead_s**2)
    second = np.maximum(second - first * dead_s - 0.5 * dead_s**2, _LEAST_S**2)
    first = np.maximum(first, _LEAST_S)
    frequency = 1.0 / np.sqrt(second)
    return frequency, 0.5 * first * frequency


def _oscillator(frequency_rad_s: float, damping: float) -> tuple[float, float, float, float]:
    stiffness, friction = frequency_rad_s**2, 2.0 * damping * frequency_rad_s
    c, s = oscillator_exponential(-friction, stiffness, STEP_S)
    return c, s, -s * stiffness, c - s * friction
