"""The loop of MPC-L1+ around a vehicle that need not be the identified one, axis by axis.

The vehicle is linear and discretised exactly under a held input, its dead time as held samples (a
whole number of them and a remainder); the law comes from `plus_law.py`.  A held input of a
disturbance, an acceleration beside those of the input, acts without a delay.

States of the vehicle: position, velocity, acceleration *by the tilt as measured*, its rate.  What
the measured tilt does not show is `push`: how much more the vehicle accelerates than its tilt, or
its thrust, says.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from companion.control.matrix_exponential import matrix_exponential
from companion.control.plus.nominal_plant import STATES, Actuation, NominalPlant, continuous
from companion.control.reference_model import Array
from companion.theory.plant import ComplexArray
from companion.theory.plus_law import AXES, MEASURED, PlusLaw

DISTURBANCE, NOISE = 0, slice(1, 1 + MEASURED)
EXOGENOUS = 1 + MEASURED
"""Inputs of a closed loop: the disturbance, m/s², and the noise of the four measurements."""
POSITION, VELOCITY, INPUT, INPUT_RATE = range(4)
OUTPUTS = 4
"""Position m, velocity m/s, commanded u, and its change since the sample before over the time."""


@dataclass(frozen=True, slots=True)
class PlusAxisPlant:
    """One axis of the vehicle that is flown."""

    actuation: Actuation
    """With the dead time of the whole loop, transport and vehicle's."""
    drag_1_s: float
    """Of an axis whose interface is an acceleration; a climb rate's is in its response."""
    gain: float = 1.0
    """Of what the input does, seen in the measured tilt."""
    push: float = 1.0
    """Of the acceleration over what tilt and thrust say."""


def axis_plants(plant: NominalPlant, loop_delay_s: float) -> tuple[PlusAxisPlant, ...]:
    """The vehicle as it was identified, with the delay of the loop."""
    return tuple(
        PlusAxisPlant(
            replace(axis, delay_s=axis.delay_s + loop_delay_s),
            plant.linear_drag_1_s if axis.interface == "acceleration" else 0.0,
        )
        for axis in plant.axes
    )


@dataclass(frozen=True, slots=True)
class HeldAxis:
    """``x+ = Φ x + late u(k-d-1) + early u(k-d) + pushed d(k)``."""

    phi: Array
    late: Array
    early: Array
    pushed: Array
    whole: int
    """d: whole samples of delay."""


def hold(plant: PlusAxisPlant, sample_s: float) -> HeldAxis:
    """Discretise one axis exactly."""
    total = plant.actuation.delay_s
    whole = math.floor(total / sample_s + 1e-9)
    rest = max(0.0, round(total - whole * sample_s, 9))
    undelayed = replace(plant.actuation, delay_s=0.0)
    phi, late, early, pushed = _held(undelayed, plant.drag_1_s, plant.push, sample_s, rest)
    return HeldAxis(phi, plant.gain * late, plant.gain * early, pushed, whole)


@lru_cache(maxsize=4096)
def _held(
    actuation: Actuation, drag_1_s: float, push: float, sample_s: float, rest: float
) -> tuple[Array, Array, Array, Array]:
    a, b = continuous(actuation, drag_1_s)
    if actuation.interface == "acceleration":
        a[1, 2] = push
    else:
        b[2, 0] *= push
    system = np.zeros((STATES + 2, STATES + 2))
    system[:STATES, :STATES], system[:STATES, STATES:] = a, b
    first, second = (
        matrix_exponential(system * rest),
        matrix_exponential(system * (sample_s - rest)),
    )
    late = second[:STATES, :STATES] @ first[:STATES, STATES]
    full = second @ first
    return full[:STATES, :STATES], late, second[:STATES, STATES], full[:STATES, STATES + 1]


@dataclass(frozen=True, slots=True)
class ClosedLoop:
    """``X+ = A X + B e``, ``z = C X + D e`` of one axis; e and z as above."""

    a: Array
    b: Array
    c: Array
    d: Array
    sample_s: float

    @property
    def radius(self) -> float:
        """Spectral radius per sample."""
        return float(np.abs(np.linalg.eigvals(self.a)).max())

    @property
    def slowest_1_s(self) -> complex:
        """Its slowest pole in continuous time."""
        values = np.linalg.eigvals(self.a).astype(np.complex128)
        return complex(np.log(values[np.abs(values).argmax()]) / self.sample_s)


