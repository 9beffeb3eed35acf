"""The exponential of small matrices, against scipy's."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import expm

from companion.control.matrix_exponential import matrix_exponential

entries = st.floats(-20, 20, allow_nan=False)


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.integers(1, 6).flatmap(lambda n: arrays(float, (n, n), elements=entries)))
def test_it_is_the_exponential(a):
    # In turned coordinates: for triangular matrices scipy takes divided differences of the
    # diagonal's exponentials, which are wrong where two of its entries are all but equal.
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal(a.shape))[0]
    expected = turn.T @ expm(turn @ a @ turn.T) @ turn
    tolerance = 1e-10 * max(1.0, float(np.abs(expected).max()))
    np.testing.assert_allclose(matrix_exponential(a), expected, rtol=1e-8, atol=tolerance)


@pytest.mark.parametrize("dt", [0.001, 0.01, 0.05])
def test_entries_of_very_different_sizes_do_not_spoil_it(dt):
    """As of predictor and adaptation law with a high rate, and inputs as states."""
    a = np.zeros((5, 5))
    a[0, :3] = [-0.5, 0.5, 0.5]
    a[1, [0, 3]] = [-2e5, 2e5]
    a[3, 4] = 1.0
    np.testing.assert_allclose(matrix_exponential(a * dt), expm(a * dt), rtol=1e-8, atol=1e-9)


def test_of_zero_it_is_the_identity():
    np.testing.assert_array_equal(matrix_exponential(np.zeros((3, 3))), np.eye(3))
