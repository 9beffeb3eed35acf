"""The MPC: its closed form is the optimum, its constraints hold, its fallbacks are defined."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.mpc import Mpc, MpcSettings
from companion.control.qp.condensed import Weights, condense
from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.qp.port import QpSolution
from companion.control.reference_model import PositionModel, discretise_position_model

M, K = (0.5, 0.6, 3.75), (0.8, 0.7, 0.55)


def make(**changes):
    defaults = {
        "model": PositionModel(M, K),
        "period_s": 0.03,
        "horizon": 20,
        "weights": Weights(17.0, 0.08, 0.02),
        "r_max_m_s2": 1e9,
        "velocity_limit_m_s": (1e3, 1e3, 1e3),
        "box_low_m": (-1e3, -1e3, -1e3),
        "box_high_m": (1e3, 1e3, 1e3),
    }
    return Mpc(MpcSettings(**(defaults | changes)), OsqpSolver)


def preview_of(mpc, origin=(0.0, 0.0, 1.0), speed=1.0):
    t = mpc.preview_times_s
    path = np.stack([np.sin(speed * t), np.cos(speed * t) - 1.0, 0.2 * np.sin(speed * t)], axis=1)
    return path + np.array(origin)


def cost_by_simulation(mpc, plan, position, velocity, preview, previous):
    """The paper's cost, summed up along the discretised D(s), with no matrix of the MPC."""
    s = mpc.settings
    a, b = discretise_position_model(np.array(s.model.m), np.array(s.model.gain_k), s.period_s)
    state = np.stack([position, velocity], axis=1)
    total, last = 0.0, previous
    for k, r in enumerate(plan):
        state = np.einsum("aij,aj->ai", a, state) + b * r[:, None]
        total += s.weights.q * np.sum((preview[k + 1] - state[:, 0]) ** 2)
        target = 0.0 if s.penalise_absolute_r else preview[k]
        total += s.weights.r * np.sum((r - target) ** 2)
        total += s.weights.s * np.sum((r - last) ** 2)
        last = r
    return total


@pytest.mark.parametrize("absolute", [False, True])
def test_the_closed_form_minimises_the_papers_cost(absolute):
    mpc = make(penalise_absolute_r=absolute)
    position, velocity = np.array([0.1, -0.2, 1.1]), np.array([0.5, 0.1, -0.1])
    memory = mpc.start(np.array([0.2, 0.0, 1.0]))
    preview = preview_of(mpc)
    plan, record = mpc.plan(memory, position, velocity, preview)
    assert record.status == "closed_form"
    best = cost_by_simulation(mpc, plan, position, velocity, preview, memory.applied_r_m)
    rng = np.random.default_rng(3)
    for _ in range(40):
        other = plan + 1e-3 * rng.standard_normal(plan.shape)
        worse = cost_by_simulation(mpc, other, position, velocity, preview, memory.applied_r_m)
        assert worse > best


def test_the_prediction_is_where_the_plan_leads():
    mpc = make()
    position, velocity = np.array([0.1, -0.2, 1.1]), np.array([0.5, 0.1, -0.1])
    plan, record = mpc.plan(mpc.start(position), position, velocity, preview_of(mpc))
    s = mpc.settings
    a, b = discretise_position_model(np.array(s.model.m), np.array(s.model.gain_k), s.period_s)
    state = np.stack([position, velocity], axis=1)
    for k, r in enumerate(plan):
        state = np.einsum("aij,aj->ai", a, state) + b * r[:, None]
        np.testing.assert_allclose(record.predicted_position_m[k], state[:, 0], atol=1e-9)


@settings(deadline=None, derandomize=True, max_examples=25)
@given(shift=st.tuples(*[st.floats(-1e4, 1e4, allow_nan=False)] * 3))
def test_the_default_cost_does_not_know_where_the_origin_is(shift):
    mpc = make(r_max_m_s2=50.0)
    position, velocity = np.array([0.1, -0.2, 1.1]), np.array([0.5, 0.1, -0.1])
    memory, preview = mpc.start(position), preview_of(mpc)
    _, here, _ = mpc.step(memory, position, velocity, preview)
    moved = np.array(shift)
    elsewhere = make(r_max_m_s2=50.0, box_low_m=(-1e6,) * 3, box_high_m=(1e6,) * 3)
    _, there, _ = elsewhere.step(
        elsewhere.start(position + moved), position + moved, velocity, preview + moved
    )
    np.testing.assert_allclose(there - moved, here, atol=1e-6)


