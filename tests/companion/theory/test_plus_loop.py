"""The linear loop of MPC-L1+ against the stack that flies."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from companion.control.plus import predictor
from companion.control.plus.predictor import PredictorMemory
from companion.theory.plus_family import FAMILY, combined, drag, gain, lag, late, push, slow
from companion.theory.plus_figures import (
    Noises,
    deviation,
    gust_deviation,
    margins,
    peak_gain,
    predictor_figures,
    rest,
    step_response,
)
from companion.theory.plus_loop import (
    INPUT,
    INPUT_RATE,
    POSITION,
    VELOCITY,
    broken_at_u,
    closed_loop,
    law_response,
    radii,
)
from tests.companion.theory.plus_flights import FINE_S, flown, law_and_plants, subject_of

KICK_M = 1e-3
VEHICLES = ["bebop2", "x500", "sih_quadx", "arducopter"]
AS_IDENTIFIED = combined()
COMBINATION = combined(lag(1.25), late(0.0135), drag(2.0), gain(0.9), push(1.1))


@lru_cache
def loop_of(vehicle):
    subject = subject_of(vehicle)
    return subject, *law_and_plants(subject)


@lru_cache
def margins_of(vehicle):
    _, law, plants = loop_of(vehicle)
    return margins(law, plants)


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("change", [AS_IDENTIFIED, COMBINATION], ids=["identified", "other"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_linear_loop_foretells_what_the_flying_stack_does(vehicle, change, axis):
    subject, law, plants = loop_of(vehicle)
    plant = change(plants[axis])
    positions, inputs = flown(subject, law, axis, plant, 150, kick_m=KICK_M)
    loop = closed_loop(law, axis, plant)
    x = np.zeros(len(loop.a))
    x[0] = KICK_M
    for position, u in zip(positions, inputs, strict=True):
        assert x[0] == pytest.approx(position, abs=1e-6 * KICK_M)
        assert loop.c[INPUT] @ x == pytest.approx(u, abs=1e-6 * np.abs(inputs).max())
        x = loop.a @ x
    assert np.abs(positions).max() <= KICK_M * 1.5


@pytest.mark.parametrize("vehicle", ["bebop2", "arducopter"])
@pytest.mark.parametrize("axis", [0, 2])
def test_a_disturbance_moves_the_vehicle_as_the_response_says_and_is_taken_off(vehicle, axis):
    subject, law, plants = loop_of(vehicle)
    size = 0.02
    positions, _ = flown(subject, law, axis, plants[axis], 400, disturbance_m_s2=size)
    loop = closed_loop(law, axis, plants[axis])
    response = step_response(loop, POSITION, 3.99)
    assert positions == pytest.approx(size * response, abs=1e-6 * size)
    assert rest(loop, POSITION) == pytest.approx(0.0, abs=1e-9)
    assert abs(response[-1]) < 0.01 * np.abs(response).max()


@pytest.mark.parametrize("vehicle", ["bebop2", "arducopter"])
@pytest.mark.parametrize("axis", [0, 2])
def test_just_beyond_the_delay_margin_the_flying_stack_runs_away_as_foretold(vehicle, axis):
    subject, law, plants = loop_of(vehicle)
    margin_s = margins_of(vehicle)[axis].delay_s
    grown = {}
    for share in (1.2, 0.8):
        steps = round(share * margin_s / FINE_S)
        plant = late(steps * FINE_S)(plants[axis])
        radius = radii(law, (plant,) * 3)[axis]
        positions, _ = flown(subject, law, axis, plant, 900, kick_m=1e-5)
        before, after = np.abs(positions[400:600]).max(), np.abs(positions[700:]).max()
        grown[share] = after / before
        assert grown[share] == pytest.approx(radius**300, rel=0.2)
    assert grown[1.2] > 1.2
    assert grown[0.8] < 0.8


def test_what_the_theory_calls_unstable_runs_away_and_the_rest_does_not():
    for vehicle in ("x500", "sih_quadx"):
        subject, law, plants = loop_of(vehicle)
        for axis in (0, 2):
            found = []
            for factor, late_s in ((1.8, 0.08), (1.1, 0.01)):
                plant = combined(slow(factor), late(late_s))(plants[axis])
                unstable = closed_loop(law, axis, plant).radius >= 1.0
                positions, _ = flown(subject, law, axis, plant, 500, kick_m=1e-6)
                runs_away = np.abs(positions[300:]).max() > np.abs(positions[:200]).max()
                assert runs_away == unstable
                found.append(unstable)
            assert found == [True, False]


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_margins_by_trial_are_where_the_frequency_response_meets_minus_one(vehicle):
    _, law, plants = loop_of(vehicle)
    for axis, found in enumerate(margins_of(vehicle)):
        omega = np.linspace(0.5, 60.0, 20_000)
        response = law_response(law, axis, omega)
        loop = broken_at_u(response, plants[axis], omega, law.sample_s)
        for factor in (found.gain_up, found.gain_down):
            if 0.0 < factor < np.inf:
                assert np.abs(1.0 + factor * loop).min() < 5e-3
        later = broken_at_u(response, late(found.delay_s)(plants[axis]), omega, law.sample_s)
        assert np.abs(1.0 + later).min() < 5e-3
        assert np.abs(1.0 + loop).min() == pytest.approx(found.modulus, rel=1e-3)
        # A distance from -1 bounds gain and phase.
        assert found.gain_up >= 1.0 / (1.0 - found.modulus) - 1e-6
        assert found.phase_rad >= 2.0 * np.arcsin(0.5 * found.modulus) - 1e-3


def test_an_unstable_loop_has_no_margins_and_no_noise():
    _, law, plants = loop_of("bebop2")
    lost = tuple(late(0.12)(plant) for plant in plants)
    assert all(np.isnan(found.modulus) for found in margins(law, lost))
    loop = closed_loop(law, 0, lost[0])
    assert np.isnan(deviation(loop, INPUT, Noises(1e-3, 1e-2, 1e-2, 0.02)))
    assert np.isnan(gust_deviation(loop, POSITION, 1.0))
    assert peak_gain(loop, VELOCITY) == np.inf


def test_noise_comes_to_the_command_as_in_a_flight_of_noise_alone():
    subject, law, plants = loop_of("bebop2")
    sizes = np.array([1e-3, 1.5e-2, 1e-2, 0.0])
    noise = np.random.default_rng(3).standard_normal((60_000, 4)) * sizes
    loop = closed_loop(law, 0, plants[0])
    x, inputs, rates = np.zeros(len(loop.a)), np.empty(len(noise)), np.empty(len(noise))
    for k, n in enumerate(noise):
        outputs = loop.c @ x + loop.d[:, 1:] @ n
        inputs[k], rates[k] = outputs[INPUT], outputs[INPUT_RATE]
        x = loop.a @ x + loop.b[:, 1:] @ n
    _, of_stack = flown(subject, law, 0, plants[0], 200, noise=noise[:200])
    assert inputs[:200] == pytest.approx(of_stack, abs=1e-6)
    assert rates[1:] == pytest.approx(np.diff(inputs) / law.sample_s, abs=1e-9)
    noises = Noises(*sizes[:3], 0.0)
    assert inputs.std() == pytest.approx(deviation(loop, INPUT, noises), rel=0.04)
    assert rates.std() == pytest.approx(deviation(loop, INPUT_RATE, noises), rel=0.03)


def test_gusts_and_the_worst_disturbance_by_simulation():
    _, law, plants = loop_of("x500")
    loop = closed_loop(law, 0, plants[0])
    rng = np.random.default_rng(5)
    keep = np.exp(-law.sample_s / 1.0)
    x, d, positions = np.zeros(len(loop.a)), 0.0, []
    for _ in range(60_000):
        positions.append(x[0])
        x = loop.a @ x + loop.b[:, 0] * d
        d = keep * d + np.sqrt(1.0 - keep**2) * rng.standard_normal()
    assert np.std(positions) == pytest.approx(gust_deviation(loop, POSITION, 1.0), rel=0.05)
    impulse, x = [], loop.b[:, 0]
    for _ in range(800):
        impulse.append(x[1])
        x = loop.a @ x
    worst = np.sign(impulse[::-1])  # of all disturbances of at most 1 the worst for the velocity
    x = np.zeros(len(loop.a))
    for d in worst:
        x = loop.a @ x + loop.b[:, 0] * d
    assert x[1] == pytest.approx(peak_gain(loop, VELOCITY), rel=1e-6)


def test_the_adaptation_buys_the_whole_of_a_lasting_disturbance():
    subject, law, plants = loop_of("bebop2")
    held = replace(subject.stack, settings=replace(subject.stack.settings, held_sigma=(0.0,) * 3))
    subject = replace(subject, stack=held)
    unadapted, _ = law_and_plants(subject)
    loop = closed_loop(unadapted, 0, plants[0])
    positions, _ = flown(subject, unadapted, 0, plants[0], 400, disturbance_m_s2=0.02)
    assert positions[-1] == pytest.approx(0.02 * rest(loop, POSITION), rel=1e-3)
    adapting = closed_loop(law, 0, plants[0])
    assert abs(rest(loop, POSITION)) > 0.02
    assert gust_deviation(adapting, POSITION, 1.0) < 0.6 * gust_deviation(loop, POSITION, 1.0)


@pytest.mark.parametrize("vehicle", ["bebop2", "sih_quadx"])
def test_no_walk_of_sigma_within_its_rate_makes_more_of_y_tilde_than_the_bound(vehicle):
    subject, law, _ = loop_of(vehicle)
    noise, nothing = subject.stack.settings.noise, np.zeros(3)
    found = predictor_figures(noise, nothing, law.covariance, law.sample_s)
    assert (found.radius < 1.0).all()
    h, rate, rng = law.sample_s, 5.0, np.random.default_rng(1)
    memory = PredictorMemory(np.zeros((3, 3)), law.covariance)
    p, v, sigma = np.zeros(3), np.zeros(3), np.zeros(3)
    largest, slope = np.zeros(3), np.full(3, rate)
    far = np.full(3, 1e9)
    for k in range(3000):
        if k > 1500:  # a steady slope first, then a wild one
            slope = np.where(rng.random(3) < 0.05, -slope, slope)
        p = p + h * v + h**2 / 2.0 * sigma + h**3 / 6.0 * slope
        v = v + h * sigma + h**2 / 2.0 * slope
        sigma = sigma + h * slope
        memory, record = predictor.step(noise, memory, nothing, far, nothing, p, v, h)
        memory = replace(memory, covariance=law.covariance)
        largest = np.maximum(largest, np.abs(record.y_tilde_m_s))
    bound = found.y_tilde_s2 * rate
    assert (largest <= bound * (1.0 + 1e-6)).all()
    assert (largest >= 0.7 * bound).all()


def test_members_of_the_family_are_what_they_are_called():
    _, _, plants = loop_of("bebop2")
    plant = plants[0]
    for factor in (0.75, 1.25, 1.5):
        slower = lag(factor)(plant).actuation
        assert slower.lag_s == pytest.approx(factor * plant.actuation.lag_s)
        assert slower.damping > plant.actuation.damping or factor < 1.0
        stretched = slow(factor)(plant).actuation
        assert stretched.lag_s == pytest.approx(factor * plant.actuation.lag_s)
        assert stretched.damping == plant.actuation.damping
    assert late(0.02)(plant).actuation.delay_s == pytest.approx(plant.actuation.delay_s + 0.02)
    names = [member.name for member in FAMILY]
    assert len(set(names)) == len(names)
