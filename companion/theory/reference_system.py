"""The closed-loop reference system, and the estimation error against the adaptation rate.

The reference system is what the L1 controller tends to as Γ → ∞ (the paper's eqs. `y1ref`, `uref`;
Hovakimyan & Cao 2010, section 4.1): ``y_ref = A (u_ref + d_ref)`` with
``u_ref = C (r1 - σ_ref)`` and ``σ_ref = M⁻¹ y_ref - u_ref``, which is

``u_ref = C/(1 - C) r1 - C/(M (1 - C)) y_ref``,

simulated here with the exact delay of A(s), as a buffer of a whole number of fine steps.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from companion.control import l1_adaptive
from companion.control.l1_adaptive import Discretisation, L1Gains
from companion.control.matrix_exponential import matrix_exponential
from companion.control.reference_model import Array
from companion.control.transfer_function import TransferFunction
from companion.theory.plant import AxisPlant
from companion.theory.sampled_plant import hold

NEVER_REACHED = 1e9
"""A projection's bound that plays no part."""


@dataclass(frozen=True, slots=True)
class ReferenceRun:
    """A simulated reference system; each array is (steps,)."""

    times_s: Array
    y1_ref_m_s: Array
    u_ref: Array
    d_ref: Array

    def at(self, times_s: Array) -> Array:
        """y1_ref at other times within the run."""
        return np.asarray(np.interp(times_s, self.times_s, self.y1_ref_m_s), dtype=np.float64)


def simulate_reference(
    plant: AxisPlant,
    model: TransferFunction,
    low_pass: TransferFunction,
    times_s: Array,
    r1_m_s: Array,
    disturbance: Callable[[float, float], float],
    initial_velocity_m_s: float = 0.0,
    step_s: float = 1e-3,
) -> ReferenceRun:
    """Simulate y1_ref; second order in the step, the delay exact.

    It begins at rest in the disturbance's first value: at the initial velocity, with the u that
    keeps it there.

    Args:
        plant: A(s).
        model: M(s).
        low_pass: C(s).
        times_s: (n,) rising times at which r1 changes; the last one ends the run.
        r1_m_s: (n,) reference of the velocity, held from each time to the next.
        disturbance: ``f(t, y1)``, in the unit of u, at the input of A(s).
        initial_velocity_m_s: y1 at the first time.
        step_s: largest step; it is shortened so that the delay is a whole number of steps.

    Raises:
        ValueError: lengths differ, or the times do not rise.
    """
    if len(times_s) != len(r1_m_s) or len(times_s) < 2 or (np.diff(times_s) <= 0.0).any():
        raise ValueError("give as many values of r1 as times, at least two, and rising times")
    late = int(np.ceil(plant.delay_s / step_s - 1e-9))
    step = plant.delay_s / late if late else step_s
    count = int(np.ceil((times_s[-1] - times_s[0]) / step - 1e-9)) + 1
    times = times_s[0] + step * np.arange(count)
    held = np.clip(np.searchsorted(times_s, times + 0.5 * step, side="right") - 1, 0, None)
    r1 = np.asarray(r1_m_s, dtype=np.float64)[held]

    a, b, c = plant.rational.state_space()
    law_a, law_b, law_c, law_d = _reference_law(model, low_pass)
    plant_step, plant_input = _zero_order_hold(a, b[:, None], step)
    law_step, law_input = _zero_order_hold(law_a, law_b, step)

    velocity = initial_velocity_m_s
    d = disturbance(float(times[0]), velocity)
    x, through = _resting_plant(a, b, c, velocity)
    u = through - d
    z = _resting_law((law_a, law_b, law_c, law_d), np.array([velocity, velocity]), u)
    y_out, u_out, d_out, w = (np.empty(count) for _ in range(4))
    for k in range(count):
        y_out[k], u_out[k], d_out[k], w[k] = velocity, u, d, u + d
        if k == count - 1:
            break
        # What arrives during this step: the mean of its ends, or as it was before the start.
        begin = w[k - late] if k >= late else through
        if late:
            end = w[k - late + 1] if k + 1 >= late else through
        else:
            end = 2.0 * begin - (w[k - 1] if k else begin)
        x = plant_step @ x + plant_input[:, 0] * (0.5 * (begin + end))
        after = float(x[0])
        z = law_step @ z + law_input[:, 0] * r1[k] + law_input[:, 1] * (0.5 * (velocity + after))
        velocity = after
        u = float(law_c @ z) + law_d * velocity
        d = disturbance(float(times[k + 1]), velocity)
    return ReferenceRun(times, y_out, u_out, d_out)


