"""MPC-L1+ in closed loop on a plain vehicle, and at its seams."""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from companion.config.models import MissionConfig
from companion.config.resolve import load_flight
from companion.control.frameworks import Tick
from companion.control.interfaces import AdaptationMean
from companion.control.qp.port import QpSolution
from companion.control.thrust import GRAVITY_M_S2
from companion.flight.assemble import make_stack
from companion.frames import euler_from_quaternion, quaternion_from_euler, rotate
from companion.thrust_meaning import COLLECTIVE, ThrustMeaning
from companion.trajectories.harmonic import TEST_TRAJECTORIES
from companion.vehicle_state import VehicleState
from tests.companion.control.nominal_plant import fly

DATA = Path(__file__).parents[3] / "data" / "plus"
HOVER_S = 2.0
CLIMB_RATE = ThrustMeaning("climb_rate", 2.5, 1.5)
NOWHERE = AdaptationMean((0.0,) * 3, (0.0,) * 3, (0.0,) * 3)
PLACE = (0.0, 0.0, 1.2)


class Failing:
    """A solver that finds nothing."""

    def __init__(self, p, a):
        pass

    def solve(self, q, lower, upper):
        return QpSolution(None, "out of luck", 0)


def stack_for(thrust=COLLECTIVE, *, fence_m=50.0, make_solver=None, **settings):
    keys = {key.replace("__", "."): str(value) for key, value in settings.items()}
    named = {what: str(DATA / f"{what}.yaml") for what in ("controller", "vehicle")}
    flight = load_flight(None, named, keys)
    low, high = (-fence_m, -fence_m, -50.0), (fence_m, fence_m, 50.0)
    mission = MissionConfig(geofence={"low_m": low, "high_m": high})
    return make_stack(flight.controller, flight.vehicle, mission, make_solver, thrust=thrust)


@cache
def usual():
    return stack_for()


def along(number, shift=PLACE):
    trajectory = TEST_TRAJECTORIES[number]
    from_here = np.array(shift) - trajectory.position(np.zeros(1))[0]
    return lambda times: trajectory.position(times - HOVER_S) + from_here


def hold(place=PLACE):
    return lambda times: np.tile(place, (len(times), 1))


def jump(by, at_s=1.0):
    return lambda times: np.array(PLACE) + np.where(np.asarray(times)[:, None] < at_s, 0.0, by)


def errors_m(stack, number=4, seconds=8.0, **plant):
    """Distances to the trajectory, and the rms slew of the tilt command, 1/s."""
    reference = along(number)
    times, positions, tilts, _ = fly(stack, reference, HOVER_S + seconds, start_m=PLACE, **plant)
    error = np.linalg.norm(positions - reference(times), axis=1)[times >= HOVER_S]
    slew = float(np.sqrt(np.mean(np.diff(np.sin(tilts), axis=0) ** 2))) / 0.01
    return error, slew


@cache
def nominal_m():
    error, _ = errors_m(usual())
    return error.mean()


def state(time_s=0.0, position=PLACE, velocity=(0.0, 0.0, 0.0), tilt=(0.0, 0.0), yaw=0.0, rate=0.0):
    attitude = quaternion_from_euler(*tilt, yaw)
    return VehicleState(time_s, position, velocity, attitude, (rate, 0.0, 0.0))


def directions(tilts):
    return np.array([rotate(quaternion_from_euler(r, p, 0.0), (0.0, 0.0, 1.0)) for r, p in tilts])


def test_it_tracks_the_figure_eight_to_millimetres_without_chatter():
    error, slew = errors_m(usual())
    assert error.mean() < 0.008
    assert error.max() < 0.02
    assert slew < 1.2


def test_over_a_climb_rate_it_tracks_as_well():
    stack = stack_for(CLIMB_RATE)
    error, _ = errors_m(stack, climb_rate_field=stack.thrust)
    assert error.mean() < 0.008


@pytest.mark.parametrize(
    ("plant", "times"),
    [
        ({"natural_frequency": 12.0 / 1.25}, 1.5),
        ({"natural_frequency": 12.0 / 0.75}, 1.5),
        ({"natural_frequency": 12.0 / 1.5}, 2.0),
        ({"extra_delay_s": 0.04, "told_delay_s": 0.07}, 2.0),
        ({"extra_delay_s": 0.02}, 2.0),
        ({"loss": 0.1}, 1.5),
        ({"drag": 2.0}, 2.0),
        ({"hover_thrust": 0.575}, 1.5),
        (
            {
                "natural_frequency": 12.0 / 1.25,
                "extra_delay_s": 0.02,
                "told_delay_s": 0.05,
                "drag": 2.0,
            },
            2.0,
        ),
    ],
    ids=[
        "lag +25 %",
        "lag -25 %",
        "lag +50 %",
        "delay",
        "delay that nobody tells",
        "loss",
        "drag",
        "hover thrust",
        "lag, delay and drag",
    ],
)
def test_another_vehicle_than_was_identified_is_flown_nearly_as_well(plant, times):
    error, slew = errors_m(usual(), **plant)
    assert error.mean() < times * nominal_m()
    assert slew < 1.6


