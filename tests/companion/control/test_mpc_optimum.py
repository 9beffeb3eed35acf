"""The plan is the optimum: against the same problem written down and solved another way."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.mpc import Mpc, MpcMemory, MpcSettings
from companion.control.qp.condensed import Weights
from companion.control.qp.daqp_solver import DaqpSolver
from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.reference_model import PositionModel, discretise_position_model
from tests.companion.control.qp.dense import dense_optimum

M, K = (0.5, 0.6, 3.75), (0.8, 0.7, 0.55)
WEIGHTS = Weights(17.0, 0.08, 0.02)
PERIOD_S = 0.05
HORIZON = 9
SLACK_PRICE = 30.0
BOTH = pytest.mark.parametrize("make", [OsqpSolver, DaqpSolver], ids=["osqp", "daqp"])
ACCURACY_M = {OsqpSolver: 1e-2, DaqpSolver: 1e-5}


def settings_of(r_max=1e9, speed=1e3, reach=1e3, absolute=False):
    return MpcSettings(
        model=PositionModel(M, K),
        period_s=PERIOD_S,
        horizon=HORIZON,
        weights=WEIGHTS,
        r_max_m_s2=r_max,
        velocity_limit_m_s=(speed,) * 3,
        box_low_m=(-reach,) * 3,
        box_high_m=(reach,) * 3,
        penalise_absolute_r=absolute,
    )


def situation(seed):
    """Memory, position, velocity and preview somewhere, and not always gentle."""
    rng = np.random.default_rng(seed)
    times = PERIOD_S * np.arange(HORIZON + 2)
    path = rng.uniform(-1.5, 1.5, 3) * np.sin(np.outer(times, rng.uniform(0.2, 3.0, 3)))
    preview = rng.uniform(-1.0, 1.0, 3) + path
    applied = preview[0] + rng.uniform(-0.5, 0.5, 3)
    memory = MpcMemory(applied, applied + rng.uniform(-0.05, 0.05, 3), np.zeros((HORIZON + 1, 3)))
    position = preview[0] + 0.2 * rng.standard_normal(3)
    return memory, position, 0.5 * rng.standard_normal(3), preview


def dense_plan(settings, i, memory, position, velocity, preview, *, soft=True):
    """The optimum of one axis from the paper's cost, with a slack for each soft bound if asked.

    Built by simulating D(s) from each input alone, in the world's coordinates.
    """
    n = settings.horizon + 1
    a, b = discretise_position_model(np.array([M[i]]), np.array([K[i]]), PERIOD_S)
    a, b = a[0], b[0]

    def outputs(state, inputs):
        led = []
        for r in inputs:
            state = a @ state + b * r
            led.append(state)
        return np.array(led).T

    free_p, free_v = outputs(np.array([position[i], velocity[i]]), np.zeros(n))
    by_input = [outputs(np.zeros(2), unit) for unit in np.eye(n)]
    to_p = np.stack([led[0] for led in by_input], axis=1)
    to_v = np.stack([led[1] for led in by_input], axis=1)
    first = np.eye(n) - np.eye(n, k=-1)
    first_known = np.zeros(n)
    first_known[0] = -memory.applied_r_m[i]
    path = np.eye(n + 2)[:, 2:]  # (r before, r applied, plan)
    known = np.zeros(n + 2)
    known[:2] = memory.applied_r_before_m[i], memory.applied_r_m[i]
    second, second_known = np.diff(path, 2, axis=0), np.diff(known, 2)
    target = np.zeros(n) if settings.penalise_absolute_r else preview[:n, i]
    w = settings.weights
    p = w.q * to_p.T @ to_p + w.r * np.eye(n) + w.s * first.T @ first
    q = w.q * to_p.T @ (free_p - preview[1:, i]) - w.r * target + w.s * first.T @ first_known
    full = np.zeros((3 * n, 3 * n))
    full[:n, :n] = p
    full[n:, n:] = SLACK_PRICE * np.eye(2 * n)
    nothing, one = np.zeros((n, n)), np.eye(n)
    rows = np.block([[second, nothing, nothing], [to_v, one, nothing], [to_p, nothing, one]])
    limit = settings.r_max_m_s2 * PERIOD_S**2
    speed, low, high = (
        settings.velocity_limit_m_s[i],
        settings.box_low_m[i],
        settings.box_high_m[i],
    )
    lower = np.concatenate([-limit - second_known, -speed - free_v, low - free_p])
    upper = np.concatenate([limit - second_known, speed - free_v, high - free_p])
    if not soft:
        return dense_optimum(p, q, second, lower[:n], upper[:n])
    found = dense_optimum(full, np.append(q, np.zeros(2 * n)), rows, lower, upper)
    return found[:n]


@BOTH
@settings(deadline=None, derandomize=True, max_examples=40)
@given(
    seed=st.integers(0, 10_000),
    r_max=st.sampled_from([8.0, 60.0, 1e4]),
    speed=st.sampled_from([0.3, 1.0, 1e2]),
    reach=st.sampled_from([0.5, 1.5, 1e2]),
    absolute=st.booleans(),
)
def test_the_plan_of_each_axis_is_that_of_an_independent_dense_solution(
    make, seed, r_max, speed, reach, absolute
):
    chosen = settings_of(r_max, speed, reach, absolute)
    mpc = Mpc(chosen, make)
    now = situation(seed)
    plan, record = mpc.plan(*now)
    said = iter(record.solver_status.split(", "))
    for i in range(3):
        dropped = record.constrained_axes[i] and "soft bounds dropped" in next(said)
        assert not (dropped and make is DaqpSolver)
        expected = dense_plan(chosen, i, *now, soft=not dropped)
        # Where nothing is in the way it is a product; no solver's tolerance is in it.
        atol = ACCURACY_M[make] if record.constrained_axes[i] else 1e-8
        np.testing.assert_allclose(plan[:, i], expected, atol=atol)
    assert record.status == ("solved" if any(record.constrained_axes) else "closed_form")


@BOTH
def test_what_is_solved_and_what_is_not_are_both_met(make):
    """So that the comparison above compares both."""
    tight, wide = Mpc(settings_of(8.0, 0.3, 0.5), make), Mpc(settings_of(), make)
    assert tight.plan(*situation(1))[1].status == "solved"
    assert wide.plan(*situation(1))[1].status == "closed_form"


@BOTH
def test_a_warm_start_leads_to_the_same_plan_as_a_cold_one(make):
    chosen = settings_of(8.0, 0.5, 0.8)
    warm = Mpc(chosen, make)
    for seed in range(12):
        plan, _ = warm.plan(*situation(seed))
        cold, _ = Mpc(chosen, make).plan(*situation(seed))
        np.testing.assert_allclose(plan, cold, atol=ACCURACY_M[make])


@BOTH
@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("what", ["position", "velocity", "preview", "applied"])
def test_what_is_not_finite_is_never_planned_on_and_leaves_nothing_behind(make, what, value):
    chosen = settings_of(8.0, 0.5, 0.8)
    mpc, fresh = Mpc(chosen, make), Mpc(chosen, make)
    memory, position, velocity, preview = situation(3)
    spoilt = {
        "position": position.copy(),
        "velocity": velocity.copy(),
        "preview": preview.copy(),
        "applied": memory.applied_r_m.copy(),
    }
    spoilt[what].flat[1] = value
    remembered = MpcMemory(spoilt["applied"], memory.applied_r_before_m, memory.plan_m)
    plan, record = mpc.plan(remembered, spoilt["position"], spoilt["velocity"], spoilt["preview"])
    assert plan is None
    assert (record.status, record.solver_status) == ("shifted_plan", "input not finite")
    after, _ = mpc.plan(memory, position, velocity, preview)
    expected, _ = fresh.plan(memory, position, velocity, preview)
    np.testing.assert_array_equal(after, expected)


@BOTH
def test_the_box_goes_with_its_anchor_and_the_solvers_are_shared(make):
    chosen = settings_of(reach=0.4)
    mpc = Mpc(chosen, make)
    memory, position, velocity, preview = situation(2)
    here, record = mpc.plan(memory, position, velocity, preview)
    assert any(record.constrained_axes)
    shift = np.array([3.0, -2.0, 1.0])
    moved = MpcMemory(memory.applied_r_m + shift, memory.applied_r_before_m + shift, memory.plan_m)
    there, moved_record = mpc.about(shift).plan(moved, position + shift, velocity, preview + shift)
    np.testing.assert_allclose(there - shift, here, atol=ACCURACY_M[make])
    np.testing.assert_allclose(
        moved_record.predicted_position_m - shift,
        record.predicted_position_m,
        atol=ACCURACY_M[make],
    )
    assert mpc.settings.box_high_m == (0.4, 0.4, 0.4)
