"""The L1 adaptive output-feedback controller, extended by a proportional position loop.

Equations of the paper (Pereida & Schoellig 2018), per axis:

* outer loop          ``r1 = K (r2 - y2)``
* output predictor    ``ŷ1 = M(s) (u + σ̂)``; with M(s) = m / (s + m): ``ŷ1' = -m ŷ1 + m (u + σ̂)``
* adaptation law      ``σ̂' = Γ Proj(σ̂, -ỹ)``,  ``ỹ = ŷ1 - y1``
* control law         ``u = C(s) (r1 - σ̂)``,  in the paper ``C(s) = ω / (s + ω)``

Predictor and adaptation law are discretised together and exactly, for the interval between two
samples, with u held and the measured velocity y1 taken as linear in time.  An explicit Euler step
of the same equations can be chosen for study: it is stable only for Γ dt ≤ 1, and chatters long
before the position shows it.

The projection is the smooth operator of Hovakimyan & Cao (2010, appendix B): inside the bound it
does nothing, over the outermost part it scales the outward motion down to nothing.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

import numpy as np

from companion.control.matrix_exponential import matrix_exponential
from companion.control.reference_model import Array
from companion.control.transfer_function import TransferFunction, first_order

Discretisation = Literal["exact", "euler"]


@dataclass(frozen=True, slots=True)
class L1Gains:
    """Gains per axis; tuples of equal length n (three for a vehicle)."""

    reference_model: tuple[TransferFunction, ...]
    """M(s): strictly positive real, of gain 1."""
    low_pass: tuple[TransferFunction, ...]
    """C(s): stable, strictly proper, C(0) = 1."""
    gain_k: tuple[float, ...]
    """Proportional gain K of the position loop, 1/s."""
    gamma: tuple[float, ...]
    """Adaptation rate Γ, 1/s²."""
    sigma_bound: tuple[float, ...]
    """Bound of |σ̂|, in the unit of u."""
    projection_margin: float = 0.1
    """Share ε of the bound over which the projection acts, 0..1."""
    discretisation: Discretisation = "exact"
    """Of predictor and adaptation law."""
    _hash: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check M(s) and C(s).

        Raises:
            ValueError: lengths differ, or an M(s) or C(s) that the law is not made for.
        """
        values = (
            self.reference_model,
            self.low_pass,
            self.gain_k,
            self.gamma,
            self.sigma_bound,
            self.projection_margin,
            self.discretisation,
        )
        object.__setattr__(self, "_hash", hash(values))
        if len({len(value) for value in values[:5]}) != 1:
            raise ValueError("M(s), C(s), K, Γ and the bound of σ̂ must have one value per axis")
        for model in self.reference_model:
            if not model.strictly_positive_real or not math.isclose(model.dc_gain, 1.0):
                raise ValueError(
                    f"M(s) = {model} is not strictly positive real with gain 1, which the "
                    "adaptation law needs"
                )
        for low_pass in self.low_pass:
            if not low_pass.stable or not math.isclose(low_pass.dc_gain, 1.0):
                raise ValueError(f"C(s) = {low_pass} is not stable with C(0) = 1")

    def __hash__(self) -> int:
        """Reckoned once: the gains are looked up at every sample."""
        return self._hash


def first_order_gains(
    m: tuple[float, ...],
    omega: tuple[float, ...],
    gain_k: tuple[float, ...],
    gamma: tuple[float, ...],
    sigma_bound: tuple[float, ...],
    projection_margin: float = 0.1,
    discretisation: Discretisation = "exact",
) -> L1Gains:
    """The paper's choice: ``M_i = m_i / (s + m_i)``, ``C_i = ω_i / (s + ω_i)``."""
    return L1Gains(
        tuple(first_order(value) for value in m),
        tuple(first_order(value) for value in omega),
        gain_k,
        gamma,
        sigma_bound,
        projection_margin,
        discretisation,
    )