def gust(t):
    return (math.sin(1.2 * t), 0.8 * math.cos(0.9 * t), 0.3 * math.sin(2.0 * t))


def test_what_is_learnt_of_gusts_cancels_them():
    with_it, _ = errors_m(usual(), disturbance_m_s2=gust)
    without, _ = errors_m(usual().without_adaptation(NOWHERE), disturbance_m_s2=gust)
    assert with_it.mean() < 0.35 * without.mean()


def test_a_steady_push_leaves_no_offset():
    def push(t):
        return (1.0, -0.6, 0.4)

    def offset(stack):
        _, positions, _, records = fly(
            stack, hold(), 4.0, start_m=PLACE, noise=0.0, disturbance_m_s2=push
        )
        return np.abs(positions[-50:] - PLACE).max(), records[-1]

    left, record = offset(usual())
    assert left < 0.004
    found = record.inner.sigma_hat * [GRAVITY_M_S2, GRAVITY_M_S2, 1.0]
    # The estimated hover thrust takes the vertical part.
    assert found == pytest.approx([1.0, -0.6, 0.0], abs=0.1)
    assert not record.inner.projecting
    assert offset(usual().without_adaptation(NOWHERE))[0] > 0.03


def test_switched_off_the_adaptation_stays_where_it_was():
    mean = AdaptationMean((0.01, 0.0, 0.0), (0.05, -0.02, 0.3), (0.0,) * 3)
    _, _, _, records = fly(
        usual().without_adaptation(mean), along(4), 4.0, start_m=PLACE, disturbance_m_s2=gust
    )
    for record in records:
        assert record.inner.sigma_hat == pytest.approx(mean.sigma_hat)


def test_the_predictor_errs_by_as_much_as_it_says_in_calm_air():
    _, _, _, records = fly(usual(), along(4), 8.0, start_m=PLACE)
    within = [np.abs(r.inner.y_tilde_m_s) <= r.inner.y_tilde_bound_m_s for r in records]
    assert np.mean(within) > 0.995


def glide(by, seconds, at_s=1.0):
    """From rest to rest, without a leap in position, velocity or acceleration."""

    def reference(times):
        share = np.clip((np.asarray(times)[:, None] - at_s) / seconds, 0.0, 1.0)
        return np.array(PLACE) + share**3 * (10.0 - 15.0 * share + 6.0 * share**2) * by

    return reference


@pytest.mark.parametrize(
    "reference",
    [glide((3.0, 0.0, 0.0), 0.7), jump((3.0, 0.0, 0.0)), jump((-2.0, 3.0, 0.5))],
    ids=["too quick", "a leap", "a leap aslant"],
)
@pytest.mark.parametrize("make_solver", [None, Failing], ids=["solved", "solver fails"])
def test_tilt_and_tilt_rate_stay_limited_whatever_is_wanted(reference, make_solver):
    """The trajectory is one that no vehicle can follow."""
    stack = stack_for(make_solver=make_solver)
    _, _, tilts, records = fly(stack, reference, 2.5, start_m=PLACE)
    pointing = directions(tilts)
    assert np.isfinite(pointing).all()
    assert pointing[:, 2].min() >= math.cos(stack.limits.tilt_rad) - 1e-9
    assert pointing[:, 2].min() < math.cos(0.9 * stack.limits.tilt_rad)
    turned = np.linalg.norm(np.diff(pointing, axis=0), axis=1) / 0.01
    assert turned.max() <= stack.settings.tilt_rate_limit_rad_s + 1e-6
    assert turned.max() > 0.9 * stack.settings.tilt_rate_limit_rad_s
    assert any(r.outer.constrained_axes[0] for r in records if r.outer is not None)


def test_after_a_trajectory_that_was_too_quick_it_arrives():
    reference = glide((3.0, 0.0, 0.0), 0.9)
    _, positions, _, records = fly(usual(), reference, 6.0, start_m=PLACE)
    assert positions[-1] == pytest.approx([3.0, 0.0, 1.2], abs=0.01)
    assert np.abs(positions[:, 1]).max() < 0.05
    assert positions[:, 0].max() < 3.6
    assert records[-1].outer is None or records[-1].outer.status == "closed_form"


