"""Each law over many vehicles is the flight's law for each of them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control import delay, l1_adaptive, thrust, tilt
from companion.control.delay import AppliedReference
from companion.control.inner import L1Controller
from companion.control.l1_adaptive import L1Gains, first_order_gains
from companion.control.mpc import Mpc, MpcSettings
from companion.control.qp.condensed import Weights
from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.reference_model import Array, PositionModel
from companion.control.thrust import ThrustGains
from companion.control.transfer_function import TransferFunction, first_order
from companion.experiments.batched.flying import _limited
from companion.experiments.batched.inner_laws import L1Law, make_inner
from companion.experiments.batched.outer_laws import PlanningLaw
from companion.experiments.batched.thrust_law import ThrustLaw

LAW = settings(deadline=None, derandomize=True, max_examples=5)
SEEDS = st.integers(0, 10_000)
VEHICLES = 4
MODEL = PositionModel((0.5, 0.5, 3.75), (0.75, 0.75, 0.55))
GAINS = first_order_gains(
    MODEL.m, (0.215, 0.215, 4.0), MODEL.gain_k, (300.0, 300.0, 1000.0), (16.0, 16.0, 8.0)
)
HIGHER_ORDER = replace(
    GAINS, low_pass=(TransferFunction((9.0,), (1.0, 5.0, 9.0)), *map(first_order, (2.0, 4.0)))
)
NARROW = replace(GAINS, sigma_bound=(0.3, 16.0, 0.5))


@pytest.mark.parametrize("gains", [GAINS, HIGHER_ORDER, NARROW])
@LAW
@given(seed=SEEDS)
def test_the_l1_law_is_the_flights_for_each_vehicle(gains: L1Gains, seed: int) -> None:
    rng = np.random.default_rng(seed)
    law = make_inner(L1Controller(gains), VEHICLES)
    assert isinstance(law, L1Law)
    rest = np.zeros(3)
    memories = [l1_adaptive.start(gains, rest, rest) for _ in range(VEHICLES)]
    for k in range(20):
        r2, position = rng.normal(size=(2, 3, VEHICLES))
        velocity = 0.1 * rng.normal(size=(3, VEHICLES))
        dt_s = (0.008, 0.012)[k % 2]
        u = law.step(r2, position, velocity, dt_s)
        cut = np.clip(u, -0.2, 0.2)
        for v in range(VEHICLES):
            memory, record = l1_adaptive.step(
                gains, memories[v], r2[:, v], position[:, v], velocity[:, v], dt_s
            )
            assert u[:, v] == pytest.approx(record.u, abs=1e-9)
            memories[v] = l1_adaptive.with_applied(gains, memory, np.clip(record.u, -0.2, 0.2))
        law.take(cut)
    assert (law.projected > 0) == (gains is NARROW)


@LAW
@given(curve=st.sampled_from([0.0, 0.4, 1.0]), seed=SEEDS)
def test_the_thrust_law_is_the_flights_for_each_vehicle(curve: float, seed: int) -> None:
    gains = ThrustGains(6.0, 3.0, 0.5, curve, 0.2, 0.8, 4.0, 0.003, 0.2)
    rng = np.random.default_rng(seed)
    first = rng.normal(size=VEHICLES)
    law = ThrustLaw(gains, first)
    memories = [thrust.start(gains, float(rate)) for rate in first]
    for _ in range(40):
        command, rate = 2.0 * rng.normal(size=(2, VEHICLES))
        cosine = rng.uniform(0.3, 1.0, VEHICLES)
        fields = law.step(command, rate, cosine, 0.012)
        for v in range(VEHICLES):
            told = (float(command[v]), float(rate[v]), float(cosine[v]))
            memories[v], field = thrust.step(gains, memories[v], *told, 0.012)
            assert fields[v] == pytest.approx(field, abs=1e-12)


@LAW
@given(seed=SEEDS, hard=st.booleans())
def test_the_mpc_and_the_way_over_the_delay_are_the_flights(seed: int, hard: bool) -> None:
    rng = np.random.default_rng(seed)
    configured = MpcSettings(
        MODEL, 0.03, 12, Weights(17.0, 0.1, 0.02), 30.0 if hard else 1e6, (1.0, 3.0, 1.5),
        (-3.0, -3.0, 0.2), (3.0, 3.0, 4.0),
    )  # fmt: skip
    start = np.tile([[0.1], [0.2], [1.0]], VEHICLES)
    delay_s = np.array([0.0, 0.0301, 0.045, 0.12])
    law = PlanningLaw(Mpc(configured, OsqpSolver), OsqpSolver, start, delay_s)
    mpc = Mpc(configured, OsqpSolver)

    def desired(times_s: Array) -> Array:
        turn = np.stack([np.cos(times_s) - 0.9, 0.2 + 0.1 * np.sin(2.0 * times_s)])
        return np.concatenate([turn, 1.0 + 0.0 * times_s[None]])

    memories = [mpc.start(start[:, v]) for v in range(VEHICLES)]
    applied: list[tuple[AppliedReference, ...]]
    applied = [(AppliedReference(-math.inf, start[:, v]),) for v in range(VEHICLES)]
    for time_s in (0.0, 0.04, 0.06, 0.1, 0.12, 0.16):
        position = start + 0.02 * rng.normal(size=start.shape)
        velocity = 0.1 * rng.normal(size=start.shape)
        r2 = law.step(time_s, position, velocity, desired, 0.03)
        for v in range(VEHICLES):
            acts_s = time_s + float(delay_s[v])
            carried = delay.carry(
                MODEL.m, MODEL.gain_k, position[:, v], velocity[:, v], time_s, acts_s, applied[v]
            )
            preview = desired(acts_s + mpc.preview_times_s).T
            memories[v], alone, _ = mpc.step(memories[v], *carried, preview)
            applied[v] += (AppliedReference(acts_s, alone),)
            assert r2[:, v] == pytest.approx(alone, abs=2e-3 if hard else 1e-8)
    assert bool(law.constrained.all()) == hard
    assert law.failed.tolist() == [0] * VEHICLES


@LAW
@given(seed=SEEDS)
def test_what_is_asked_for_is_limited_as_in_flight(seed: int) -> None:
    u = 2.0 * np.random.default_rng(seed).normal(size=(3, VEHICLES))
    limited = _limited(u, math.sin(0.6), -1.2, 1.5)
    for v in range(VEHICLES):
        alone = tilt.limit_tilt(float(u[0, v]), float(u[1, v]), 0.6)
        assert limited[:2, v] == pytest.approx(alone)
        assert limited[2, v] == max(-1.2, min(1.5, u[2, v]))