# L1Memory and L1Record are made at every tick, and frozen
# they take several times as long to make: change none.
@dataclass(slots=True)
class L1Memory:
    """What the law carries from sample to sample, for n axes."""

    predictor: Array
    """(n, order of M) state of the output predictor; its first entry is ŷ1."""
    sigma_hat: Array
    """(n,) σ̂, in the unit of u."""
    low_pass: Array
    """(n, order of C) state of C(s); its first entry is u."""
    applied_u: Array
    """(n,) the u that went to the vehicle after its limits; the predictor sees this one."""
    last_velocity_m_s: Array
    """(n,) y1 of the last sample."""


@dataclass(slots=True)
class L1Record:
    """Why u is what it is; each array is (n,)."""

    r1_m_s: Array
    y_tilde_m_s: Array
    sigma_hat: Array
    u: Array
    projecting: bool
    """The projection held σ̂ back on some axis."""


@dataclass(frozen=True, slots=True)
class HeldEstimate:
    """What takes the place of σ̂ in the control law while the adaptation is switched off.

    ``offset + velocity y1 + u u_applied``, each (n,).
    """

    offset: Array
    """In the unit of u."""
    velocity: Array
    u: Array


@dataclass(frozen=True, slots=True)
class _Step:
    """Matrices of one step.

    ``adaptation`` (n, p + 1, p + 4) leads from (predictor, σ̂, u, y1 before, y1 after) to
    (predictor, σ̂); ``low_pass`` (n, c, c + 1) from (state of C(s), its input) to that state.

    ``law`` is both and what lies between, for a step without projection: (n, p + c + 3, p + c + 6)
    from (predictor, σ̂, u, y1 before, y1 after, state of C(s), r2, y2) to (predictor, σ̂, state of
    C(s), r1, ỹ).
    """

    adaptation: Array
    low_pass: Array
    law: Array
    near_bound: tuple[float, ...]
    """|σ̂| by axis from which on the projection may act."""


def _largest_order(functions: tuple[TransferFunction, ...]) -> int:
    return max(function.order for function in functions)


def _adaptation_matrix(
    model: TransferFunction, gamma: float, dt_s: float, discretisation: Discretisation
) -> Array:
    """One step of one axis: from (x̂, σ̂, u, y1 before, y1 after) to (x̂, σ̂).

    ``x̂' = A x̂ + B (u + σ̂)``, ``σ̂' = -Γ (C x̂ - y1)``, u held; the exponential of the system with
    its inputs as further states is the exact step for a y1 that is linear in time.
    """
    a, b, c = model.state_space()
    p = model.order
    # (x̂, σ̂, u, y1, slope of y1)
    system = np.zeros((p + 4, p + 4))
    system[:p, :p] = a
    system[:p, p] = b
    system[:p, p + 1] = b
    system[p, :p] = -gamma * c
    system[p, p + 2] = gamma
    system[p + 2, p + 3] = 1.0
    if discretisation == "euler":
        system[p + 2, p + 3] = 0.0
        step = np.eye(p + 4) + system * dt_s
    else:
        step = matrix_exponential(system * dt_s)
    matrix: Array = step[: p + 1].copy()
    slope = step[: p + 1, p + 3] / dt_s
    matrix[:, p + 2] -= slope
    matrix[:, p + 3] = slope
    return matrix


def _padded(matrix: Array, states: int, to_states: int) -> Array:
    """A step's matrix with further states, which stay 0, before the entries after the states."""
    missing = to_states - states
    rows, columns = matrix.shape
    padded = np.zeros((rows + missing, columns + missing))
    keep_rows = [*range(states), *range(to_states, rows + missing)]
    keep_columns = [*range(states), *range(to_states, columns + missing)]
    padded[np.ix_(keep_rows, keep_columns)] = matrix
    return padded