def test_a_failing_solver_is_told():
    _, _, _, records = fly(
        stack_for(make_solver=Failing), jump((3.0, 0.0, 0.0)), 2.0, start_m=PLACE
    )
    failed = [r.outer for r in records if r.outer and r.outer.status == "clipped_closed_form"]
    assert failed
    assert "x: out of luck" in failed[0].solver_status


def test_the_geofence_is_softly_kept_where_the_trajectory_runs_out_of_it():
    away = glide((3.0, 0.0, 0.0), 3.0)
    _, fenced, _, _ = fly(stack_for(fence_m=1.5), away, 6.5, start_m=PLACE)
    _, free, _, _ = fly(usual(), away, 6.5, start_m=PLACE)
    assert free[-1, 0] == pytest.approx(3.0, abs=0.02)
    assert fenced[:, 0].max() < 1.6
    assert fenced[-1, 0] == pytest.approx(1.5, abs=0.1)
    shifted = stack_for(fence_m=1.5).about((1.0, 0.0, 0.0))
    _, moved, _, _ = fly(shifted, away, 6.5, start_m=PLACE)
    assert moved[-1, 0] == pytest.approx(2.5, abs=0.1)


def test_the_speed_is_softly_kept_where_the_trajectory_runs_ahead():
    ahead = glide((6.0, 0.0, 0.0), 5.0)
    _, slow, _, _ = fly(stack_for(vehicle__speed_limit_m_s=1.5), ahead, 8.0, start_m=PLACE)
    _, quick, _, _ = fly(usual(), ahead, 8.0, start_m=PLACE)
    assert np.diff(quick[:, 0]).max() / 0.01 > 2.2
    assert np.diff(slow[:, 0]).max() / 0.01 < 1.58
    assert slow[-1, 0] == pytest.approx(6.0, abs=0.05)


class TakenOver:
    """A stack that is relieved in flight by one like it, started from what is in effect."""

    def __init__(self, stack, at_s):
        self.stack, self.at_s, self.leap = stack, at_s, None

    def start(self, state):
        return self.stack.start(state), None

    def step(self, memory, tick, reference):
        inner, last = memory
        goes_on, command, record = self.stack.step(inner, tick, reference)
        if self.leap is None and tick.state.time_s >= self.at_s:
            before = replace(tick.state, time_s=inner.sample_s)
            new = self.stack.start(before, inner.thrust, last.applied_u)
            goes_on, new_command, record = self.stack.step(new, tick, reference)
            ways = [rotate(c.attitude_flu_to_enu, (0.0, 0.0, 1.0)) for c in (command, new_command)]
            self.leap = math.dist(*ways)
            command = new_command
        return (goes_on, record), command, record


@pytest.mark.parametrize("thrust", [COLLECTIVE, CLIMB_RATE], ids=["thrust", "climb rate"])
def test_it_takes_over_without_a_bump(thrust):
    """In the midst of the figure eight, with what the controller before it commanded last."""
    stack = TakenOver(stack_for(thrust), 5.0)
    field = stack.stack.thrust if thrust == CLIMB_RATE else None
    error, _ = errors_m(stack, climb_rate_field=field)
    assert stack.leap < math.radians(1.5)
    assert error.max() < 0.04
    assert error[-300:].mean() < 0.008


def test_without_a_controller_before_it_it_goes_on_from_the_attitude():
    tilted = state(0.0, tilt=(0.05, 0.10))
    x, y, z = rotate(tilted.attitude_flu_to_enu, (0.0, 0.0, 1.0))
    u = usual().start(tilted).acting[0].u
    assert u == pytest.approx((GRAVITY_M_S2 * x / z, GRAVITY_M_S2 * y / z, 0.0))


def test_what_is_not_known_of_the_last_command_is_taken_from_the_state():
    now = state(0.0, tilt=(0.05, 0.10))
    unknown = usual().start(now, None, np.full(3, math.nan))
    assert unknown.acting == usual().start(now).acting


def test_the_hover_thrust_of_the_controller_before_it_is_kept():
    earlier = usual().start(state()).thrust
    for _ in range(300):
        earlier, _ = usual().thrust.step(earlier, 0.0, -0.2, 1.0, 0.01)
    known = usual().thrust.hover_thrust(earlier)
    memory = usual().start(state(), earlier)
    assert usual().thrust.hover_thrust(memory.thrust) == known
    assert known != usual().thrust.hover_thrust(usual().start(state()).thrust)


NAN = math.nan


