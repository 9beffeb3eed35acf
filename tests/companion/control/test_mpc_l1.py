"""The stack mpc-l1 in closed loop on a plain vehicle, and at its seams."""

import math
from dataclasses import replace

import numpy as np
import pytest

from companion.config.models import MissionConfig
from companion.config.resolve import load_flight
from companion.control import l1_adaptive
from companion.control.frameworks import Tick
from companion.flight.assemble import make_stack
from companion.frames import quaternion_from_euler, rotate, yaw_of
from companion.trajectories.harmonic import TEST_TRAJECTORIES
from companion.vehicle_state import VehicleState
from tests.companion.control.nominal_plant import fly

HOVER_S = 4.0


def stack_for(**settings):
    config = load_flight(None, {}, {f"controller.{key}": str(v) for key, v in settings.items()})
    wide = MissionConfig(geofence={"low_m": (-50, -50, -50), "high_m": (50, 50, 50)})
    return make_stack(config.controller, config.vehicle, wide)


def errors_m(stack, number, *, shift=(0.0, 0.0, 0.0), duration_s=HOVER_S + 8.0, **plant):
    """Distances to the trajectory while it is scored, and the rms slew of the tilt command, 1/s."""
    trajectory = TEST_TRAJECTORIES[number]
    moved = np.array(shift)

    def reference(times):
        return trajectory.position(times - HOVER_S) + moved

    start = tuple(reference(np.zeros(1))[0])
    times, positions, tilts, _ = fly(stack, reference, duration_s, start_m=start, **plant)
    error = np.linalg.norm(positions - reference(times), axis=1)[times >= HOVER_S]
    slew = float(np.sqrt(np.mean(np.diff(np.sin(tilts), axis=0) ** 2))) / 0.01
    return error, slew


def test_the_shipped_gains_track_the_figure_eight_to_centimetres_without_chatter():
    error, slew = errors_m(stack_for(), 4)
    assert error.mean() < 0.04
    assert slew < 0.5


def test_a_slower_attitude_does_not_shake_the_shipped_gains():
    nominal, _ = errors_m(stack_for(), 4)
    slower, slew = errors_m(stack_for(), 4, natural_frequency=12.0 / 1.25)
    assert slower.mean() < 2.0 * nominal.mean()
    assert slew < 0.5


def test_moving_the_origin_changes_nothing():
    here, _ = errors_m(stack_for(), 2)
    there, _ = errors_m(stack_for(), 2, shift=(5.0, -3.0, 0.0))
    assert there.mean() == pytest.approx(here.mean(), rel=0.01)


def hover_offset_m(stack, place):
    """Distance from the reference after 25 s of hovering at a place."""
    hold = np.array([place])
    _, positions, _, _ = fly(
        stack, lambda t: np.tile(hold, (len(t), 1)), 25.0, start_m=place, noise=0.0
    )
    return float(np.linalg.norm(positions[-1] - hold[0]))


def test_the_papers_literal_cost_pulls_a_hover_towards_the_origin_and_the_default_does_not():
    """The bias is proportional to the distance from the origin: it is one of the cost."""
    near, far = (5.0, -3.0, 1.2), (10.0, -6.0, 2.4)
    literal = stack_for(**{"mpc.penalise": "absolute_r"})
    bias = hover_offset_m(literal, near)
    assert bias > 0.02
    assert hover_offset_m(literal, far) == pytest.approx(2.0 * bias, rel=0.05)
    assert hover_offset_m(stack_for(), far) < 0.002


def test_a_lasting_push_is_rejected():
    def push(t):
        return (0.8 if t > 2.0 else 0.0, 0.0, 0.0)

    stack = stack_for()
    hold = np.array([[0.0, 0.0, 1.2]])
    times, positions, _, _ = fly(
        stack, lambda t: np.tile(hold, (len(t), 1)), 25.0, disturbance_m_s2=push
    )
    off = np.abs(positions[:, 0])
    assert off[times > 20.0].max() < 0.05
    assert off.max() > 0.05


