import dataclasses
import gc
import json
import math
import sys

import casadi
import numpy as np
import pytest

from companion.config.resolve import load_flight
from companion.experiments.computing_time import (
    WARM_UP,
    WHAT,
    measure_computing_time,
    nonlinear_settings,
)
from companion.experiments.flight_store import MissingExtraError
from companion.experiments.nonlinear_mpc import NonlinearMpc
from companion.experiments.point_mass import HOVER, INPUTS, STATES, PointMass
from companion.experiments.timed_flights import NonlinearFlight, SimulatedVehicle
from companion.trajectories.harmonic import TEST_TRAJECTORIES

SOLVERS = ("ipopt", "sqp", "rti")
AT_REST = (0.0, 0.0, 1.2, *(0.0,) * (STATES - 3))
TOLERANCE = 1e-5


@pytest.fixture(scope="module")
def settings():
    return nonlinear_settings(load_flight(None, {"trajectory": 4}, {}))


@pytest.fixture(scope="module")
def controllers(settings):
    return {solver: NonlinearMpc(settings, solver) for solver in SOLVERS}


def resting_at(controller, point_m):
    return np.tile(point_m, (len(controller.preview_times_s), 1))


def flown(state, inputs, duration_s, model, step_s=0.0025):
    for _ in range(round(duration_s / step_s)):
        state = model.rk4(math, state, inputs, step_s)
    return state


def test_hover_thrust_holds_a_level_vehicle_still():
    assert PointMass().derivative(math, AT_REST, HOVER) == pytest.approx([0.0] * STATES, abs=1e-12)


def test_attitude_answers_a_step_as_the_second_order_system_it_is_said_to_be():
    model = PointMass(attitude_frequency_rad_s=12.0, attitude_damping=0.8)
    damped = 12.0 * math.sqrt(1.0 - 0.8**2)
    for time_s in (0.05, 0.1, 0.3):
        state = flown(AT_REST, (0.0, 0.2, HOVER[2]), time_s, model)
        decay = math.exp(-0.8 * 12.0 * time_s)
        turn = math.cos(damped * time_s) + 0.8 * 12.0 / damped * math.sin(damped * time_s)
        assert state[7] == pytest.approx(0.2 * (1.0 - decay * turn), abs=1e-6)
        assert state[6] == 0.0


@pytest.mark.parametrize(
    ("roll", "pitch", "axis", "sign"), [(0.0, 0.2, 3, 1.0), (0.2, 0.0, 4, -1.0)]
)
def test_positive_pitch_accelerates_forward_and_positive_roll_to_the_right(roll, pitch, axis, sign):
    state = list(AT_REST)
    state[6], state[7] = roll, pitch
    slope = PointMass().derivative(math, state, (roll, pitch, HOVER[2]))
    assert slope[axis] == pytest.approx(sign * HOVER[2] * math.sin(0.2))


def test_drag_ends_a_held_tilt_at_the_speed_at_which_it_balances_the_push():
    thrust = HOVER[2] / math.cos(0.1)
    state = flown(AT_REST, (0.0, 0.1, thrust), 60.0, PointMass(), step_s=0.02)
    speed = state[3]
    assert 0.15 * speed + 0.02 * speed**2 == pytest.approx(HOVER[2] * math.tan(0.1), rel=1e-5)


def test_symbols_and_floats_move_the_vehicle_alike():
    x, u = casadi.SX.sym("x", STATES), casadi.SX.sym("u", INPUTS)
    symbolic = casadi.Function("f", [x, u], [casadi.vertcat(*PointMass().rk4(casadi, x, u, 0.03))])
    rng = np.random.default_rng(3)
    for _ in range(20):
        state = rng.uniform(-1.0, 1.0, STATES).tolist()
        inputs = (*rng.uniform(-0.5, 0.5, 2).tolist(), 9.0)
        expected = PointMass().rk4(math, state, inputs, 0.03)
        assert symbolic(state, inputs).full().ravel() == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("solver", SOLVERS)
