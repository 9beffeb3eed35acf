"""The problem that solvers are timed on: its recorded inputs hold what they say, its reference is
the optimum, and each contender that is installed finds it."""

import numpy as np
import pytest

from benchmarks.tick.closed_form import make as closed_form
from benchmarks.tick.contenders import contenders
from benchmarks.tick.inputs import FOLDER, HORIZONS, SETS, read_recording
from benchmarks.tick.measure import exponent
from benchmarks.tick.problem import (
    AXES,
    closed_form_plan,
    constrained,
    make_problem,
    tick_inputs,
    vectors_of,
)
from benchmarks.tick.race import race
from benchmarks.tick.record import CONDITIONS, HORIZON, MIDDLE, PREVIEW, TICKS, record
from benchmarks.tick.reference import Reference
from companion.control.qp.daqp_solver import DaqpSolver
from companion.control.qp.daqp_solver import installed as daqp_installed
from companion.trajectories.harmonic import TEST_TRAJECTORIES


def share(name, horizon):
    recording = read_recording(name)
    problem = make_problem(horizon, recording.r_max_m_s2)
    return np.mean([constrained(problem, tick).any() for tick in tick_inputs(recording, horizon)])


def test_a_set_is_2400_ticks_with_a_preview_of_80():
    for name in SETS:
        recording = read_recording(name)
        assert len(recording.index) == TICKS * len(TEST_TRAJECTORIES) == 2400
        for key in ("position_m", "velocity_m_s", "previous_m", "before_m"):
            assert getattr(recording, key).shape == (2400, AXES)
        flights = recording.path_m.reshape(len(TEST_TRAJECTORIES), TICKS + PREVIEW, AXES)
        room = len(flights[0]) - recording.index % len(flights[0])
        assert room.min() >= 80 + 2


def test_of_std_a_fifth_to_a_third_of_the_ticks_is_constrained_and_of_hard_nearly_all():
    assert 0.20 <= share("std", HORIZON) <= 0.30
    assert 0.95 <= share("hard", HORIZON) <= 0.99


@pytest.mark.parametrize("horizon", HORIZONS)
def test_the_shares_are_alike_at_each_horizon(horizon):
    assert 0.20 <= share(f"std-{horizon}", horizon) <= 0.30
    assert 0.93 <= share(f"hard-{horizon}", horizon) <= 0.995
    assert len(read_recording(f"std-{horizon}").index) == len(MIDDLE) * len(TEST_TRAJECTORIES)


def test_the_recordings_stay_small():
    assert sum(file.stat().st_size for file in FOLDER.glob("*.npz")) < 1_000_000


@pytest.mark.skipif(not daqp_installed(), reason="the recordings were made with DAQP")
def test_the_script_makes_what_is_kept():
    for name in SETS:
        made, kept = record(CONDITIONS[name], DaqpSolver, ticks=40), read_recording(name)
        # The noise goes on from flight to flight, so only the first one begins alike.
        for key in ("position_m", "velocity_m_s", "previous_m", "before_m"):
            np.testing.assert_allclose(
                getattr(made, key)[:40], getattr(kept, key)[:40], atol=1e-5, rtol=0.0
            )


def test_each_tick_of_a_recording_follows_the_reference_that_was_applied_before():
    recording = read_recording("std")
    follows = np.diff(recording.number) == 1
    follows &= recording.number[1:] % TICKS != 0
    np.testing.assert_array_equal(
        recording.before_m[1:][follows], recording.previous_m[:-1][follows]
    )


def test_the_reference_is_the_optimum_where_a_solver_is_not_needed():
    recording = read_recording("std-30")
    problem = make_problem(30, recording.r_max_m_s2)
    reference = Reference(problem)
    for tick in tick_inputs(recording, 30)[::40]:
        exact = reference.first_input(tick) - tick.preview_m[0]
        free = ~constrained(problem, tick)
        np.testing.assert_allclose(
            exact[free], closed_form_plan(problem, tick)[free, 0], atol=1e-10
        )


def test_the_reference_costs_less_than_any_plan_nearby_that_keeps_the_bounds():
    recording = read_recording("hard-10")
    problem = make_problem(10, recording.r_max_m_s2)
    hessian, second = problem.axes[0].hessian, problem.axes[0].second_difference
    reference = Reference(problem)
    rng = np.random.default_rng(3)
    for tick in tick_inputs(recording, 10)[::60]:
        gradient, lower, upper = (vector[0] for vector in vectors_of(problem, tick))
        best = reference.plan(tick)[0]
        others = second @ best + 0.05 * rng.standard_normal((50, 11))
        others = np.linalg.solve(second, np.clip(others, lower, upper).T).T
        costs = [0.5 * plan @ hessian @ plan + gradient @ plan for plan in (best, *others)]
        assert min(costs[1:]) >= costs[0] - 1e-9


def test_each_contender_finds_the_first_input_to_a_millimetre():
    recording = read_recording("hard-30")
    problem = make_problem(30, recording.r_max_m_s2)
    ticks = tick_inputs(recording, 30)[30:60]
    everyone = contenders()
    runs, left_out = race(everyone, problem, ticks, repeats=1)
    assert set(runs) | set(left_out) == {contender.name for contender in everyone}
    assert "check, then OSQP (ours)" in runs
    reference = Reference(problem)
    exact = np.array([reference.first_input(tick) for tick in ticks])
    for contender in everyone:
        if contender.kind == "floor" or contender.name in left_out:
            continue
        error = np.abs(runs[contender.name].first_m - exact).max()
        assert error <= 1e-3, contender.name
        assert np.isfinite(runs[contender.name].time_us).all()


def test_the_floor_is_the_closed_form():
    recording = read_recording("std-30")
    problem = make_problem(30, recording.r_max_m_s2)
    ticks = tick_inputs(recording, 30)[:5]
    made = closed_form(problem, ticks)
    for k, tick in enumerate(ticks):
        plan = closed_form_plan(problem, tick)
        np.testing.assert_allclose(made.step(k), plan[:, 0] + tick.preview_m[0], atol=1e-10)


def test_an_exponent_is_that_of_the_power():
    assert exponent([10, 20, 80], [3.0 * n**1.5 for n in (10, 20, 80)]) == pytest.approx(1.5)