def largest_prediction_errors(
    plant: AxisPlant,
    model: TransferFunction,
    low_pass: TransferFunction,
    gammas: Array,
    sample_s: float,
    disturbance: Callable[[Array], Array],
    duration_s: float,
    *,
    gain_k: float = 0.0,
    velocity_noise_m_s: Array | None = None,
    discretisation: Discretisation = "exact",
) -> Array:
    """Largest |ỹ| of the implemented law around A(s), from rest, for several adaptation rates.

    Against Γ, on a log-log scale, its slope tends to -½ for a step of d on an A(s) of relative
    degree 1 and to -1 for a smooth d: ``ỹ = -M s/(s + Γ M) σ``, and with such an A(s) a step of d
    is one of σ, while a lag in A(s) makes a smooth σ of it.
    That holds while √(mΓ) is well below the sampling frequency; the bound γ0 falls with -½.

    Args:
        plant: A(s).
        model: M(s).
        low_pass: C(s).
        gammas: (n,) adaptation rates Γ, 1/s².
        sample_s: period of the samples; 1/(10 √(mΓ)) or less for the largest Γ.
        disturbance: (steps,) times s → (steps,) d in the unit of u, at the input of A(s).
        duration_s: of the run.
        gain_k: K of the position loop, the reference at 0; 0 for r1 = 0.
        velocity_noise_m_s: (steps,) added to the measured velocity.
        discretisation: of the law.

    Returns:
        (n,) largest |ỹ| at the samples, m/s; ``inf`` where the loop is unstable and runs away.
    """
    n, steps = len(gammas), int(np.ceil(duration_s / sample_s))
    gains = L1Gains(
        (model,) * n,
        (low_pass,) * n,
        (gain_k,) * n,
        tuple(float(gamma) for gamma in gammas),
        (NEVER_REACHED,) * n,
        discretisation=discretisation,
    )
    held = hold(plant, sample_s, 1.0, 0.0)

    middles: Array = np.asarray((np.arange(steps) + 0.5) * sample_s, dtype=np.float64)
    d = np.asarray(disturbance(middles), dtype=np.float64)
    noise = np.zeros(steps) if velocity_noise_m_s is None else velocity_noise_m_s
    still = np.zeros(n)
    memory = l1_adaptive.start(gains, still, still)
    x = np.zeros((n, len(held.late)))
    sent = np.zeros((held.whole + 2, n))
    largest = np.zeros(n)
    for k in range(steps):
        measured = x[:, 0] + noise[k]
        memory, record = l1_adaptive.step(gains, memory, still, x[:, -1], measured, sample_s)
        largest = np.maximum(largest, np.abs(record.y_tilde_m_s))
        sent = np.vstack([record.u + d[k], sent[:-1]])
        x = x @ held.phi.T + np.outer(sent[held.whole], held.early)
        x += np.outer(sent[held.whole + 1], held.late)
        if np.abs(x).max() > NEVER_REACHED:
            break
    away = np.abs(x[:, 0]) > 1e3 * max(1.0, float(np.abs(d).max()))
    return np.where(away | ~np.isfinite(largest), np.inf, largest)


def _reference_law(
    model: TransferFunction, low_pass: TransferFunction
) -> tuple[Array, Array, Array, float]:
    """State space of ``u = [N_c N_m r1 - N_c D_m y] / ((D_c - N_c) N_m)``, inputs (r1, y)."""
    lead = np.polymul(np.polysub(low_pass.denominator, low_pass.numerator), model.numerator)
    n = len(lead) - 1
    of_r1 = np.polymul(low_pass.numerator, model.numerator) / lead[0]
    of_y = -np.polymul(low_pass.numerator, model.denominator) / lead[0]
    lead = lead / lead[0]
    direct = float(of_y[0]) if len(of_y) == n + 1 else 0.0
    strictly_proper = np.polysub(of_y, direct * lead) if direct else of_y
    b = np.zeros((n, 2))
    for column, numerator in enumerate((of_r1, strictly_proper)):
        kept = numerator[-n:]
        b[n - len(kept) :, column] = kept
    a = np.eye(n, k=1)
    a[:, 0] = -lead[1:]
    c = np.zeros(n)
    c[0] = 1.0
    return a, b, c, direct


def _zero_order_hold(a: Array, b: Array, step_s: float) -> tuple[Array, Array]:
    n, inputs = b.shape
    system = np.zeros((n + inputs, n + inputs))
    system[:n, :n], system[:n, n:] = a, b
    exponential = matrix_exponential(system * step_s)
    return exponential[:n, :n], exponential[:n, n:]


def _resting_plant(a: Array, b: Array, c: Array, velocity: float) -> tuple[Array, float]:
    """State and input with which the plant stays at a velocity."""
    n = len(b)
    equations = np.block([[a, b[:, None]], [c[None, :], np.zeros((1, 1))]])
    solution, *_ = np.linalg.lstsq(equations, np.append(np.zeros(n), velocity), rcond=None)
    return solution[:n], float(solution[n])


def _resting_law(law: tuple[Array, Array, Array, float], inputs: Array, output: float) -> Array:
    """State with which the law's output stays at a value for constant (r1, y)."""
    a, b, c, direct = law
    right = np.append(-(b @ inputs), output - direct * inputs[1])
    solution, *_ = np.linalg.lstsq(np.vstack([a, c]), right, rcond=None)
    return np.asarray(solution, dtype=np.float64)