def state_at(time_s, **changes):
    defaults = {
        "position_enu_m": (0.0, 0.0, 1.2),
        "velocity_enu_m_s": (0.0, 0.0, 0.0),
        "attitude_flu_to_enu": quaternion_from_euler(0.0, 0.0, 0.0),
        "rate_flu_rad_s": (0.0, 0.0, 0.0),
    }
    return VehicleState(time_s, **(defaults | changes))


def hold_reference(times):
    return np.tile([0.0, 0.0, 1.2], (len(times), 1))


def test_the_stack_takes_over_without_a_bump():
    """Leaning and moving as it is, the first command continues what the vehicle does."""
    stack = stack_for()
    attitude = quaternion_from_euler(0.10, -0.05, 0.3)
    moving = {"attitude_flu_to_enu": attitude, "velocity_enu_m_s": (0.4, -0.2, 0.1)}
    memory = stack.start(state_at(10.0, **moving))
    position = (0.4 * 0.01, -0.2 * 0.01, 1.2 + 0.1 * 0.01)
    tick = Tick(state_at(10.01, position_enu_m=position, **moving), 0.0, 0.3)
    _, command, record = stack.step(memory, tick, hold_reference)
    assert record.roll_rad == pytest.approx(0.10, abs=0.02)
    assert record.pitch_rad == pytest.approx(-0.05, abs=0.02)
    assert command.thrust == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("dt", [0.0, -0.01])
def test_time_that_does_not_advance_is_refused(dt):
    stack = stack_for()
    memory = stack.start(state_at(10.0))
    with pytest.raises(ValueError, match="does not advance"):
        stack.step(memory, Tick(state_at(10.0 + dt), 0.0, 0.0), hold_reference)


def test_the_outer_controller_runs_every_period_of_the_autopilots_time_whatever_the_samples():
    stack = stack_for()
    rng = np.random.default_rng(0)
    time_s = 5.0
    memory = stack.start(state_at(time_s))
    runs, begin = 0, time_s
    for _ in range(1000):
        time_s += float(rng.choice([0.008, 0.012]))
        memory, _, record = stack.step(memory, Tick(state_at(time_s), 0.03, 0.0), hold_reference)
        runs += record.outer is not None
        assert len(memory.applied) < 8
    assert runs == pytest.approx((time_s - begin) / 0.03, abs=2)


@pytest.mark.parametrize("gap_s", [0.05, 0.5, 5.0])
def test_a_gap_in_the_samples_neither_breaks_nor_floods_the_outer_controller(gap_s):
    stack = stack_for()
    memory = stack.start(state_at(5.0))
    memory, _, _ = stack.step(memory, Tick(state_at(5.01), 0.03, 0.0), hold_reference)
    memory, command, record = stack.step(
        memory, Tick(state_at(5.01 + gap_s), 0.03, 0.0), hold_reference
    )
    assert record.outer is not None
    assert all(math.isfinite(c) for c in (*command.attitude_flu_to_enu, command.thrust))
    assert memory.outer_due_s > 5.01 + gap_s


def test_limits_hold_whatever_the_reference_asks():
    stack = stack_for()
    memory = stack.start(state_at(5.0))
    for k in range(1, 300):
        tick = Tick(state_at(5.0 + 0.01 * k), 0.03, 0.0)
        memory, command, record = stack.step(memory, tick, lambda t: np.full((len(t), 3), 40.0))
        assert math.hypot(*record.applied_u[:2]) <= math.sin(stack.limits.tilt_rad) + 1e-12
        assert -stack.limits.descent_m_s <= record.applied_u[2] <= stack.limits.climb_m_s
        assert stack.thrust.gains.minimum_thrust - 1e-9 <= command.thrust
        assert command.thrust <= stack.thrust.gains.maximum_thrust + 1e-9


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_reference_that_is_not_finite_never_becomes_a_command(axis):
    """Limits turn a NaN into their own value; it must be stopped before them, and not linger."""
    stack = stack_for()
    memory = stack.start(state_at(5.0))

    def spoilt(times):
        positions = hold_reference(times)
        positions[:, axis] = math.nan
        return positions

    for k in range(1, 30):
        tick = Tick(state_at(5.0 + 0.01 * k), 0.03, 0.0)
        reference = spoilt if 10 <= k < 14 else hold_reference
        memory, command, record = stack.step(memory, tick, reference)
        assert np.isfinite(record.r2_m).all()
        assert command.thrust == pytest.approx(0.5, abs=0.05)
        if reference is spoilt and record.outer is not None:
            assert record.outer.status == "shifted_plan"


