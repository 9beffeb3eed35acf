"""The output predictor: what it finds, and whether it knows how well."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.plus import predictor
from companion.control.plus.predictor import PredictorNoise
from tests.companion.control.plus.examples import vectors

NOISE = PredictorNoise(
    position_m=(1e-3, 2e-3, 5e-3),
    velocity_m_s=(1.5e-2, 3e-2, 1e-2),
    acceleration_m_s2_sqrt_hz=(2e-2, 5e-2, 1e-1),
    sigma_walk=(0.5, 0.3, 0.8),
)
BOUND = np.array([6.0, 6.0, 4.0])
NOTHING = np.zeros(3)
intervals = st.lists(st.sampled_from([0.004, 0.01, 0.01, 0.011, 0.02, 0.05, 0.2]), min_size=60)


def started(position=NOTHING, velocity=NOTHING):
    return predictor.start(NOISE, position, velocity, NOTHING, np.ones(3))


@settings(deadline=None, derandomize=True, max_examples=25)
@given(vectors(3.5), vectors(2.0), vectors(2.0), st.lists(st.integers(2, 30), min_size=5))
def test_a_constant_disturbance_is_found_whatever_the_intervals(sigma, start, known, pattern):
    """Without noise; the known acceleration and the drag are told apart from it."""
    drag = np.array([0.15, 0.5, 0.0])
    p, v = start.copy(), -start
    memory = started(p, v)
    for k in range(600):
        dt = 1e-3 * pattern[k % len(pattern)]
        a = known + sigma - drag * v
        p, v = p + dt * v + 0.5 * dt * dt * (known + sigma), v + dt * a
        memory, record = predictor.step(NOISE, memory, drag, BOUND, known, p, v, dt)
    assert memory.estimate[:, 2] == pytest.approx(sigma, abs=0.02)
    assert memory.estimate[:, 1] == pytest.approx(v, abs=2e-3)
    assert np.abs(record.y_tilde_m_s).max() < 2e-3
    assert not record.projecting


def innovations(seed, samples, *, sigma_walk=1.0):
    """ỹ over its stated deviation (samples, 3), on a plant that is as noisy as stated."""
    rng = np.random.default_rng(seed)
    p, v, sigma = np.zeros(3), np.zeros(3), np.zeros(3)
    memory, told = started(), []
    density, walk = np.array(NOISE.acceleration_m_s2_sqrt_hz), np.array(NOISE.sigma_walk)
    fine = 8
    far = np.full(3, 1e9)
    for k in range(samples):
        dt = 0.01 * rng.choice([1.0, 1.0, 1.0, 0.9, 2.0, 5.0])
        h = dt / fine
        pushes = density * rng.standard_normal((fine, 3)) / np.sqrt(h)
        turns = sigma_walk * walk * rng.standard_normal((fine, 3)) * np.sqrt(h)
        for push, turn in zip(pushes, turns, strict=True):
            a = sigma + push
            p, v, sigma = p + h * v + 0.5 * h * h * a, v + h * a, sigma + turn
        seen_p = p + NOISE.position_m * rng.standard_normal(3)
        seen_v = v + NOISE.velocity_m_s * rng.standard_normal(3)
        memory, record = predictor.step(NOISE, memory, NOTHING, far, NOTHING, seen_p, seen_v, dt)
        if k >= 200:
            told.append(record.y_tilde_m_s / record.y_tilde_deviation_m_s)
    return np.array(told)


def test_the_prediction_errs_by_as_much_as_it_says():
    ratio = innovations(3, 6000)
    assert ratio.std(axis=0) == pytest.approx(np.ones(3), abs=0.03)
    assert ratio.mean(axis=0) == pytest.approx(np.zeros(3), abs=0.05)


def test_its_errors_do_not_follow_from_one_another():
    """Else something that could be known of the vehicle would be left unused."""
    ratio = innovations(4, 6000)
    together = (ratio[1:] * ratio[:-1]).mean(axis=0)
    assert together == pytest.approx(np.zeros(3), abs=0.05)


def test_a_vehicle_that_is_pushed_about_more_than_stated_is_noticed():
    assert innovations(5, 3000, sigma_walk=8.0).std(axis=0).min() > 1.2


def test_the_estimate_is_held_at_its_bound_and_that_is_told():
    p, v = np.zeros(3), np.zeros(3)
    pushed, projected = np.array([9.0, 0.0, -9.0]), []
    memory = started()
    for _ in range(300):
        p, v = p + 0.01 * v + 5e-5 * pushed, v + 0.01 * pushed
        memory, record = predictor.step(NOISE, memory, NOTHING, BOUND, NOTHING, p, v, 0.01)
        assert (np.abs(memory.estimate[:, 2]) <= BOUND).all()
        projected.append(record.projecting)
    assert projected[-1]
    assert not projected[0]
    assert memory.estimate[:, 2] == pytest.approx([6.0, 0.0, -4.0], abs=1e-6)


def test_from_its_bound_it_comes_back_without_delay():
    p, v = np.zeros(3), np.zeros(3)
    memory = started()
    for k in range(400):
        pushed = np.array([9.0 if k < 300 else 0.0, 0.0, 0.0])
        p, v = p + 0.01 * v + 5e-5 * pushed, v + 0.01 * pushed
        memory, record = predictor.step(NOISE, memory, NOTHING, BOUND, NOTHING, p, v, 0.01)
    assert not record.projecting
    assert abs(memory.estimate[0, 2]) < 0.2


@settings(deadline=None, derandomize=True, max_examples=30)
@given(intervals)
def test_its_covariance_stays_one_and_settles(dts):
    memory = started()
    for dt in dts:
        memory, _ = predictor.step(
            NOISE, memory, NOTHING, BOUND, NOTHING, np.zeros(3), np.zeros(3), dt
        )
        covariance = memory.covariance
        assert (covariance == covariance.transpose(0, 2, 1)).all()
        assert np.linalg.eigvalsh(covariance).min() > 0.0
        assert (covariance[:, 0, 0] <= np.square(NOISE.position_m)).all()
        assert (covariance[:, 1, 1] <= np.square(NOISE.velocity_m_s)).all()


def test_after_a_gap_more_error_is_granted():
    memory = started()
    for _ in range(200):
        memory, usual = predictor.step(
            NOISE, memory, NOTHING, BOUND, NOTHING, np.zeros(3), np.zeros(3), 0.01
        )
    _, after = predictor.step(NOISE, memory, NOTHING, BOUND, NOTHING, np.zeros(3), np.zeros(3), 0.3)
    assert (after.y_tilde_deviation_m_s > 2.0 * usual.y_tilde_deviation_m_s).all()


def test_a_sample_that_confirms_the_prediction_changes_nothing():
    memory = started(np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.0, -0.5]))
    p, v = np.array([1.005, 2.0, 2.995]), np.array([0.5, 0.0, -0.5])
    after, record = predictor.step(NOISE, memory, NOTHING, BOUND, NOTHING, p, v, 0.01)
    assert record.y_tilde_m_s == pytest.approx(np.zeros(3), abs=1e-12)
    assert after.estimate == pytest.approx(np.column_stack([p, v, np.zeros(3)]), abs=1e-12)
