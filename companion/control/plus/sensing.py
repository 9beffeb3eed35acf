"""What MPC-L1+ makes of a sample of the state: σ̂, and what the identification got wrong."""

import math
from dataclasses import dataclass

import numpy as np

from companion.control.plus import lag, measured, mismatch, predictor
from companion.control.plus.lag import LagMemory
from companion.control.plus.mismatch import NOTHING, Mismatch, MismatchMemory, Pair
from companion.control.plus.nominal_plant import Acting, carried
from companion.control.plus.predictor import PredictorMemory, PredictorRecord
from companion.control.plus.settings import PlusSettings
from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2
from companion.frames import Vector3
from companion.vehicle_state import VehicleState

LEAST_VERTICAL_M_S2 = 0.3 * GRAVITY_M_S2
"""Of the thrust's vertical part per mass that a tilt is reckoned with."""
_SIGMA_DEVIATION_M_S2 = 1.0
"""Of what is not known of σ at engagement."""
_LEAST_DENSITY = 0.05
"""m/s² per √Hz: no air and no estimate is calmer."""


@dataclass(frozen=True, slots=True)
class Sensed:
    """What is known of the vehicle at a sample."""

    predictor: PredictorMemory
    sigma_low_passed: Vector3
    """C(s) σ̂."""
    actuation: tuple[Pair, Pair, Pair]
    """Acceleration and its rate: by the measured tilt for x and y, modelled for z."""
    modelled: Array
    """(3, 2) the same by the identified response to the commands alone."""
    lag: LagMemory
    mismatch: MismatchMemory
    learnt: Mismatch
    tilted: Pair
    """Acceleration by the measured tilt, as identified."""
    velocity: Vector3
    """As measured."""


def start(settings: PlusSettings, state: VehicleState) -> Sensed:
    """Nothing learnt yet, at a state."""
    s = settings
    position, velocity = np.array(state.position_enu_m), np.array(state.velocity_enu_m_s)
    along_x, along_y = measured.tilt_motion(state, GRAVITY_M_S2 * s.plant.tilt_gain)
    actuation = (along_x, along_y, (0.0, 0.0))
    sigma = s.held_sigma if s.held_sigma is not None else (0.0, 0.0, 0.0)
    unknown = np.full(3, _SIGMA_DEVIATION_M_S2)
    return Sensed(
        predictor.start(s.noise, position, velocity, np.array(sigma), unknown),
        sigma,
        actuation,
        np.array(actuation),
        lag.start(),
        mismatch.start(),
        NOTHING,
        (along_x[0], along_y[0]),
        state.velocity_enu_m_s,
    )


def sense(
    settings: PlusSettings,
    before: Sensed,
    acting: tuple[Acting, ...],
    state: VehicleState,
    sampled_s: tuple[float, float],
) -> tuple[Sensed, PredictorRecord]:
    """Take a sample in.

    Args:
        settings: of the stack.
        before: of the sample before.
        acting: inputs that have acted since.
        state: the sample.
        sampled_s: times of the sample before and of this one.
    """
    s = settings
    before_s, now_s = sampled_s
    dt = now_s - before_s
    estimate = before.predictor.estimate.tolist()
    x = [
        (p, v, a, rate)
        for (p, v, _), (a, rate) in zip(estimate, before.modelled.tolist(), strict=True)
    ]
    sigma = [sigma for _, _, sigma in estimate]
    until = (now_s, now_s, now_s)
    modelled = [(a, rate) for _, _, a, rate in carried(s.plant, x, sigma, before_s, until, acting)]

    force = max(LEAST_VERTICAL_M_S2, GRAVITY_M_S2 + modelled[2][0]) * s.plant.tilt_gain
    (tilt_x, rate_x), (tilt_y, rate_y) = measured.tilt_motion(state, force)
    tilted = (tilt_x, tilt_y)
    learnt = before.learnt
    (push_x, push_y) = learnt.pushed(tilt_x, tilt_y)
    (turn_x, turn_y) = learnt.pushed(rate_x, rate_y)
    actuation = [(push_x, turn_x), (push_y, turn_y), modelled[2]]
    lag_memory = before.lag
    if s.lag is not None and s.held_sigma is None:
        (model_x, model_rate_x), (model_y, model_rate_y), _ = modelled
        lag_memory = lag.step(
            s.lag, before.lag, tilted, (model_x, model_y), (model_rate_x, model_rate_y), dt
        )

    drag = s.plant.linear_drag_1_s + learnt.drag_1_s
    # The linear part is in the predictor's model; the quadratic one is as known as the tilt.
    velocity = state.velocity_enu_m_s
    quadratic = s.quadratic_drag_1_m * _length(velocity)
    drags, known = [], []
    for i, axis in enumerate(s.plant.axes):
        by_air = axis.interface == "acceleration"
        drags.append(drag if by_air else 0.0)
        push = 0.5 * (before.actuation[i][0] + actuation[i][0])
        known.append(push - quadratic * velocity[i] if by_air else push)
    predicted, record = predictor.step(
        s.noise,
        before.predictor,
        drags,
        s.sigma_bound_m_s2,
        known,
        state.position_enu_m,
        velocity,
        dt,
    )
    mismatch_memory = before.mismatch
    if s.held_sigma is not None:
        predicted.estimate[:, 2] = s.held_sigma
    sigma = predicted.estimate[:, 2].tolist()
    if s.held_sigma is None and s.mismatch is not None:
        learnt, mismatch_memory = _learn(s, before, sigma, tilted, velocity, dt)
    filtered = [
        was - math.expm1(-omega * dt) * (now - was)
        for was, now, omega in zip(before.sigma_low_passed, sigma, s.low_pass_rad_s, strict=True)
    ]
    sensed = Sensed(
        predicted,
        _triple(filtered),
        (actuation[0], actuation[1], actuation[2]),
        np.array(modelled),
        lag_memory,
        mismatch_memory,
        learnt,
        tilted,
        velocity,
    )
    return sensed, record


def _learn(
    s: PlusSettings,
    before: Sensed,
    sigma: list[float],
    tilted: Pair,
    velocity: Vector3,
    dt: float,
) -> tuple[Mismatch, MismatchMemory]:
    """What the identified plant gets wrong of the horizontal motion."""
    assert s.mismatch is not None
    drag = s.plant.linear_drag_1_s + s.quadratic_drag_1_m * _length(velocity)
    pushed, moved, left = [], [], []
    for axis in range(2):
        was, now = before.velocity[axis], velocity[axis]
        pushed.append(0.5 * (before.tilted[axis] + tilted[axis]))
        moved.append(0.5 * (was + now))
        left.append((now - was) / dt - pushed[axis] + drag * moved[axis])
    memory = mismatch.step(s.mismatch, before.mismatch, left, moved, pushed, sigma, dt)
    density = max(_LEAST_DENSITY, *s.noise.acceleration_m_s2_sqrt_hz[:2])
    learnt = mismatch.learnt(s.mismatch, memory, before.learnt, density, dt)
    least = -s.plant.linear_drag_1_s
    return Mismatch(max(least, learnt.drag_1_s), learnt.gain, learnt.heading_rad), memory


def _length(vector: Vector3) -> float:
    x, y, z = vector
    return math.sqrt(x * x + y * y + z * z)


def _triple(values: list[float]) -> Vector3:
    x, y, z = values
    return x, y, z
