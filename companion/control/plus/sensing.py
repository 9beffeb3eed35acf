"""What MPC-L1+ makes of a sample of the state: σ̂, and what the identification got wrong."""

import math
from dataclasses import dataclass, replace

import numpy as np

from companion.control.plus import lag, measured, mismatch, predictor
from companion.control.plus.lag import LagMemory
from companion.control.plus.mismatch import NOTHING, Mismatch, MismatchMemory
from companion.control.plus.nominal_plant import Acting, carry
from companion.control.plus.predictor import PredictorMemory, PredictorRecord
from companion.control.plus.settings import PlusSettings
from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2
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
    sigma_low_passed: Array
    """(3,) C(s) σ̂."""
    actuation: Array
    """(3, 2) acceleration and its rate: by the measured tilt for x and y, modelled for z."""
    modelled: Array
    """(3, 2) the same by the identified response to the commands alone."""
    lag: LagMemory
    mismatch: MismatchMemory
    learnt: Mismatch
    tilted: Array
    """(2,) acceleration by the measured tilt, as identified."""
    velocity: Array
    """(3,) as measured."""


def start(settings: PlusSettings, state: VehicleState) -> Sensed:
    """Nothing learnt yet, at a state."""
    s = settings
    position, velocity = np.array(state.position_enu_m), np.array(state.velocity_enu_m_s)
    tilted = measured.tilt_acceleration(state, GRAVITY_M_S2 * s.plant.tilt_gain)
    actuation = np.vstack([tilted, np.zeros(2)])
    sigma = np.array(s.held_sigma) if s.held_sigma is not None else np.zeros(3)
    unknown = np.full(3, _SIGMA_DEVIATION_M_S2)
    return Sensed(
        predictor.start(s.noise, position, velocity, sigma, unknown),
        sigma,
        actuation,
        actuation,
        lag.start(),
        mismatch.start(),
        NOTHING,
        tilted[:, 0],
        velocity,
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
    position, velocity = np.array(state.position_enu_m), np.array(state.velocity_enu_m_s)
    x = np.empty((3, 4))
    x[:, :2], x[:, 2:] = before.predictor.estimate[:, :2], before.modelled
    sigma = before.predictor.estimate[:, 2]
    until = (now_s, now_s, now_s)
    modelled = carry(s.plant, x, sigma, before_s, until, acting)[:, 2:]

    force = max(LEAST_VERTICAL_M_S2, GRAVITY_M_S2 + float(modelled[2, 0]))
    by_tilt = measured.tilt_acceleration(state, force * s.plant.tilt_gain)
    tilted = by_tilt[:, 0]
    learnt = before.learnt
    actuation = modelled.copy()
    actuation[:2] = learnt.pushes(by_tilt)
    lag_memory = before.lag
    if s.lag is not None and s.held_sigma is None:
        lag_memory = lag.step(s.lag, before.lag, tilted, modelled[:2, 0], modelled[:2, 1], dt)

    drag = s.plant.linear_drag_1_s + learnt.drag_1_s
    drags = [drag if axis.interface == "acceleration" else 0.0 for axis in s.plant.axes]
    known = 0.5 * (before.actuation[:, 0] + actuation[:, 0])
    # The linear part is in the predictor's model; the quadratic one is as known as the tilt.
    speed = math.sqrt(float(velocity @ velocity))
    for i, axis in enumerate(s.plant.axes):
        if axis.interface == "acceleration":
            known[i] -= s.quadratic_drag_1_m * speed * velocity[i]
    bound = np.array(s.sigma_bound_m_s2)
    predicted, record = predictor.step(
        s.noise, before.predictor, np.array(drags), bound, known, position, velocity, dt
    )
    mismatch_memory = before.mismatch
    if s.held_sigma is not None:
        predicted.estimate[:, 2] = s.held_sigma
    elif s.mismatch is not None:
        learnt, mismatch_memory = _learn(s, before, predicted, tilted, velocity, dt)
    sigma = predicted.estimate[:, 2]
    share = 1.0 - np.exp(-np.array(s.low_pass_rad_s) * dt)
    filtered = before.sigma_low_passed + share * (sigma - before.sigma_low_passed)
    sensed = Sensed(
        predicted,
        filtered,
        actuation,
        modelled,
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
    predicted: PredictorMemory,
    tilted: Array,
    velocity: Array,
    dt: float,
) -> tuple[Mismatch, MismatchMemory]:
    """What the identified plant gets wrong of the horizontal motion."""
    assert s.mismatch is not None
    pushed = 0.5 * (before.tilted + tilted)
    moved = 0.5 * (before.velocity + velocity)[:2]
    speed = math.sqrt(float(velocity @ velocity))
    drag = s.plant.linear_drag_1_s + s.quadratic_drag_1_m * speed
    left = (velocity - before.velocity)[:2] / dt - pushed + drag * moved
    memory = mismatch.step(
        s.mismatch, before.mismatch, left, moved, pushed, predicted.estimate[:2, 2], dt
    )
    density = max(_LEAST_DENSITY, *s.noise.acceleration_m_s2_sqrt_hz[:2])
    learnt = mismatch.learnt(s.mismatch, memory, before.learnt, density, dt)
    least = -s.plant.linear_drag_1_s
    return replace(learnt, drag_1_s=max(least, learnt.drag_1_s)), memory
