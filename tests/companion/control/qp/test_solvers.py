"""What is true of every solver behind the port."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.config.resolve import load_flight
from companion.config.yaml_source import ConfigError
from companion.control.qp.daqp_solver import DaqpSolver
from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.qp.solvers import solver_factory
from companion.flight.assemble import make_stack
from tests.companion.control.qp.dense import dense_optimum

BOTH = pytest.mark.parametrize("make", [OsqpSolver, DaqpSolver], ids=["osqp", "daqp"])
ACCURACY = {OsqpSolver: 2e-3, DaqpSolver: 1e-7}
Q, LOW, HIGH = np.array([-1.0, 2.0]), np.full(2, -0.5), np.full(2, 0.5)
OPTIMUM = [0.5, -0.5]


def random_problem(seed, n=6, rows=8):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((n, n))
    p = root @ root.T + 0.5 * np.eye(n)
    a = rng.standard_normal((rows, n))
    return rng, p, a


@BOTH
@settings(deadline=None, derandomize=True, max_examples=40)
@given(seed=st.integers(0, 10_000))
def test_one_solve_after_another_is_the_optimum_of_an_independent_dense_solution(make, seed):
    rng, p, a = random_problem(seed)
    solver = make(p, a)
    for _ in range(4):
        q = 3.0 * rng.standard_normal(len(p))
        inside = a @ rng.standard_normal(len(p))  # so that there is a solution
        lower, upper = (
            inside - rng.uniform(0.0, 1.0, len(a)),
            inside + rng.uniform(0.0, 1.0, len(a)),
        )
        found = solver.solve(q, lower, upper)
        assert found.status == "solved"
        np.testing.assert_allclose(
            found.x, dense_optimum(p, q, a, lower, upper), atol=ACCURACY[make]
        )


@BOTH
def test_a_row_may_be_without_a_bound_and_have_one_again(make):
    solver = make(np.eye(2), np.eye(2))
    without = np.full(2, np.inf)
    atol = ACCURACY[make]
    np.testing.assert_allclose(solver.solve(Q, LOW, HIGH).x, OPTIMUM, atol=atol)
    np.testing.assert_allclose(solver.solve(Q, -without, without).x, -Q, atol=atol)
    np.testing.assert_allclose(solver.solve(Q, -without, HIGH).x, [0.5, -2.0], atol=atol)
    np.testing.assert_allclose(solver.solve(Q, LOW, HIGH).x, OPTIMUM, atol=atol)


@BOTH
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("poison", ["q", "lower", "upper"])
def test_what_is_not_finite_gets_no_x_and_leaves_nothing_behind(make, poison, value):
    solver = make(np.eye(2), np.eye(2))
    vectors = {"q": Q.copy(), "lower": LOW.copy(), "upper": HIGH.copy()}
    vectors[poison][0] = value
    found = solver.solve(**vectors)
    open_ended = (poison, value) in {("lower", -np.inf), ("upper", np.inf), ("upper", 1e300)}
    assert (found.x is not None) == open_ended
    np.testing.assert_allclose(solver.solve(Q, LOW, HIGH).x, OPTIMUM, atol=ACCURACY[make])


@BOTH
@pytest.mark.parametrize("crossed", [(3.0, 2.0), (np.inf, np.inf), (-np.inf, -np.inf)])
def test_there_is_no_answer_for_bounds_that_cross(make, crossed):
    solver = make(np.eye(2), np.eye(2))
    assert solver.solve(Q, LOW, HIGH).x is not None
    low, high = LOW.copy(), HIGH.copy()
    low[0], high[0] = crossed
    found = solver.solve(Q, low, high)
    assert found.x is None
    assert found.status == "bounds cross"
    np.testing.assert_allclose(solver.solve(Q, LOW, HIGH).x, OPTIMUM, atol=ACCURACY[make])


@BOTH
def test_an_infeasible_problem_gets_no_x_and_leaves_nothing_behind(make):
    solver = make(np.eye(2), np.vstack([np.eye(2), np.eye(2)]))
    low, high = np.array([1.0, 1.0, -2.0, -2.0]), np.array([2.0, 2.0, -1.0, -1.0])
    found = solver.solve(Q, low, high)
    assert found.x is None
    assert "infeasible" in found.status
    wide = np.full(4, 0.5)
    np.testing.assert_allclose(solver.solve(Q, -wide, wide).x, OPTIMUM, atol=ACCURACY[make])


@BOTH
def test_the_number_of_iterations_is_bounded(make):
    _, p, a = random_problem(3, n=20, rows=40)
    solver = make(p, a, iterations=1)
    found = solver.solve(np.full(20, -50.0), np.full(40, -1.0), np.full(40, 1.0))
    assert found.x is None
    assert found.iterations <= 10


@BOTH
def test_the_same_solves_give_the_same_bits(make):
    def solutions():
        rng, p, a = random_problem(11)
        solver = make(p, a)
        return [
            solver.solve(rng.standard_normal(len(p)), np.full(8, -0.3), np.full(8, 0.3)).x
            for _ in range(20)
        ]

    for one, other in zip(solutions(), solutions(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_daqp_takes_no_cost_that_has_no_minimum():
    with pytest.raises(np.linalg.LinAlgError):
        DaqpSolver(np.zeros((2, 2)), np.eye(2))


@pytest.mark.parametrize(
    ("controller", "key"), [("mpc-l1", "mpc.solver"), ("mpc-l1-plus", "plus.solver")]
)
def test_daqp_is_refused_with_the_remedy_where_it_is_not_installed(monkeypatch, controller, key):
    config = load_flight(None, {"controller": controller}, {f"controller.{key}": "daqp"})
    monkeypatch.setitem(sys.modules, "daqp", None)
    with pytest.raises(ConfigError, match=r"section (mpc|plus), solver: .*companion\[daqp\]"):
        make_stack(config.controller, config.vehicle, config.mission)


def test_a_solver_is_found_by_its_name():
    assert solver_factory("osqp") is OsqpSolver
    assert solver_factory("daqp") is DaqpSolver
