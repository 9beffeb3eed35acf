"""Steps of the estimate: small ones are followed without a bump, large ones end tracking."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.flight.setpoints.footing import Footing, seen, slid, step
from companion.frames import quaternion_from_euler
from companion.vehicle_state import VehicleState

DT_S = 0.01
FOLLOWED_M = 1.0


def motion(time_s, *, offset=(0.0, 0.0, 0.0), counter=0, yaw=0.0, speed=(0.0, 0.0, 0.0)):
    """A brisk turn at 1.5 m/s, whose estimate is off by something."""
    angle = 2.0 * time_s
    place = (0.75 * math.cos(angle), 0.75 * math.sin(angle), 2.0)
    velocity = (-1.5 * math.sin(angle), 1.5 * math.cos(angle), 0.0)
    return VehicleState(
        time_s,
        tuple(p + o for p, o in zip(place, offset, strict=True)),
        tuple(v + s for v, s in zip(velocity, speed, strict=True)),
        quaternion_from_euler(0.2, 0.1, yaw),
        (0.0, 0.0, 0.0),
        counter,
    )


def fly(times, *, change, footing=None):
    """States as they come, as they are seen, and what was found of each."""
    footing = footing or Footing()
    found = []
    for time_s in times:
        state = motion(time_s, **change(time_s))
        footing, verdict = step(footing, state, FOLLOWED_M)
        found.append((state, seen(footing, state), verdict))
    return footing, found


def ticks(seconds, dt_s=DT_S):
    return [k * dt_s for k in range(round(seconds / dt_s))]


@pytest.mark.parametrize("dt_s", [0.004, 0.01, 0.033, 0.1])
def test_a_vehicle_that_flies_is_seen_as_it_is(dt_s):
    _, found = fly(ticks(4.0, dt_s), change=lambda t: {})
    assert all(state is as_seen for state, as_seen, _ in found)
    assert not any(v.problem or v.remark or v.restart for _, _, v in found)


def reference(footing, times_s):
    """The controller's reference, of one that rests at the origin."""
    return slid(footing, lambda times: np.zeros((len(times), 3)))(np.asarray(times_s, float))


@pytest.mark.parametrize("announced", [True, False])
@pytest.mark.parametrize("jump_m", [0.15, 0.3, 0.9])
def test_a_small_step_is_followed_without_a_bump(jump_m, announced):
    def change(time_s):
        jumped = time_s >= 1.0
        return {"offset": (jump_m * jumped, 0.0, 0.0), "counter": int(announced and jumped)}

    footing, found = fly(ticks(3.0), change=change)
    ((when_s, remark),) = [(state.time_s, v.remark) for state, _, v in found if v.remark]
    assert when_s == 1.0
    assert f"{jump_m:.2f} m" in remark
    assert ("(announced)" in remark) is announced
    assert not any(v.problem or v.restart for _, _, v in found)
    # What the controller sees of the vehicle moves on as if nothing had been,
    for (_, a, _), (_, b, _) in itertools.pairwise(found):
        mean = [(x + y) / 2.0 for x, y in zip(a.velocity_enu_m_s, b.velocity_enu_m_s, strict=True)]
        moved = [y - x for x, y in zip(a.position_enu_m, b.position_enu_m, strict=True)]
        assert [m / DT_S for m in moved] == pytest.approx(mean, abs=2e-3)
    # and its reference slides by the step, from rest to rest, so that error and reference end
    # where the estimate says.
    path = reference(footing, ticks(12.0))
    speed = np.diff(path[:, 0]) / DT_S
    assert path[100] == pytest.approx((0.0, 0.0, 0.0), abs=1e-5)
    assert path[-1] == pytest.approx((-jump_m, 0.0, 0.0), abs=1e-5)
    assert np.abs(speed).max() < 0.31
    assert np.abs(np.diff(speed)).max() / DT_S < 1.0


def test_an_announced_step_is_followed_even_if_it_is_very_small():
    _, found = fly(
        ticks(2.0),
        change=lambda t: {"offset": (0.03 * (t >= 1.0), 0.0, 0.0), "counter": int(t >= 1.0)},
    )
    first = next(k for k, (state, _, _) in enumerate(found) if state.time_s >= 1.0)
    assert math.dist(found[first][1].position_enu_m, motion(1.0).position_enu_m) < 1e-3
    assert "(announced): position by 0.03 m" in found[first][2].remark


def test_an_estimate_that_wanders_by_centimetres_is_seen_as_it_is():
    _, found = fly(ticks(2.0), change=lambda t: {"offset": (0.08 * (round(100 * t) % 2), 0.0, 0.0)})
    assert all(state is as_seen for state, as_seen, _ in found)


def test_a_large_step_ends_tracking_for_as_long_as_it_lasts():
    _, found = fly(ticks(3.0), change=lambda t: {"offset": (3.0 * (1.0 <= t < 1.5), 0.0, 0.0)})
    troubled = [state.time_s for state, _, v in found if v.problem]
    assert troubled[0] == 1.0
    assert troubled[-1] == pytest.approx(1.49)
    assert "jumped by 3.0 m" in next(v.problem for _, _, v in found if v.problem)
    assert math.dist(found[-1][1].position_enu_m, found[-1][0].position_enu_m) < 1e-2  # it is back