@pytest.mark.parametrize(
    "sample",
    [
        state(0.01, position=(NAN, 0.0, 1.2)),
        state(0.01, position=(0.0, 0.0, NAN)),
        state(0.01, velocity=(0.0, NAN, 0.0)),
        state(0.01, velocity=(0.0, 0.0, NAN)),
        state(0.01, tilt=(NAN, 0.0)),
        state(0.01, rate=NAN),
    ],
    ids=["position", "height", "velocity", "climb rate", "attitude", "body rate"],
)
def test_a_state_that_is_not_a_number_is_refused(sample):
    with pytest.raises(ValueError, match="not finite"):
        usual().step(usual().start(state()), Tick(sample, 0.03, 0.0), hold())


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_trajectory_that_is_not_a_number_is_refused(axis):
    place = [NAN if i == axis else 0.0 for i in range(3)]
    with pytest.raises(ValueError, match="not finite"):
        usual().step(usual().start(state()), Tick(state(0.01), 0.03, 0.0), hold(place))


def test_a_heading_that_is_not_a_number_is_refused():
    with pytest.raises(ValueError, match="not finite"):
        usual().step(usual().start(state()), Tick(state(0.01), 0.03, NAN), hold())


@pytest.mark.parametrize("time_s", [0.0, -0.01])
def test_time_that_does_not_advance_is_refused(time_s):
    with pytest.raises(ValueError, match="time does not advance"):
        usual().step(usual().start(state()), Tick(state(time_s), 0.03, 0.0), hold())


def test_a_flight_repeats_itself():
    one, other = (fly(stack_for(), jump((2.0, 1.0, 0.0)), 2.0, start_m=PLACE) for _ in range(2))
    assert (one[1] == other[1]).all()
    assert (one[2] == other[2]).all()


@pytest.mark.parametrize("place", [PLACE, (2.0, 0.0, 1.2)], ids=["at rest", "from afar"])
def test_the_same_memory_gives_the_same_command_again(place):
    """Also where a constraint decides, to what the solver's tolerance leaves."""
    stack, memory = usual(), usual().start(state())
    for k in range(1, 12):
        tick = Tick(state(0.01 * k), 0.03, 0.0)
        _, first, _ = stack.step(memory, tick, hold(place))
        memory, again, _ = stack.step(memory, tick, hold(place))
        exact = 0.0 if place == PLACE else 1e-4
        assert again.attitude_flu_to_enu == pytest.approx(first.attitude_flu_to_enu, abs=exact)
        assert again.thrust == pytest.approx(first.thrust, abs=exact)


@pytest.mark.parametrize("yaw", [-2.5, 0.7, 1.6])
def test_the_heading_makes_no_difference_to_where_the_thrust_points(yaw):
    def pointing(at):
        turned = state(0.0, yaw=at)
        memory = usual().start(turned)
        for k in range(1, 6):
            sample = state(0.01 * k, velocity=(0.05, -0.02, 0.0), yaw=at)
            memory, command, _ = usual().step(
                memory, Tick(sample, 0.03, at), hold((0.01, 0.0, 1.2))
            )
        assert euler_from_quaternion(command.attitude_flu_to_enu)[2] == pytest.approx(at)
        return rotate(command.attitude_flu_to_enu, (0.0, 0.0, 1.0))

    assert pointing(yaw) == pytest.approx(pointing(0.0), abs=1e-9)


def test_where_the_origin_lies_makes_no_difference():
    def flown(shift):
        place = tuple(np.add(PLACE, shift))
        reference = along(4, place)
        _, positions, _, _ = fly(usual(), reference, 4.0, start_m=place)
        return positions - shift

    assert flown((30.0, -20.0, 2.0)) == pytest.approx(flown((0.0, 0.0, 0.0)), abs=1e-4)


def test_the_record_tells_what_was_commanded():
    _, _, tilts, records = fly(usual(), along(4), 4.0, start_m=PLACE)
    for (roll, pitch), record in zip(tilts, records, strict=True):
        assert (record.roll_rad, record.pitch_rad) == pytest.approx((roll, pitch), abs=1e-9)
        pointing = rotate(quaternion_from_euler(roll, pitch, 0.0), (0.0, 0.0, 1.0))
        assert record.applied_u[:2] == pytest.approx(pointing[:2], abs=1e-9)
    looks = [k for k, record in enumerate(records) if record.outer is not None]
    assert set(np.diff(looks)) == {4}
    assert records[looks[5]].outer.status == "closed_form"
    assert records[looks[5]].outer.predicted_position_m.shape == (25, 3)


def test_the_foreseen_positions_are_those_that_come():
    _, positions, _, records = fly(usual(), along(4), 6.0, start_m=PLACE, noise=0.0)
    for k in range(300, 450, 4):
        outer = records[k].outer
        if outer is None:
            continue
        # The sample of record k is of tick k + 1; the plan begins when its input acts.
        acts = k + 1 + 4
        later = positions[acts + 4 : acts + 100 : 4]
        assert outer.predicted_position_m[: len(later)] == pytest.approx(later, abs=0.02)
