"""Events happen once each, at the first step of the plant that is not before their time."""

from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.plant.timeline import Timeline
from sitl_shim.wind import Load, Moments

STEP_S = 0.004


def load(at_s, since="boot"):
    return Load(at_s=at_s, since=since, mass_kg=at_s)


def steps_of(timeline):
    steps = []
    while timeline.next_step >= 0:
        steps.append(timeline.next_step)
        timeline.take()
    return steps


@settings(deadline=None, derandomize=True)
@given(
    steps=st.lists(st.integers(0, 50_000), unique=True, max_size=6),
    offsets=st.lists(st.floats(1e-6, 0.0039), min_size=6, max_size=6),
)
def test_each_is_taken_at_the_first_step_that_is_not_before_its_time(steps, offsets):
    on_grid = [load(step * STEP_S) for step in steps]
    assert steps_of(Timeline(on_grid, Moments(), STEP_S)) == sorted(steps)
    times = [step * STEP_S + off for step, off in zip(steps, offsets, strict=False)]
    between = Timeline([load(time) for time in times], Moments(), STEP_S)
    assert steps_of(between) == sorted(step + 1 for step in steps)


def test_what_counts_from_the_setpoints_waits_until_they_come():
    moments = Moments()
    timeline = Timeline([load(1.0), load(0.4, "setpoints")], moments, STEP_S)
    assert timeline.next_step == 250
    assert timeline.take().at_s == 1.0
    assert timeline.next_step == -1
    moments.setpoints_s = 3.0
    timeline.moments_known(751)
    assert steps_of(timeline) == [850]


def test_the_order_is_that_of_the_times_and_not_that_of_the_file():
    moments = Moments()
    timeline = Timeline([load(5.0), load(0.4, "setpoints")], moments, STEP_S)
    moments.setpoints_s = 3.0
    timeline.moments_known(751)
    assert [timeline.take().at_s for _ in range(2)] == [0.4, 5.0]


def test_what_comes_with_the_setpoints_themselves_comes_at_the_next_step():
    moments = Moments()
    both = [load(0.0, "setpoints"), load(0.001, "setpoints")]
    timeline = Timeline(both, moments, STEP_S)
    moments.setpoints_s = 3.0
    timeline.moments_known(751)
    assert steps_of(timeline) == [751, 751]
