"""Many sampled loops of one axis at once: candidates of gains times the plants of a family.

The laws are those that fly: the L1 controller's step, the carrying of the state over the delay and
the MPC's closed form are applied to basis vectors, as `companion.theory.sampled_data` does, and the
plant is held exactly.  What comes out is a matrix of one period of the MPC for each pair of a
candidate and a plant, through which all trajectories go together.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from companion.control import delay, l1_adaptive
from companion.control.matrix_exponential import matrix_exponential
from companion.control.qp.condensed import Weights, condense
from companion.control.reference_model import Array, discretise_position_model
from companion.identification.recommend_plants import Member
from companion.identification.recommend_run import Loops, transposed
from companion.theory.sampled_plant import HeldPlant, hold

_UNREACHED = 1e100
_LAW_INPUTS = 7


@dataclass(frozen=True, slots=True)
class Candidates:
    """Gains of one axis; each array is (candidates,)."""

    m: Array
    omega: Array
    k: Array
    gamma: Array
    horizon: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Rates:
    """How often what runs, and what the controller knows of the delay."""

    sample_s: float
    samples_per_plan: int
    known_delay_s: float
    weights: Weights

    @property
    def period_s(self) -> float:
        """Of the MPC."""
        return self.sample_s * self.samples_per_plan


@dataclass(frozen=True, slots=True)
class AxisNoise:
    """Of the reported state of one axis."""

    position_m: float
    velocity_m_s: float
    acceleration_m_s2_sqrt_hz: float


@dataclass(frozen=True, slots=True)
class _Law:
    """A step of the L1 law: rows (candidates, 7) that give ŷ, σ̂ and u.

    They are of ŷ, σ̂, u, the velocity of the sample before, the velocity, the position and r2.
    """

    predictor: Array
    sigma_hat: Array
    u: Array


class LoopBuilder:
    """Builds the loops of a family: what does not depend on the gains is reckoned once."""

    def __init__(self, family: tuple[Member, ...], rates: Rates, noise: AxisNoise) -> None:
        """Hold the plants.

        Args:
            family: plants of one axis, of the same order.
            rates: of sampling and planning.
            noise: of the reported state.
        """
        self.family, self.rates, self._noise = family, rates, noise
        self._held = [hold(f.plant, rates.sample_s, f.gain, f.more_delay_s) for f in family]
        self._pushed = [_disturbed(f, rates.sample_s) for f in family]
        self.plant_states = len(self._held[0].late)
        self.sent = 1 + max(held.whole for held in self._held)
        # Those on which the carried state depends, and three for their second difference.
        self.references = max(3, int(np.ceil(rates.known_delay_s / rates.period_s - 1e-9)) + 1)
        self._gamma_shares = sorted({member.gamma_share for member in family})
        # plant, inputs on their way, ŷ, σ̂, last velocity, references
        self.states = self.plant_states + self.sent + 3 + self.references

    @property
    def position_at(self) -> int:
        """Index of the position among the states."""
        return self.plant_states - 1

    def loops(self, candidates: Candidates) -> Loops:
        """The loops of all pairs."""
        plan, preview = self._plan(candidates)
        laws = {share: self._law(candidates, share) for share in self._gamma_shares}
        samples = [
            self._sample(laws[member.gamma_share], held)
            for member, held in zip(self.family, self._held, strict=True)
        ]
        sample = np.stack([matrix for matrix, _ in samples])
        measured = np.stack([columns for _, columns in samples])
        count, n = len(candidates.m), self.states
        pushed = np.zeros((len(self.family), 1, n, 1))
        for i, column in enumerate(self._pushed):
            pushed[i, 0, : self.plant_states, 0] = column
        plans = np.broadcast_to(plan, (len(self.family), *plan.shape)).copy()
        for i, member in enumerate(self.family):
            if member.held:
                plans[i] = np.eye(n)
                plans[i, :, n - self.references :] = 0.0
        period = plans
        reference = np.zeros((len(self.family), count, n, 1))
        reference[:, :, n - self.references] = 1.0
        gust = np.zeros_like(reference)
        noise = np.zeros((len(self.family), count, n, n))
        position, velocity = self._noise.position_m, self._noise.velocity_m_s
        scale = np.array([velocity, position])
        density = self._noise.acceleration_m_s2_sqrt_hz / np.sqrt(self.rates.sample_s)
        for k in range(self.rates.samples_per_plan):
            columns = measured.copy()
            if k == 0:  # the plan sees the same noise as the sample that it is made on
                through = plans[..., [0, self.position_at]]
                through[:, :, 0, 0] -= 1.0
                through[:, :, self.position_at, 1] -= 1.0
                columns = columns + sample @ through
            columns = columns * scale
            drift = density * pushed
            noise = sample @ noise @ transposed(sample)
            noise = noise + columns @ transposed(columns) + drift @ transposed(drift)
            period, reference = sample @ period, sample @ reference
            gust = sample @ gust + pushed
        return Loops(
            period, reference[..., 0], gust[..., 0], noise, preview,
            self.position_at, self.plant_states, self.plant_states + self.sent + 1,
            n - self.references,
        )  # fmt: skip

    def _plan(self, candidates: Candidates) -> tuple[Array, Array]:
        """(candidates, n, n) of a plan at the state, and the preview's weights."""
        rates, n = self.rates, self.states
        count, first = len(candidates.m), n - self.references
        rows = [
            _first_row(float(m), float(k), h, rates.period_s, rates.weights)
            for m, k, h in zip(candidates.m, candidates.k, candidates.horizon, strict=True)
        ]
        carried = self._carried(candidates)
        plan = np.tile(np.eye(n), (count, 1, 1))
        plan[:, first + 1 :, first:] = 0.0
        for j in range(1, self.references):
            plan[:, first + j, first + j - 1] = 1.0
        state = np.stack([row[:2] for row in rows])
        plan[:, first] = (state[:, :, None] * carried).sum(axis=1)
        plan[:, first, first] += np.array([row[2] for row in rows])
        preview = np.zeros((count, max(candidates.horizon) + 2))
        for i, row in enumerate(rows):
            ahead = candidates.horizon[i] + 1
            preview[i, 1 : ahead + 1] += row[3 : 3 + ahead]
            preview[i, :ahead] += row[3 + ahead :]
        return plan, preview

    def _carried(self, candidates: Candidates) -> Array:
        """(candidates, 2, n): position and velocity at the time at which a plan acts."""
        rates, n = self.rates, self.states
        count, first = len(candidates.m), n - self.references
        m, k = tuple(candidates.m.tolist()), tuple(candidates.k.tolist())
        matrix = np.zeros((count, 2, n))
        for column in (0, self.position_at, *range(first, n)):
            one = np.zeros(n)
            one[column] = 1.0
            applied = tuple(
                delay.AppliedReference(
                    rates.known_delay_s - (j + 1) * rates.period_s, np.full(count, one[first + j])
                )
                for j in reversed(range(self.references))
            )
            p, v = np.full(count, one[self.position_at]), np.full(count, one[0])
            state = delay.carry(m, k, p, v, 0.0, rates.known_delay_s, applied)
            matrix[:, :, column] = np.stack(state, axis=1)
        return matrix

    def _sample(self, law: _Law, held: HeldPlant) -> tuple[Array, Array]:
        """One sample.

        Returns:
            What it makes of the state (candidates, n, n), and of the errors (candidates, n, 2) of
            the measured velocity and position.
        """
        n, np_ = self.states, self.plant_states
        at_y = np_ + self.sent
        predictor, sigma, u = law.predictor, law.sigma_hat, law.u
        count = len(u)
        # Columns of the law: ŷ, σ̂, u, last velocity, velocity, position, r2.
        sources = [at_y, at_y + 1, np_, at_y + 2, 0, self.position_at, n - self.references]
        rows = np.zeros((count, 3, n))
        for k, source in enumerate(sources):
            rows[:, 0, source] += predictor[:, k]
            rows[:, 1, source] += sigma[:, k]
            rows[:, 2, source] += u[:, k]
        matrix = np.zeros((count, n, n))
        columns = np.zeros((count, n, 2))
        matrix[:, :np_, :np_] = held.phi
        with_new = np.zeros((count, self.sent + 1, n))
        with_new[:, 0] = rows[:, 2]
        with_new[:, 1:, np_ : np_ + self.sent] = np.eye(self.sent)
        new_columns = np.zeros((count, self.sent + 1, 2))
        new_columns[:, 0] = u[:, 4:6]
        for share, at in ((held.early, held.whole), (held.late, held.whole + 1)):
            matrix[:, :np_] += share[None, :, None] * with_new[:, at, None]
            columns[:, :np_] += share[None, :, None] * new_columns[:, at, None]
        matrix[:, np_:at_y] = with_new[:, :-1]
        columns[:, np_:at_y] = new_columns[:, :-1]
        matrix[:, at_y : at_y + 2] = rows[:, :2]
        columns[:, at_y] = predictor[:, 4:6]
        columns[:, at_y + 1] = sigma[:, 4:6]
        matrix[:, at_y + 2, 0] = 1.0
        columns[:, at_y + 2, 0] = 1.0
        matrix[:, n - self.references :, n - self.references :] = np.eye(self.references)
        return matrix, columns

    def _law(self, candidates: Candidates, gamma_share: float) -> _Law:
        """What a step of the law makes of basis vectors."""
        count = len(candidates.m)
        gains = l1_adaptive.first_order_gains(
            tuple(candidates.m.tolist()),
            tuple(candidates.omega.tolist()),
            tuple(candidates.k.tolist()),
            tuple((gamma_share * candidates.gamma).tolist()),
            (_UNREACHED,) * count,
        )
        rows = np.zeros((3, count, _LAW_INPUTS))
        for k in range(_LAW_INPUTS):
            one = np.zeros((_LAW_INPUTS, count))
            one[k] = 1.0
            memory = l1_adaptive.L1Memory(one[0][:, None], one[1], one[2][:, None], one[2], one[3])
            after, record = l1_adaptive.step(
                gains, memory, one[6], one[5], one[4], self.rates.sample_s
            )
            rows[:, :, k] = after.predictor[:, 0], after.sigma_hat, record.u
        return _Law(*rows)


@lru_cache(maxsize=4096)
def _first_row(m: float, k: float, horizon: int, period_s: float, weights: Weights) -> Array:
    """The closed form's row of the reference that is applied, of (x, r before, y*, targets)."""
    a, b = discretise_position_model(np.array([m]), np.array([k]), period_s)
    row: Array = condense(a[0], b[0], horizon, weights).gain[0]
    return row


def _disturbed(member: Member, sample_s: float) -> Array:
    """What the family's disturbance of 1, held over a sample, adds to the plant's state."""
    a, _, _ = member.plant.rational.state_space()
    n = len(a)
    system = np.zeros((n + 2, n + 2))
    system[:n, :n], system[n, 0] = a, 1.0
    system[n - len(member.push) : n, n + 1] = member.push
    held: Array = matrix_exponential(system * sample_s)[: n + 1, -1]
    return held