def test_the_papers_literal_cost_pulls_towards_the_origin():
    mpc = make(penalise_absolute_r=True)
    rest = np.array([5.0, 0.0, 1.0])
    preview = np.tile(rest, (len(mpc.preview_times_s), 1))
    memory, _, _ = mpc.step(mpc.start(rest), rest, np.zeros(3), preview)
    for _ in range(50):
        memory, r, _ = mpc.step(memory, rest, np.zeros(3), preview)
    assert r[0] < rest[0] - 0.05
    assert r[1] == pytest.approx(0.0, abs=1e-9)


def test_the_bound_on_the_second_difference_holds_and_is_the_optimum():
    limit = 20.0
    mpc, free = make(r_max_m_s2=limit), make()
    position, velocity = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    memory, preview = mpc.start(position), preview_of(mpc, speed=2.0)
    plan, record = mpc.plan(memory, position, velocity, preview)
    assert record.status == "solved"
    assert record.r_max_active
    path = np.vstack([memory.applied_r_before_m, memory.applied_r_m, plan])
    assert np.abs(np.diff(path, 2, axis=0)).max() <= limit * 0.03**2 * (1 + 1e-3)
    best = cost_by_simulation(mpc, plan, position, velocity, preview, memory.applied_r_m)
    unbounded, _ = free.plan(memory, position, velocity, preview)
    least = cost_by_simulation(free, unbounded, position, velocity, preview, memory.applied_r_m)
    assert best > least
    rng = np.random.default_rng(5)
    for _ in range(200):
        other = plan + 0.05 * rng.standard_normal(3) * np.linspace(0, 1, len(plan))[:, None]
        trial = np.vstack([memory.applied_r_before_m, memory.applied_r_m, other])
        if np.abs(np.diff(trial, 2, axis=0)).max() <= limit * 0.03**2:
            worse = cost_by_simulation(mpc, other, position, velocity, preview, memory.applied_r_m)
            assert worse > best - 1e-6


def test_a_soft_velocity_limit_is_kept_where_it_can_be():
    mpc = make(velocity_limit_m_s=(0.3, 1e3, 1e3))
    position = np.array([0.0, 0.0, 1.0])
    memory, preview = mpc.start(position), preview_of(mpc)
    _, record = mpc.plan(memory, position, np.zeros(3), preview)
    assert record.constrained_axes == (True, False, False)
    speed = np.diff(record.predicted_position_m[:, 0]) / mpc.settings.period_s
    assert speed.max() < 0.33
    _, free = make().plan(memory, position, np.zeros(3), preview)
    assert (np.diff(free.predicted_position_m[:, 0]) / mpc.settings.period_s).max() > 0.4


def test_a_start_outside_the_soft_bounds_is_no_infeasible_problem():
    mpc = make(velocity_limit_m_s=(0.1,) * 3, box_high_m=(0.0, 0.0, 0.5))
    position = np.array([1.0, 1.0, 2.0])
    plan, record = mpc.plan(mpc.start(position), position, np.full(3, 2.0), preview_of(mpc))
    assert record.status == "solved"
    assert plan is not None


class FailingSolver:
    """Never finds anything."""

    def solve(self, q, lower, upper):
        return QpSolution(None, "primal infeasible", 7)


def test_a_failed_solve_falls_back_to_the_shifted_plan_then_to_the_clipped_closed_form():
    free = make()
    position, velocity = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    preview = preview_of(free, speed=2.0)
    memory, _, _ = free.step(free.start(position), position, velocity, preview)
    settings_ = MpcSettings(
        PositionModel(M, K), 0.03, 20, Weights(17.0, 0.08, 0.02), 20.0,
        (1e3,) * 3, (-1e3,) * 3, (1e3,) * 3,
        shifted_plans_at_most=2,
    )  # fmt: skip
    failing = Mpc(settings_, lambda p, a: FailingSolver())
    plan = memory.plan_m
    memory, r, record = failing.step(memory, position, velocity, preview)
    assert record.status == "shifted_plan"
    np.testing.assert_array_equal(r, plan[1])
    memory, r, record = failing.step(memory, position, velocity, preview)
    np.testing.assert_array_equal(r, plan[2])
    before = memory
    memory, r, record = failing.step(memory, position, velocity, preview)
    assert record.status == "clipped_closed_form"
    jump = r - 2 * before.applied_r_m + before.applied_r_before_m
    assert np.abs(jump).max() <= 20.0 * 0.03**2 + 1e-12
    assert memory.failures == 3