def test_hovering_where_it_should_be_it_plans_to_stay(controllers, solver):
    controller = controllers[solver]
    _, applied, record = controller.step(
        controller.start(), AT_REST, resting_at(controller, AT_REST[:3])
    )
    assert applied == pytest.approx(HOVER, abs=TOLERANCE)
    assert record.inputs == pytest.approx(np.tile(HOVER, (34, 1)), abs=TOLERANCE)
    assert record.states == pytest.approx(np.tile(AT_REST, (35, 1)), abs=TOLERANCE)


def test_a_plan_to_a_far_point_obeys_every_bound_and_the_dynamics(settings, controllers):
    controller = controllers["ipopt"]
    memory, state = controller.start(), [*AT_REST]
    peak_tilt = peak_speed = 0.0
    for _ in range(30):
        preview = resting_at(controller, (2.8, -2.8, 1.2))
        memory, applied, record = controller.step(memory, state, preview)
        assert record.converged
        tilt = np.hypot(record.inputs[:, 0], record.inputs[:, 1])
        assert tilt.max() <= settings.tilt_limit_rad + TOLERANCE
        assert record.inputs[:, 2].min() >= settings.thrust_low_m_s2 - TOLERANCE
        assert record.inputs[:, 2].max() <= settings.thrust_high_m_s2 + TOLERANCE
        assert (np.abs(record.states[1:, 3:6]) <= np.add(settings.velocity_limit_m_s, 1e-5)).all()
        for k in range(settings.horizon + 1):
            onward = settings.model.rk4(math, record.states[k], record.inputs[k], 0.03)
            assert record.states[k + 1] == pytest.approx(onward, abs=TOLERANCE)
        peak_tilt = max(peak_tilt, float(tilt.max()))
        peak_speed = max(peak_speed, float(np.abs(record.states[:, 3:5]).max()))
        state = record.states[1]
        assert applied == pytest.approx(tuple(record.inputs[0]))
    assert peak_tilt == pytest.approx(settings.tilt_limit_rad, abs=1e-3)
    assert peak_speed == pytest.approx(3.0, abs=1e-3)


def test_a_plan_to_a_point_outside_the_geofence_stays_inside_it(settings, controllers):
    controller = controllers["ipopt"]
    state = (2.8, *AT_REST[1:])
    _, _, record = controller.step(
        controller.start(), state, resting_at(controller, (4.0, 0.0, 1.2))
    )
    assert record.converged
    assert record.states[:, 0].max() == pytest.approx(settings.box_high_m[0], abs=1e-3)


def test_a_climb_stays_within_thrust_and_climb_rate(settings, controllers):
    controller = controllers["ipopt"]
    _, _, record = controller.step(
        controller.start(), AT_REST, resting_at(controller, (0.0, 0.0, 3.9))
    )
    assert record.converged
    assert record.inputs[:, 2].max() == pytest.approx(settings.thrust_high_m_s2, abs=1e-2)
    assert record.states[:, 5].max() == pytest.approx(1.5, abs=1e-3)


def test_solvers_agree_on_the_solution_while_tracking(controllers):
    vehicle = SimulatedVehicle(TEST_TRAJECTORIES[4], np.random.default_rng(7))
    flight = NonlinearFlight("sqp", controllers["sqp"], vehicle)
    for _ in range(100):
        flight.advance()
    preview = vehicle.trajectory.position(vehicle.time_s + controllers["sqp"].preview_times_s)
    plans = {}
    for solver in SOLVERS:
        _, _, plans[solver] = controllers[solver].step(flight.memory, vehicle.state, preview)
    assert plans["ipopt"].converged
    assert plans["sqp"].converged
    assert plans["sqp"].inputs == pytest.approx(plans["ipopt"].inputs, abs=1e-4)
    assert plans["sqp"].states == pytest.approx(plans["ipopt"].states, abs=1e-4)
    assert plans["rti"].inputs[:, :2] == pytest.approx(plans["ipopt"].inputs[:, :2], abs=1e-2)