def test_steps_that_add_up_are_no_way_round_the_limit():
    _, found = fly(ticks(2.0), change=lambda t: {"offset": (0.4 * (10.0 * t // 2.0), 0.0, 0.0)})
    assert not any(v.problem for state, _, v in found if state.time_s < 0.55)
    assert all(v.problem for state, _, v in found if state.time_s > 0.65)


def test_steps_there_and_back_are_followed_but_not_for_ever():
    _, found = fly(
        ticks(9.0), change=lambda t: {"offset": (0.4 * ((10.0 * t // 2.0) % 2), 0.0, 0.0)}
    )
    assert not any(v.problem for state, _, v in found if state.time_s < 3.9)
    assert "jumped 21 times" in found[-1][2].problem


def test_a_second_step_in_the_slide_of_the_first_makes_no_bump_either():
    def change(time_s):
        return {"offset": (0.4 * (time_s >= 1.0), 0.4 * (time_s >= 1.4), 0.0)}

    footing, found = fly(ticks(3.0), change=change)
    steps = [
        math.dist(a.position_enu_m, b.position_enu_m)
        for (_, a, _), (_, b, _) in itertools.pairwise(found)
    ]
    assert max(steps) < 1.51 * DT_S
    assert sum(bool(v.remark) for _, _, v in found) == 2
    path = reference(footing, ticks(12.0))
    assert path[-1] == pytest.approx((-0.4, -0.4, 0.0), abs=1e-5)
    assert np.abs(np.diff(path, 2, axis=0)).max() / DT_S**2 < 1.0


def test_a_step_of_the_velocity_begins_the_laws_anew_and_a_large_one_is_not_flown_on():
    _, found = fly(ticks(2.0), change=lambda t: {"speed": (1.6 * (t >= 1.0), 0.0, 0.0)})
    assert [state.time_s for state, _, v in found if v.restart] == [1.0]
    # Such a velocity does not lead to the places that follow: that is another matter.
    _, found = fly(ticks(1.01), change=lambda t: {"speed": (6.0 * (t >= 1.0), 0.0, 0.0)})
    assert "velocity jumped" in found[-1][2].problem


@pytest.mark.parametrize(("turn_deg", "bad"), [(10.0, False), (12.0, True), (60.0, True)])
def test_a_step_of_the_heading_is_told_and_a_large_one_is_not_flown_on(turn_deg, bad):
    _, found = fly(
        ticks(2.0),
        change=lambda t: {"yaw": math.radians(turn_deg) * (t >= 1.0), "counter": int(t >= 1.0)},
    )
    verdict = next(v for state, _, v in found if state.time_s >= 1.0)
    assert bool(verdict.problem) is bad
    assert ("heading by 10 degrees" in verdict.remark) is not bad
    assert bool(found[-1][2].problem) is bad


def test_after_a_long_silence_nothing_is_known_of_where_it_must_be():
    footing, _ = fly(ticks(1.0), change=lambda t: {})
    far = replace(motion(3.0), position_enu_m=(9.0, 9.0, 9.0))
    _, verdict = step(footing, far, FOLLOWED_M)
    assert not verdict.problem
    assert not verdict.remark


@pytest.mark.parametrize("gap_s", [0.3, 0.5, 0.8, 0.99])
def test_a_step_behind_a_gap_of_samples_is_noticed(gap_s):
    """The vehicle flies level meanwhile, and bends its path by little."""
    footing, _ = fly(ticks(1.0), change=lambda t: {})
    before = footing.newest
    moved = tuple(
        p + v * gap_s + (0.75 if k == 0 else 0.0)
        for k, (p, v) in enumerate(zip(before.position_enu_m, before.velocity_enu_m_s, strict=True))
    )
    after = replace(before, time_s=before.time_s + gap_s, position_enu_m=moved)
    found, verdict = step(footing, after, FOLLOWED_M)
    assert "position by 0.75 m" in verdict.remark
    assert found.shift_m == pytest.approx((0.75, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("gap_s", [0.15, 0.3, 0.5, 0.8])
@pytest.mark.parametrize("turned_s", [0.05, 0.15])
def test_a_vehicle_that_levels_out_in_a_gap_of_samples_has_not_stepped(gap_s, turned_s):
    """At 30 degrees of tilt when the samples end, level a little later."""
    footing, _ = fly(ticks(1.0), change=lambda t: {})
    before = footing.newest
    turned_s = min(turned_s, gap_s)
    faster = 9.81 * math.tan(math.radians(30.0)) * turned_s
    x, y, z = before.position_enu_m
    u, v, w = before.velocity_enu_m_s
    x += u * gap_s + 0.5 * faster * turned_s + faster * (gap_s - turned_s)
    after = replace(
        before,
        time_s=before.time_s + gap_s,
        position_enu_m=(x, y + v * gap_s, z),
        velocity_enu_m_s=(u + faster, v, w),
    )
    assert not step(footing, after, FOLLOWED_M)[1].remark


def test_an_announced_step_is_noticed_behind_a_silence_of_any_length():
    footing, _ = fly(ticks(1.0), change=lambda t: {})
    before = footing.newest
    after = replace(before, time_s=before.time_s + 1.01, reset_counter=1)
    x, y, z = (
        p + 1.01 * v for p, v in zip(before.position_enu_m, before.velocity_enu_m_s, strict=True)
    )
    _, verdict = step(footing, replace(after, position_enu_m=(x + 3.0, y, z)), FOLLOWED_M)
    assert "jumped by 3.0 m" in verdict.problem
    found, verdict = step(footing, replace(after, position_enu_m=(x + 0.5, y, z)), FOLLOWED_M)
    assert "(announced): position by 0.50 m" in verdict.remark
    assert found.shift_m == pytest.approx((0.5, 0.0, 0.0), abs=1e-9)


def test_a_heading_that_creeps_in_steps_is_no_way_round_the_limit():
    """Nine degrees at each sample."""
    _, found = fly(
        ticks(2.0),
        change=lambda t: {"yaw": math.radians(9.0) * min(10, max(0, round(100 * (t - 1.0))))},
    )
    late = [v for state, _, v in found if state.time_s > 1.015]
    assert all("heading jumped by" in v.problem for v in late)


def test_a_heading_that_comes_back_is_flown_on_again_but_not_for_ever():
    def change(time_s):
        return {"yaw": math.radians(9.0) * (round(100 * time_s) % 2)}

    _, found = fly(ticks(2.0), change=change)
    assert not any(v.problem for state, _, v in found if state.time_s < 0.195)
    assert "heading jumped 21 times" in found[-1][2].problem
    _, found = fly(ticks(2.0), change=lambda t: {"yaw": math.radians(40.0) * (1.0 <= t < 1.2)})
    assert found[110][2].problem
    assert not found[-1][2].problem


def test_a_velocity_that_keeps_stepping_is_not_flown_on_for_ever():
    _, found = fly(ticks(2.0), change=lambda t: {"speed": (0.8 * (-1) ** round(100 * t), 0.0, 0.0)})
    # Up to there each begins the laws anew.
    assert sum(v.restart for _, _, v in found) == 21
    late = [v.problem for _, _, v in found[22:]]
    assert "velocity jumped 21 times" in late[0]
    assert all("jumped" in problem for problem in late)


@pytest.mark.parametrize("every_s", [0.01, 0.4, 1.6])
def test_steps_in_a_row_slide_no_faster_than_one(every_s):
    """Six of 15 cm, of which none waits for the one before."""
    footing, found = fly(
        ticks(10.0),
        change=lambda t: {"offset": (0.15 * min(6.0, max(0.0, (t - 1.0) // every_s + 1.0)), 0, 0)},
    )
    assert sum(bool(v.remark) for _, _, v in found) == 6
    path = reference(footing, ticks(30.0))
    assert path[-1] == pytest.approx((-0.9, 0.0, 0.0), abs=1e-5)
    assert np.abs(np.diff(path[:, 0])).max() / DT_S < 0.301


def test_a_slide_begins_behind_what_a_plan_sees():
    """Its preview goes on as it was at the tick of the step."""
    footing, _ = fly(ticks(1.01), change=lambda t: {"offset": (0.3 * (t >= 1.0), 0.0, 0.0)})
    assert footing.shift_m[0] == pytest.approx(0.3, abs=1e-5)
    assert not reference(footing, [1.0 + 0.03 * k for k in range(46)]).any()


@settings(deadline=None, derandomize=True, max_examples=60)
@given(
    st.lists(st.tuples(st.floats(0.0, 3.0), *[st.floats(-0.5, 0.5)] * 3), min_size=0, max_size=4)
)
def test_error_and_reference_agree_with_the_estimate_in_the_end(steps):
    """However it stepped: the controller's error is the true one once all slides are over."""

    def change(time_s):
        offsets = [offset for at_s, *offset in steps if time_s >= at_s]
        return {"offset": tuple(map(sum, zip(*offsets, strict=True))) or (0.0,) * 3}

    footing, found = fly(ticks(4.0, 0.02), change=change)
    for (_, a, v), (_, b, w) in itertools.pairwise(found):
        if not v.problem and not w.problem:
            assert math.dist(a.position_enu_m, b.position_enu_m) < 1.51 * 0.02 + 0.11
    state, as_seen, verdict = found[-1]
    if not verdict.problem:
        over_s = max((s.begun_s + s.lasts_s for s in footing.slides), default=20.0)
        end = reference(footing, [over_s])[0]
        seen_error = np.array(as_seen.position_enu_m) - end
        assert seen_error == pytest.approx(np.array(state.position_enu_m), abs=1e-9)