@lru_cache(maxsize=256)
def _step_matrices(gains: L1Gains, dt_s: float) -> _Step:
    p = _largest_order(gains.reference_model)
    adaptation = [
        _padded(_adaptation_matrix(model, gamma, dt_s, gains.discretisation), model.order, p)
        for model, gamma in zip(gains.reference_model, gains.gamma, strict=True)
    ]
    order = _largest_order(gains.low_pass)
    low_pass = []
    for function in gains.low_pass:
        a, b, _ = function.state_space()
        n = function.order
        system = np.zeros((n + 1, n + 1))
        system[:n, :n], system[:n, n] = a, b
        low_pass.append(_padded(matrix_exponential(system * dt_s)[:n], n, order))
    near = math.sqrt(1.0 + gains.projection_margin)
    return _Step(
        np.stack(adaptation),
        np.stack(low_pass),
        np.stack(
            [
                _law_matrix(adapting, filtering, k)
                for adapting, filtering, k in zip(adaptation, low_pass, gains.gain_k, strict=True)
            ]
        ),
        tuple(bound / near for bound in gains.sigma_bound),
    )


def _law_matrix(adaptation: Array, low_pass: Array, gain_k: float) -> Array:
    """The whole law of one axis; see `_Step`."""
    p, c = len(adaptation) - 1, len(low_pass)
    unit = np.eye(p + c + 6)
    filtered, r2, y2, y1 = unit[p + 4 : p + c + 4], unit[-2], unit[-1], unit[p + 3]
    adapted = adaptation @ unit[: p + 4]
    r1 = gain_k * (r2 - y2)
    u = low_pass @ np.vstack([filtered, r1 - adapted[p]])
    return np.vstack([adapted, u, r1, adapted[0] - y1])


def _resting(functions: tuple[TransferFunction, ...], outputs: Array) -> Array:
    """(n, order) states of systems of gain 1 that rest at an output each."""
    states: Array = _resting_at_one(functions) * outputs[:, None]
    return states


@lru_cache(maxsize=64)
def _resting_at_one(functions: tuple[TransferFunction, ...]) -> Array:
    states = np.zeros((len(functions), _largest_order(functions)))
    for i, function in enumerate(functions):
        a, b, _ = function.state_space()
        states[i, : function.order] = -np.linalg.solve(a, b)
    return states


def start(gains: L1Gains, velocity_m_s: Array, u: Array) -> L1Memory:
    """Memory with which the law begins without a bump.

    The predictor starts at the measured velocity and at rest (σ̂ = y1 - u), and u continues from
    the one that the vehicle has.

    Args:
        gains: the gains.
        velocity_m_s: (n,) measured velocity y1.
        u: (n,) control input that is in effect.
    """
    velocity = np.array(velocity_m_s, dtype=float)
    held = np.array(u, dtype=float)
    predictor = _resting(gains.reference_model, velocity)
    low_pass = _resting(gains.low_pass, held)
    return L1Memory(predictor, velocity - held, low_pass, held, velocity)