def test_the_next_plan_starts_from_the_last_one_shifted(controllers):
    controller = controllers["ipopt"]
    preview = TEST_TRAJECTORIES[4].position(6.0 + controller.preview_times_s)
    memory, applied, record = controller.step(controller.start(), AT_REST, preview)
    assert memory.applied == applied
    stages = memory.guess[:-13].reshape(34, 16)
    assert stages[:, :STATES] == pytest.approx(record.states[1:])
    assert stages[:-1, -INPUTS:] == pytest.approx(record.inputs[1:])
    assert memory.guess[-13:-INPUTS] == pytest.approx(record.states[-1])
    shifted = TEST_TRAJECTORIES[4].position(6.03 + controller.preview_times_s)
    _, _, warm = controller.step(memory, record.states[1], shifted)
    assert warm.converged
    assert 2 * warm.iterations < record.iterations


@pytest.mark.parametrize(("solver", "converges"), [("ipopt", True), ("sqp", True), ("rti", False)])
def test_it_tracks_trajectory_4_to_a_centimetre(controllers, solver, converges):
    vehicle = SimulatedVehicle(TEST_TRAJECTORIES[4], np.random.default_rng(7))
    flight = NonlinearFlight(solver, controllers[solver], vehicle)
    errors_m, converged = [], []
    for _ in range(120):
        (timing,) = flight.advance()
        errors_m.append(flight.error_m())
        converged.append(timing.converged)
    assert vehicle.time_s == pytest.approx(3.6)
    assert max(errors_m) < 0.01
    assert all(converged) is converges


def test_the_comparison_has_each_method_fly_and_is_fit_for_json():
    result = measure_computing_time(ticks=40, seed=2)
    assert gc.isenabled()
    said = json.loads(json.dumps(dataclasses.asdict(result), allow_nan=False))
    assert [method["name"] for method in said["methods"]] == list(WHAT)
    assert (said["horizon"], said["period_s"], said["ticks"]) == (33, 0.03, 40)
    linear = result.method("linear")
    for method in result.methods:
        assert 0 < method.plans <= 40 - WARM_UP
        assert 0.0 < method.median_us <= method.p99_us <= method.max_us
        assert method.ratio == pytest.approx(method.median_us / linear.median_us)
    assert linear.plans == result.method("nonlinear_ipopt").plans == 40 - WARM_UP
    assert linear.median_us < result.method("linear_stack").median_us
    assert result.method("linear_bounded").mean_error_m is None
    assert result.method("nonlinear_rti").converged_share is None
    for name in ("linear", "nonlinear_ipopt", "nonlinear_sqp"):
        assert result.method(name).converged_share == 1.0
    for name in ("linear", "linear_stack", "nonlinear_ipopt", "nonlinear_sqp", "nonlinear_rti"):
        assert result.method(name).mean_error_m < 0.05


def test_only_times_differ_between_two_runs_of_a_seed():
    one, two = (measure_computing_time(ticks=10, seed=4) for _ in range(2))
    other = measure_computing_time(ticks=10, seed=5)

    def deterministic(result):
        return [(m.plans, m.iterations, m.mean_error_m) for m in result.methods]

    assert deterministic(one) == deterministic(two)
    assert deterministic(one) != deterministic(other)


def test_too_few_ticks_are_refused():
    with pytest.raises(ValueError, match=f"more than {WARM_UP}"):
        measure_computing_time(ticks=WARM_UP)


def test_without_casadi_the_error_says_how_to_get_it(monkeypatch, settings):
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'companion\[nonlinear\]'"):
        measure_computing_time(ticks=40, seed=1)
    with pytest.raises(MissingExtraError):
        NonlinearMpc(settings)


def test_a_controller_without_an_mpc_has_no_nonlinear_counterpart():
    config = load_flight(None, {"trajectory": 4, "controller": "l1"}, {})
    with pytest.raises(ValueError, match="l1 has no MPC"):
        nonlinear_settings(config)
