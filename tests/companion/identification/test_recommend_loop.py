"""The many loops of a search are those that certify reckons with, one by one."""

from dataclasses import replace

import numpy as np
import pytest

from companion.config.resolve import load_flight
from companion.control.qp.condensed import Weights
from companion.experiments.certified import certificate_subject
from companion.identification.recommend_loop import AxisNoise, Candidates, LoopBuilder, Rates
from companion.identification.recommend_plants import horizontal_family, vertical_family
from companion.identification.recommend_run import covariance, radii, responses
from companion.theory.certificate import inner_loop, whole_loop
from companion.theory.sampled_data import period_map
from companion.theory.sampled_noise import noise_gains

NOISE = AxisNoise(0.0, 0.015, 0.0)


def subject(vehicle):
    config = load_flight(None, {"controller": "mpc-l1", "vehicle": vehicle}, {})
    return certificate_subject(config, 4.5), config


def loops(vehicle, axis, noise=NOISE):
    certified, config = subject(vehicle)
    dynamics, l1, mpc = config.vehicle.dynamics, config.controller.l1, config.controller.mpc
    family = (
        horizontal_family(dynamics)
        if axis == 0
        else vertical_family(dynamics.climb, dynamics.loop_delay_s, autopilots=False)
    )
    rates = Rates(0.01, 3, dynamics.loop_delay_s, Weights(mpc.q, mpc.r, mpc.s))
    builder = LoopBuilder(family, rates, noise)
    gains = [np.array([values[axis]]) for values in (l1.m, l1.omega, l1.k, l1.gamma)]
    return certified, builder, builder.loops(Candidates(*gains, (mpc.horizon,)))


@pytest.mark.parametrize("vehicle", ["bebop2", "x500", "sih_quadx"])
@pytest.mark.parametrize("axis", [0, 2])
def test_the_nominal_loop_decays_as_certify_says(vehicle, axis):
    certified, _, found = loops(vehicle, axis)
    expected = period_map(whole_loop(certified)).radii[axis]
    assert radii(found)[0, 0] == pytest.approx(expected, abs=2e-3)


def test_a_held_reference_decays_as_certify_says_of_the_inner_loop():
    certified, builder, found = loops("bebop2", 0)
    held = [k for k, member in enumerate(builder.family) if member.held]
    gains = certified.gains
    share = builder.family[held[0]].gamma_share
    less = replace(certified, gains=replace(gains, gamma=tuple(share * g for g in gains.gamma)))
    expected = period_map(inner_loop(less)).radii[0] ** 3
    assert radii(found)[held[0], 0] == pytest.approx(expected, abs=2e-3)


def test_noise_comes_to_the_command_as_certify_says():
    certified, builder, found = loops("bebop2", 0)
    at_u = builder.plant_states  # the newest input on its way
    scatter = np.sqrt(covariance(found)[0, 0, at_u, at_u])
    expected = noise_gains(whole_loop(certified)).u_s_m[0] * NOISE.velocity_m_s
    assert scatter == pytest.approx(expected, rel=0.1)


def test_more_delay_is_less_stable():
    _, builder, found = loops("bebop2", 0)
    names = [member.name for member in builder.family]
    decays = dict(zip(names, radii(found)[:, 0], strict=True))
    assert decays["nominal"] < decays["delay +20 ms"] < decays["delay +40 ms"]


def test_a_vehicle_at_rest_on_its_path_stays_wherever_the_origin_is():
    _, builder, found = loops("x500", 0)
    still = np.tile([[0.0, 5.0]], (200, 1))
    gusts = np.zeros((len(builder.family), 100))
    nominal = found.part(np.array([0]), np.array([0]))
    positions, references = responses(nominal, still, gusts[:1], 100)
    assert np.allclose(positions[:, 0, 0], [0.0, 5.0], atol=1e-9)
    assert np.allclose(references[:, 0, 0], [0.0, 5.0], atol=1e-9)


def test_a_gust_pushes_and_the_loop_brings_the_vehicle_back():
    _, _, found = loops("x500", 0)
    still = np.zeros((700, 1))
    gust = np.zeros((1, 600))
    gust[0, 10:14] = 1.0
    nominal = found.part(np.array([0]), np.array([0]))
    positions, _ = responses(nominal, still, gust, 600)
    off = np.abs(positions[:, 0, 0, 0])
    # 1 m/s² for 0.12 s, unopposed, would be 0.12 m/s.
    assert 0.01 < off.max() < 0.12
    assert off[-1] < 0.1 * off.max()
