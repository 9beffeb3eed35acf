"""The ideal system D(s): its exact discretisation, and carrying a state along it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from companion.control.delay import AppliedReference, carry
from companion.control.reference_model import discretise_position_model, oscillator_exponential

positive = st.floats(0.05, 20.0)


@settings(deadline=None, derandomize=True)
@given(m=positive, gain_k=positive, dt=st.floats(1e-3, 0.5))
def test_the_discretisation_is_the_matrix_exponential(m, gain_k, dt):
    a, b = discretise_position_model(np.array([m]), np.array([gain_k]), dt)
    continuous = np.zeros((3, 3))
    continuous[:2, :2] = [[0.0, 1.0], [-m * gain_k, -m]]
    continuous[1, 2] = m * gain_k
    exact = expm(continuous * dt)
    np.testing.assert_allclose(a[0], exact[:2, :2], atol=1e-9)
    np.testing.assert_allclose(b[0], exact[:2, 2], atol=1e-9)


@settings(deadline=None, derandomize=True)
@given(elements=st.tuples(*[st.floats(-5, 5)] * 4), dt=st.floats(1e-3, 0.5))
def test_the_closed_form_exponential_holds_for_any_real_matrix(elements, dt):
    matrix = np.array(elements).reshape(2, 2)
    c, s = oscillator_exponential(float(np.trace(matrix)), float(np.linalg.det(matrix)), dt)
    np.testing.assert_allclose(c * np.eye(2) + s * matrix, expm(matrix * dt), atol=1e-7)


def test_the_models_rest_is_at_the_reference():
    """D(0) = 1 on each axis, unlike the discretisation that the paper's text suggests."""
    a, b = discretise_position_model(np.array([0.5, 3.75]), np.array([0.8, 0.55]), 0.03)
    for i in range(2):
        rest = np.linalg.solve(np.eye(2) - a[i], b[i])
        np.testing.assert_allclose(rest, [1.0, 0.0], atol=1e-9)


M, K = (0.5, 0.6), (0.8, 0.7)


def test_carrying_in_pieces_is_carrying_at_once():
    position, velocity = np.array([0.3, -0.2]), np.array([0.5, 0.1])
    references = (
        AppliedReference(0.98, np.array([1.0, 1.0])),
        AppliedReference(1.01, np.array([2.0, -1.0])),
        AppliedReference(1.04, np.array([0.5, 0.5])),
    )
    whole = carry(M, K, position, velocity, 1.0, 1.06, references)
    first = carry(M, K, position, velocity, 1.0, 1.03, references)
    second = carry(M, K, first[0], first[1], 1.03, 1.06, references[1:])
    np.testing.assert_allclose(whole, second, atol=1e-12)


def test_carrying_uses_each_reference_for_its_own_time():
    still = np.zeros(2)
    quiet = AppliedReference(0.0, np.zeros(2))
    loud = AppliedReference(0.05, np.array([100.0, 100.0]))
    before, _ = carry(M, K, still, still, 0.0, 0.05, (quiet, loud))
    after, _ = carry(M, K, still, still, 0.0, 0.08, (quiet, loud))
    np.testing.assert_array_equal(before, 0.0)
    assert (after > 0.0).all()


def test_no_delay_carries_nothing():
    position, velocity = np.array([0.3, -0.2]), np.array([0.5, 0.1])
    carried = carry(M, K, position, velocity, 1.0, 1.0, (AppliedReference(0.0, np.ones(2)),))
    np.testing.assert_array_equal(carried[0], position)
    assert carried[1] == pytest.approx(velocity)