def test_differences_start_from_what_was_applied_last():
    """A huge weight on the difference keeps r at the applied one, not at the plan's."""
    mpc = make(weights=Weights(1e-6, 1e-6, 1e6))
    applied = np.array([3.0, -2.0, 1.5])
    _, r, _ = mpc.step(mpc.start(applied), np.zeros(3), np.zeros(3), preview_of(mpc))
    np.testing.assert_allclose(r, applied, atol=1e-6)


def test_a_cost_without_a_minimum_is_refused():
    a, b = discretise_position_model(np.array([0.5]), np.array([0.8]), 0.03)
    with pytest.raises(ValueError, match="positive definite"):
        condense(a[0], b[0], 10, Weights(0.0, 0.0, 0.0))


@pytest.mark.parametrize("poison", ["q", "lower"])
def test_osqp_recovers_after_being_fed_with_nan(poison):
    solver = OsqpSolver(np.eye(2), np.eye(2))
    q, low, high = np.array([-1.0, 2.0]), np.full(2, -0.5), np.full(2, 0.5)
    bad_q, bad_low = (q * np.nan, low) if poison == "q" else (q, low * np.nan)
    assert solver.solve(bad_q, bad_low, high).x is None
    np.testing.assert_allclose(solver.solve(q, low, high).x, [0.5, -0.5], atol=1e-4)


def test_osqp_gives_no_x_for_an_infeasible_problem_and_recovers():
    solver = OsqpSolver(np.eye(2), np.vstack([np.eye(2), np.eye(2)]))
    q = np.array([-1.0, 2.0])
    low, high = np.array([1.0, 1.0, -2.0, -2.0]), np.array([2.0, 2.0, -1.0, -1.0])
    solution = solver.solve(q, low, high)
    assert solution.x is None
    assert "infeasible" in solution.status
    wide = np.full(4, 0.5)
    np.testing.assert_allclose(solver.solve(q, -wide, wide).x, [0.5, -0.5], atol=1e-4)


@pytest.mark.parametrize("crossed", [(3.0, 2.0), (np.inf, np.inf), (-np.inf, -np.inf)])
def test_osqp_never_answers_for_bounds_that_it_did_not_take(crossed):
    solver = OsqpSolver(np.eye(2), np.eye(2))
    q, low, high = np.array([-1.0, 2.0]), np.full(2, -0.5), np.full(2, 0.5)
    assert solver.solve(q, low, high).x is not None
    low[0], high[0] = crossed
    assert solver.solve(q, low, high).x is None


def test_a_tick_far_outside_all_bounds_has_a_bounded_number_of_iterations():
    mpc = make(
        r_max_m_s2=20.0, velocity_limit_m_s=(0.5,) * 3, box_low_m=(-1.0,) * 3, box_high_m=(1.0,) * 3
    )
    rng = np.random.default_rng(7)
    worst = 0
    for _ in range(30):
        position, velocity = 4.0 * rng.standard_normal(3), 2.0 * rng.standard_normal(3)
        _, r, record = mpc.step(mpc.start(position), position, velocity, preview_of(mpc))
        assert np.isfinite(r).all()
        worst = max(worst, record.iterations)
    assert worst <= 3 * 2 * 1000


@pytest.mark.parametrize("r_max", [1e9, 20.0], ids=["closed form", "solved"])
def test_what_a_plan_returned_is_not_touched_by_the_next(r_max):
    mpc = make(r_max_m_s2=r_max)
    about = mpc.about(np.zeros(3))
    position, preview = np.array([0.0, 0.0, 1.0]), preview_of(mpc, speed=2.0)
    given = position.copy(), preview.copy()
    memory, r, record = mpc.step(mpc.start(position), position, np.zeros(3), preview)
    assert record.status == ("closed_form" if r_max > 20.0 else "solved")
    returned = (memory.applied_r_m, memory.applied_r_before_m, memory.plan_m, r)
    returned += (record.predicted_position_m,)
    copies = [array.copy() for array in returned]
    for other in (mpc, about):
        other.step(memory, position + 5.0, np.ones(3), preview + 3.0)
        other.step(memory, position * np.nan, np.ones(3), preview)
    for array, copy in zip(returned, copies, strict=True):
        np.testing.assert_array_equal(array, copy)
    np.testing.assert_array_equal(position, given[0])
    np.testing.assert_array_equal(preview, given[1])
