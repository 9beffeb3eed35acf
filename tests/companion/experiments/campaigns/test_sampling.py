import itertools
import math
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.experiments.campaigns.models import SampleConfig
from companion.experiments.campaigns.sampling import Axis, remark, sample

LAWS = settings(deadline=None, derandomize=True, max_examples=40)
SPANS = st.tuples(st.floats(-100.0, 100.0), st.floats(0.1, 100.0))


def ranges(low, width):
    return Axis(None, low, low + width)


@LAWS
@given(st.lists(SPANS, min_size=1, max_size=4), st.integers(1, 60), st.integers(0, 1000))
def test_a_latin_hypercube_has_one_point_in_each_slice_of_each_range(spans, points, seed):
    axes = [ranges(*span) for span in spans]

    found = sample(SampleConfig(method="latin-hypercube", points=points, seed=seed), axes)

    for k, (low, width) in enumerate(spans):
        slices = sorted((row[k] - low) / width * points for row in found)
        assert all(j - 1e-6 <= slices[j] <= j + 1.0 + 1e-6 for j in range(points))


@LAWS
@given(st.integers(1, 7), st.integers(1, 80), st.integers(0, 1000))
def test_choices_and_whole_numbers_come_equally_often(count, points, seed):
    axes = [Axis(tuple(range(count))), Axis(None, 3.0, 2.0 + count, integer=True)]

    found = sample(SampleConfig(method="latin-hypercube", points=points, seed=seed), axes)

    for k, first in ((0, 0), (1, 3)):
        counts = Counter(row[k] for row in found)
        assert set(counts) <= set(range(first, first + count))
        assert all(
            abs(counts[value] - points / count) < 2.0 for value in range(first, first + count)
        )


@LAWS
@given(st.lists(st.integers(1, 4), min_size=1, max_size=4), st.integers(2, 5))
def test_a_grid_has_every_combination_once_and_the_ends_of_its_ranges(counts, steps):
    axes = [Axis(tuple("abcd"[:count])) for count in counts]
    axes.append(Axis(None, 1.0, 100.0, log=True, steps=steps))

    found = sample(SampleConfig(method="grid"), axes)

    assert len(found) == len(set(found)) == math.prod(counts) * steps
    values = sorted({row[-1] for row in found})
    assert (values[0], values[-1]) == (1.0, 100.0)
    ratios = [b / a for a, b in itertools.pairwise(values)]
    assert ratios == pytest.approx([100.0 ** (1.0 / (steps - 1))] * (steps - 1))


@pytest.mark.parametrize("method", ["latin-hypercube", "sobol"])
def test_the_seed_alone_decides_the_points(method):
    axes = [Axis(None, 0.0, 1.0), Axis(("a", "b"))]

    def points(seed):
        return sample(SampleConfig(method=method, points=8, seed=seed), axes)

    assert points(1) == points(1)
    assert points(1) != points(2)


@LAWS
@given(st.integers(0, 6), st.integers(0, 100))
def test_a_sobol_sample_of_a_power_of_two_is_stratified_and_the_others_are_remarked_on(k, seed):
    config = SampleConfig(method="sobol", points=2**k, seed=seed)

    shares = sorted(row[0] for row in sample(config, [Axis(None, 0.0, 1.0)]))

    assert [int(share * 2**k) for share in shares] == list(range(2**k))
    assert remark(config) is None
    assert "Fly 8 or 16" in remark(SampleConfig(method="sobol", points=12))


@LAWS
@given(st.floats(1e-6, 1e3), st.floats(1.01, 1e6), st.floats(0.0, 1.0, exclude_max=True))
def test_a_logarithmic_range_gives_equal_shares_to_equal_ratios(low, ratio, share):
    value = Axis(None, low, low * ratio, log=True).at(share)

    assert low <= value <= low * ratio
    assert math.log(value / low) == pytest.approx(share * math.log(ratio), abs=1e-9)