def test_a_desired_yaw_that_is_not_finite_is_refused():
    stack = stack_for()
    memory = stack.start(state_at(5.0))
    with pytest.raises(ValueError, match="not finite"):
        stack.step(memory, Tick(state_at(5.01), 0.03, math.nan), hold_reference)


def test_while_the_vehicle_turns_the_thrust_points_where_u_does():
    """The quaternion's own yaw counts: the autopilot follows the quaternion."""
    stack = stack_for()
    memory = stack.start(state_at(5.0))
    for k in range(1, 120):
        tick = Tick(state_at(5.0 + 0.01 * k), 0.03, math.pi / 2)
        memory, command, record = stack.step(
            memory, tick, lambda t: np.tile([1.0, 0.0, 1.2], (len(t), 1))
        )
    x, y, _ = rotate(command.attitude_flu_to_enu, (0.0, 0.0, 1.0))
    assert yaw_of(command.attitude_flu_to_enu) > 0.3
    assert math.atan2(y, x) == pytest.approx(
        math.atan2(record.applied_u[1], record.applied_u[0]), abs=0.05
    )


def test_a_clock_that_jitters_by_microseconds_loses_no_time_and_makes_no_new_step():
    """What is reckoned for an interval is kept; intervals are taken to 0.1 ms, nothing is lost."""
    stack = stack_for()
    rng = np.random.default_rng(2)
    state = VehicleState(5.0, (0.0, 0.0, 1.2), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0,) * 3)
    memory = stack.start(state)
    before = l1_adaptive._step_matrices.cache_info().misses
    for k in range(1, 500):
        time_s = 5.0 + 0.01 * k + 20e-6 * rng.standard_normal()
        tick = Tick(replace(state, time_s=time_s), 0.03, 0.0)
        memory, _, _ = stack.step(memory, tick, lambda t: np.tile([0.0, 0.0, 1.2], (len(t), 1)))
        assert memory.sample_s == pytest.approx(time_s, abs=51e-6)
    assert l1_adaptive._step_matrices.cache_info().misses - before <= 5


def test_relieving_another_stack_it_goes_on_with_what_was_commanded_and_not_with_the_attitude():
    """The attitude lags behind the command by far more than a tick."""
    stack = stack_for()
    level = VehicleState(
        10.0, (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), quaternion_from_euler(0.0, 0.0, 0.4), (0.0,) * 3
    )
    applied_u = np.array([0.12, -0.07, 0.3])
    memory = stack.start(level, None, applied_u)
    hold = np.array([[0.0, 0.0, 2.0]])
    tick = Tick(replace(level, time_s=10.01), 0.03, 0.4)
    _, _, record = stack.step(memory, tick, lambda times: np.tile(hold, (len(times), 1)))
    assert record.applied_u == pytest.approx(applied_u, abs=0.015)


def test_either_solver_flies_the_same_path():
    """With a bound that is often active; OSQP's tolerance is in the difference."""
    trajectory = TEST_TRAJECTORIES[5]
    flown = []
    for solver in ("osqp", "daqp"):
        stack = stack_for(**{"mpc.solver": solver, "mpc.r_max_m_s2": 160.0})
        start = tuple(trajectory.position(np.zeros(1))[0])
        _, positions, _, records = fly(stack, trajectory.position, 5.0, start_m=start)
        plans = [record.outer for record in records if record.outer is not None]
        constrained = sum(any(plan.constrained_axes) for plan in plans)
        assert constrained > 0.2 * len(plans)
        assert {plan.status for plan in plans} == {"closed_form", "solved"}
        flown.append(positions)
    np.testing.assert_allclose(flown[0], flown[1], atol=2e-4)