def step(
    gains: L1Gains,
    memory: L1Memory,
    r2_m: Array,
    position_m: Array,
    velocity_m_s: Array,
    dt_s: float,
    held: HeldEstimate | None = None,
) -> tuple[L1Memory, L1Record]:
    """Advance the law by one sample.

    Args:
        gains: the gains.
        memory: from `start` or from the sample before.
        r2_m: (n,) position reference of the outer controller.
        position_m: (n,) measured position y2.
        velocity_m_s: (n,) measured velocity y1, never a predicted one.
        dt_s: time since the sample before, s; exact for any value.
        held: what the control law uses in place of σ̂; None: σ̂.  Predictor and adaptation law
            run on beside it.

    Returns:
        The new memory and the record; ``record.u`` is the control input.
    """
    matrices = _step_matrices(gains, dt_s)
    p, c = memory.predictor.shape[1], memory.low_pass.shape[1]
    inputs = np.empty((p + c + 6, len(memory.sigma_hat)))
    inputs[:p] = memory.predictor.T
    inputs[p] = memory.sigma_hat
    inputs[p + 1] = memory.applied_u
    inputs[p + 2] = memory.last_velocity_m_s
    inputs[p + 3] = velocity_m_s
    inputs[p + 4 : p + c + 4] = memory.low_pass.T
    inputs[-2] = r2_m
    inputs[-1] = position_m
    after = (matrices.law @ inputs.T[:, :, None])[:, :, 0]
    sigma, r1, y_tilde = after[:, p], after[:, p + c + 1], after[:, p + c + 2]
    low_pass = after[:, p + 1 : p + c + 1]
    projecting = False
    if _near_bound(sigma, matrices.near_bound):
        adapted, projecting = _project(gains, inputs[: p + 4].T, after[:, : p + 1], dt_s)
        after = np.hstack([adapted, after[:, p + 1 :]])
        sigma, y_tilde = after[:, p], after[:, 0] - velocity_m_s
    if projecting or held is not None:
        used = sigma
        if held is not None:
            used = held.offset + held.velocity * velocity_m_s + held.u * memory.applied_u
        filtering = np.hstack([memory.low_pass, (r1 - used)[:, None]])
        low_pass = (matrices.low_pass @ filtering[:, :, None])[:, :, 0]
    u = low_pass[:, 0]
    advanced = L1Memory(after[:, :p], sigma, low_pass, u, velocity_m_s)
    return advanced, L1Record(r1, y_tilde, sigma, u, projecting)


def _near_bound(sigma: Array, near: tuple[float, ...]) -> bool:
    for value, bound in zip(sigma.tolist(), near, strict=True):  # noqa: SIM110 - any() takes longer
        if abs(value) > bound:
            return True
    return False


def with_applied(gains: L1Gains, memory: L1Memory, applied_u: Array) -> L1Memory:
    """Tell the law what the limits after it left of u.

    The predictor must see what the vehicle gets, or the missing part looks like a disturbance; and
    on the axes that were cut, C(s) rests at the limit, all of its states, or u runs away from it
    and takes long to come back.
    """
    if applied_u is memory.applied_u:
        return memory
    cut = memory.low_pass[:, 0] != applied_u
    low_pass = memory.low_pass
    if cut.any():
        low_pass = np.where(cut[:, None], _resting(gains.low_pass, applied_u), low_pass)
    return L1Memory(
        memory.predictor, memory.sigma_hat, low_pass, applied_u, memory.last_velocity_m_s
    )


def _project(gains: L1Gains, inputs: Array, free: Array, dt_s: float) -> tuple[Array, bool]:
    """Repeat the step of the axes that are near the bound, with the projection.

    ``Proj(σ̂, e) = e (1 - f)`` where ``f = ((1 + ε) σ̂² - bound²) / (ε bound²)`` is positive and e
    points outwards.  f is taken at the beginning of the step; a step that would still pass the
    bound, from inside or from the other side, ends on it.

    Args:
        gains: the gains.
        inputs: (n, p + 4) of the step.
        free: (n, p + 1) its result without a projection.
        dt_s: of the step.
    """
    after = free.copy()
    projecting = False
    eps = gains.projection_margin
    for i, bound in enumerate(gains.sigma_bound):
        model = gains.reference_model[i]
        p, last = model.order, free.shape[1] - 1
        own = np.concatenate([inputs[i, :p], inputs[i, last:]])
        old, new = float(inputs[i, last]), float(free[i, last])
        f = ((1.0 + eps) * old * old - bound * bound) / (eps * bound * bound)
        if f > 0.0 and (new - old) * old > 0.0:
            projecting = True
            rate = gains.gamma[i] * max(1e-6, 1.0 - f)
            result = _adaptation_matrix(model, rate, dt_s, gains.discretisation) @ own
            after[i, :p], after[i, last] = result[:p], result[p]
            new = float(result[p])
        if abs(new) > bound:
            projecting = True
            after[i, last] = math.copysign(bound, new)
            own[p] = 0.5 * (old + float(after[i, last]))
            still = _adaptation_matrix(model, 0.0, dt_s, gains.discretisation) @ own
            after[i, :p] = still[:p]
    return after, projecting