def closed_loop(law: PlusLaw, axis: int, plant: PlusAxisPlant) -> ClosedLoop:
    """Close the law around one axis; the states begin with the vehicle's four."""
    held = hold(plant, law.sample_s)
    sent, n = held.whole + 1, law.a.shape[1]
    size = STATES + sent + n
    x, xi = slice(0, STATES), slice(STATES + sent, size)
    # u = c ξ + d (x + noise), as a row over the states and the inputs from outside.
    u_states, u_outside = np.zeros(size), np.zeros(EXOGENOUS)
    u_states[x], u_states[xi] = law.d[axis], law.c[axis]
    u_outside[NOISE] = law.d[axis]
    a, b = np.zeros((size, size)), np.zeros((size, EXOGENOUS))
    a[x, x] = held.phi
    b[x, DISTURBANCE] = held.pushed
    for column, age in ((held.early, held.whole), (held.late, held.whole + 1)):
        if age == 0:
            a[x] += np.outer(column, u_states)
            b[x] += np.outer(column, u_outside)
        else:
            a[x, STATES + age - 1] += column
    a[STATES], b[STATES] = u_states, u_outside
    for k in range(1, sent):
        a[STATES + k, STATES + k - 1] = 1.0
    a[xi, xi], a[xi, x], b[xi, NOISE] = law.a[axis], law.b[axis], law.b[axis]
    c, d = np.zeros((OUTPUTS, size)), np.zeros((OUTPUTS, EXOGENOUS))
    c[POSITION, 0] = c[VELOCITY, 1] = 1.0
    c[INPUT], d[INPUT] = u_states, u_outside
    c[INPUT_RATE], d[INPUT_RATE] = u_states / law.sample_s, u_outside / law.sample_s
    c[INPUT_RATE, STATES] -= 1.0 / law.sample_s
    return ClosedLoop(a, b, c, d, law.sample_s)


def radii(law: PlusLaw, plants: tuple[PlusAxisPlant, ...]) -> Array:
    """(3,) spectral radii per sample."""
    return np.array([closed_loop(law, i, plants[i]).radius for i in range(AXES)])


def law_response(law: PlusLaw, axis: int, omega: Array) -> ComplexArray:
    """(k, 4) from the measurements to u, at frequencies (k,) up to half the sampling frequency.

    The law keeps its own u: what it carries over the delay is what it commanded.
    """
    z = _on_circle(omega, law.sample_s)
    states = _resolve(law.a[axis], z, np.tile(law.b[axis], (len(z), 1, 1)))
    response: ComplexArray = (law.c[axis] @ states + law.d[axis]).astype(np.complex128)
    return response


def broken_at_u(
    response: ComplexArray, plant: PlusAxisPlant, omega: Array, sample_s: float
) -> ComplexArray:
    """Loop transfer function at the vehicle's input, with the sign of 1 + L.

    Args:
        response: (k, 4) of the law, by `law_response`.
        plant: of the axis.
        omega: (k,) rad/s.
        sample_s: between two samples.
    """
    held, z = hold(plant, sample_s), _on_circle(omega, sample_s)
    delayed = z ** -float(held.whole)
    entered = np.outer(delayed, held.early) + np.outer(delayed / z, held.late)
    measured = _resolve(held.phi, z, entered[:, :, None])[:, :, 0]
    loop: ComplexArray = -(response * measured).sum(axis=1)
    return loop


def _on_circle(omega: Array, sample_s: float) -> ComplexArray:
    return np.asarray(np.exp(1j * omega * sample_s), dtype=np.complex128)


def _resolve(a: Array, z: ComplexArray, right: ComplexArray) -> ComplexArray:
    """``(z I - A)⁻¹ right`` for each of (k,) values of z and (k, n, m) right sides."""
    matrices = z[:, None, None] * np.eye(len(a)) - a
    solved: ComplexArray = np.linalg.solve(matrices, right).astype(np.complex128)
    return solved
