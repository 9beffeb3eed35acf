import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.config.models import MissionConfig
from companion.config.resolve import load_flight
from companion.control.feedback import direct
from companion.control.frameworks import Tick
from companion.control.inner import L1Controller
from companion.control.l1_adaptive import first_order_gains
from companion.control.matrix_exponential import matrix_exponential
from companion.experiments.certified import certificate_subject
from companion.flight.assemble import make_stack
from companion.theory.adaptation_rate import adaptation_radii, safe_gamma, sampling_limit
from companion.theory.certificate import inner_loop, whole_loop
from companion.theory.plant import AxisPlant
from companion.theory.sampled_data import PeriodRun, period_map, sampled_loop
from companion.theory.sampled_noise import noise_gains
from companion.vehicle_state import VehicleState
from tests.companion.theory.loops_for_tests import horizontal

LAW = settings(deadline=None, derandomize=True, max_examples=25)
KICK_M = 1e-3


class FinePlant:
    """A(s) and position of one axis in steps of 0.5 ms, the input through a queue."""

    STEP_S = 0.0005

    def __init__(self, plant: AxisPlant, more_delay_s: float = 0.0):
        a, b, _ = plant.rational.state_space()
        n = len(b)
        system = np.zeros((n + 2, n + 2))
        system[:n, :n], system[:n, -1] = a, b
        system[n, 0] = 1.0
        self.step = matrix_exponential(system * self.STEP_S)
        self.x = np.zeros(n + 2)
        self.queue = [0.0] * round((plant.delay_s + more_delay_s) / self.STEP_S)

    def advance(self, u: float, seconds: float) -> None:
        for _ in range(round(seconds / self.STEP_S)):
            self.queue.append(u)
            self.x[-1] = self.queue.pop(0)
            self.x = self.step @ self.x

    @property
    def position_and_velocity(self):
        return float(self.x[-2]), float(self.x[0])


def flown(controller, periods, sample_s=0.01):
    """Positions (periods + 1, axes) of the very stack that flies, kicked at rest, at its plans."""
    config = load_flight(None, {"controller": controller, "vehicle": "bebop2"}, {})
    subject = certificate_subject(config, 4.5)
    loop = whole_loop(replace(subject, sample_s=sample_s))
    stack = make_stack(config.controller, config.vehicle, MissionConfig())
    stack = replace(stack, outer=subject.outer)
    plants = [FinePlant(plant) for plant in loop.plants]

    def state(at_s):
        position, velocity = zip(*(p.position_and_velocity for p in plants), strict=True)
        return VehicleState(at_s, position, velocity, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    memory = stack.start(state(-sample_s))
    period = stack.outer.period_s or sample_s
    memory = replace(memory, outer_due_s=0.0, outer_ran_s=-period)
    for plant in plants:
        plant.x[-2] = KICK_M
    positions = []
    for k in range(round(periods * period / sample_s) + 1):
        if k % round(period / sample_s) == 0:
            positions.append([plant.position_and_velocity[0] for plant in plants])
        tick = Tick(state(k * sample_s), loop.known_delay_s, 0.0)
        memory, _, record = stack.step(memory, tick, lambda t: np.zeros((len(t), 3)))
        for axis, plant in enumerate(plants):
            plant.advance(float(record.applied_u[axis]), sample_s)
    return loop, np.array(positions)


@pytest.mark.parametrize("controller", ["mpc-l1", "pid-l1", "lqr-l1", "l1"])
def test_the_matrix_foretells_what_the_flying_stack_does(controller):
    periods = 60
    loop, positions = flown(controller, periods)
    matrices = period_map(loop).matrices
    for axis, plant in enumerate(loop.plants):
        place = plant.rational.order  # position comes after the states of A(s)
        vector = np.zeros(matrices.shape[1])
        vector[place] = KICK_M
        for k in range(periods + 1):
            assert vector[place] == pytest.approx(positions[k, axis], abs=1e-6 * KICK_M + 1e-12)
            vector = matrices[axis] @ vector
    assert np.abs(positions[-1]).max() < KICK_M


def test_a_radius_above_1_is_a_loop_that_runs_away():
    gains = first_order_gains((0.5,), (0.6,), (0.75,), (300.0,), (1e60,))
    plant = horizontal()
    loop = sampled_loop((plant,), L1Controller(gains), direct(1), 0.01, 0.0)
    radius = period_map(loop).radii[0]
    assert radius > 1.0
    fine, law = FinePlant(plant), loop.inner
    memory, _ = law.start(np.zeros(1), np.zeros(1), np.zeros(1))
    fine.x[-2] = KICK_M
    sizes = []
    for _ in range(900):
        position, velocity = (np.array([v]) for v in fine.position_and_velocity)
        memory, record = law.step(memory, np.zeros(1), position, velocity, 0.01)
        fine.advance(float(record.u[0]), 0.01)
        sizes.append(np.abs(fine.x[:-1]).max())
    growth = (max(sizes[-100:]) / max(sizes[-500:-400])) ** (1.0 / 400.0)
    assert growth == pytest.approx(radius, abs=2e-3)


@pytest.mark.parametrize("sample_s", [0.01, 0.004, 0.0125])
def test_a_delay_between_samples_is_held_exactly(sample_s):
    gains = first_order_gains((0.5,), (0.2,), (0.75,), (400.0,), (1e9,))
    plant = horizontal(delay_s=0.0365)
    loop = sampled_loop((plant,), L1Controller(gains), None, sample_s, 0.0)
    matrix = period_map(loop).matrices[0]
    fine, law = FinePlant(plant), loop.inner
    memory, _ = law.start(np.zeros(1), np.zeros(1), np.zeros(1))
    fine.x[-2] = KICK_M
    vector = np.zeros(len(matrix))
    vector[3] = KICK_M
    for _ in range(100):
        position, velocity = (np.array([v]) for v in fine.position_and_velocity)
        memory, record = law.step(memory, np.zeros(1), position, velocity, sample_s)
        fine.advance(float(record.u[0]), sample_s)
        vector = matrix @ vector
        assert vector[3] == pytest.approx(fine.position_and_velocity[0], abs=1e-6 * KICK_M)


def subject_of(controller="mpc-l1", vehicle="bebop2", **settings_):
    config = load_flight(None, {"controller": controller, "vehicle": vehicle}, settings_)
    return certificate_subject(config, 4.5)


@pytest.mark.parametrize("gamma", [300.0, 5000.0])
def test_noise_comes_to_y_tilde_and_u_as_in_a_flight_of_noise_alone(gamma):
    subject = subject_of()
    gains = replace(subject.gains, gamma=(gamma,) * 3)
    loop = whole_loop(replace(subject, gains=gains))
    foretold = noise_gains(loop)
    run = PeriodRun(loop)
    rng = np.random.default_rng(1)
    states = np.zeros((3, run.size))
    kicks = [run.from_noise(k, 1e-6) for k in range(run.samples)]
    free = period_map(loop).matrices
    squares, samples = np.zeros((2, 3)), 0
    for period in range(4000):
        n = rng.standard_normal((run.samples, 3))
        if period >= 200 and period % 20 == 0:  # ỹ and u of this period, from state and noise
            _, outputs = run.from_state(1e-6 * states)
            y, u = outputs.y_tilde_m_s / 1e-6, outputs.u / 1e-6
            for k, (_, kick) in enumerate(kicks):
                y = y + kick.y_tilde_m_s / 1e-6 * n[k]
                u = u + kick.u / 1e-6 * n[k]
            squares += np.stack([(y**2).sum(axis=0), (u**2).sum(axis=0)])
            samples += run.samples
        states = (free @ states[:, :, None])[:, :, 0]
        for k, (kick, _) in enumerate(kicks):
            states = states + kick / 1e-6 * n[k][:, None]
    found = np.sqrt(squares / samples)
    assert found[0] == pytest.approx(foretold.y_tilde, rel=0.12)
    assert found[1] == pytest.approx(foretold.u_s_m, rel=0.12)


def test_a_memory_that_nothing_moves_is_no_mode_of_the_loop():
    """The integral of a PID without an integral gain; noise is told of that loop, too."""
    gains = first_order_gains((0.5,), (0.2,), (0.75,), (400.0,), (1e9,))
    loop = sampled_loop((horizontal(),), L1Controller(gains), direct(1), 0.01, 0.0)
    alone = replace(loop, outer=None)
    assert period_map(loop).radii == pytest.approx(period_map(alone).radii, abs=1e-12)
    assert noise_gains(loop).y_tilde == pytest.approx(noise_gains(alone).y_tilde)
    assert np.isfinite(noise_gains(loop).y_tilde).all()


def test_noise_of_an_unstable_loop_is_no_number():
    loop = whole_loop(subject_of(**{"controller.l1.gamma": "[100, 300, 1000]"}))
    assert np.isnan(noise_gains(loop).y_tilde).tolist() == [True, False, False]


def test_a_common_period_is_found_for_odd_rates_and_refused_for_hopeless_ones():
    subject = subject_of()
    assert period_map(whole_loop(subject)).period_s == pytest.approx(0.03)
    assert period_map(inner_loop(subject)).period_s == pytest.approx(0.01)
    faster = period_map(whole_loop(replace(subject, sample_s=0.004)))
    assert faster.period_s == pytest.approx(0.06)
    assert (faster.radii < 1.0).all()
    with pytest.raises(ValueError, match="no common period"):
        period_map(whole_loop(replace(subject, sample_s=0.01 / math.pi)))


def test_the_slowest_pole_says_how_it_dies_away():
    loop, positions = flown("mpc-l1", 200)
    pole = period_map(loop).critical[0]
    assert pole.real < 0.0
    late = np.abs(positions[100:, 0])
    times = 0.03 * np.arange(len(late))
    peaks = [k for k in range(1, len(late) - 1) if late[k] >= max(late[k - 1], late[k + 1])]
    slope = np.polyfit(times[peaks], np.log(late[peaks]), 1)[0]
    assert slope == pytest.approx(pole.real, rel=0.1)


# The adaptation law by itself


@LAW
@given(st.floats(0.1, 20.0), st.floats(1.0, 2000.0), st.floats(0.001, 0.02))
def test_explicit_euler_is_stable_exactly_below_its_limit(m, gamma, sample_s):
    gains = first_order_gains((m,), (0.2,), (1.0,), (gamma,), (1e9,), discretisation="euler")
    radius = adaptation_radii(gains, sample_s)[0]
    oscillates = m * gamma > (0.5 * m) ** 2
    if oscillates and abs(gamma * sample_s - 1.0) > 1e-3:
        assert (radius < 1.0) == (gamma * sample_s < 1.0)
        assert radius == pytest.approx(math.sqrt(1 - m * sample_s * (1 - gamma * sample_s)))


@LAW
@given(st.floats(0.1, 20.0), st.floats(1.0, 1e9), st.floats(0.001, 0.05))
def test_the_exact_step_is_stable_by_itself_far_beyond_what_samples_hold(m, gamma, sample_s):
    gains = first_order_gains((m,), (0.2,), (1.0,), (gamma,), (1e9,))
    assert adaptation_radii(gains, sample_s)[0] < 1.0


@pytest.mark.parametrize("bound", [16.0, 1e9])
def test_the_radius_of_the_law_does_not_depend_on_the_projection(bound):
    gains = first_order_gains((0.5,), (0.2,), (1.0,), (1e12,), (bound,))
    assert adaptation_radii(gains, 0.01)[0] == pytest.approx(math.exp(-0.5 * 0.5 * 0.01), abs=1e-5)


def test_a_step_beyond_the_range_of_numbers_has_an_infinite_radius_on_its_axis_alone():
    gains = first_order_gains((0.5,) * 2, (0.2,) * 2, (1.0,) * 2, (1e300, 300.0), (16.0,) * 2)
    radii = adaptation_radii(gains, 0.01)
    assert np.isinf(radii[0])
    assert radii[1] < 1.0


def range_of(subject):
    return safe_gamma(whole_loop(subject), subject.gains)


@pytest.mark.parametrize("vehicle", ["bebop2", "x500"])
def test_the_loop_is_unstable_just_below_the_least_safe_rate(vehicle):
    subject = subject_of(vehicle=vehicle)
    low = range_of(subject).low[0]
    assert 50.0 < low < subject.gains.gamma[0]
    for share, stable in ((1.01, True), (0.99, False)):
        gains = replace(subject.gains, gamma=(share * low, *subject.gains.gamma[1:]))
        other = replace(subject, gains=gains)
        radii = [period_map(loop(other)).radii[0] for loop in (inner_loop, whole_loop)]
        assert (max(radii) < 1.0) == stable


def test_safe_ends_where_ten_times_the_mode_is_the_sampling_frequency():
    subject = subject_of()
    found = range_of(subject)
    for i, model in enumerate(subject.gains.reference_model):
        m = model.denominator[1]
        assert 10.0 * math.sqrt(m * found.safe[i]) == pytest.approx(2.0 * math.pi * 100.0)
        assert found.low[i] < subject.gains.gamma[i] < found.safe[i] < found.high[i]


@pytest.mark.parametrize("gamma", [1.9e5, 1e12, 1e20])
def test_the_range_is_the_same_however_far_beyond_it_the_chosen_rate_lies(gamma):
    subject = subject_of()
    expected = range_of(subject)
    found = range_of(replace(subject, gains=replace(subject.gains, gamma=(gamma,) * 3)))
    assert found.low == pytest.approx(expected.low, rel=1e-3)
    assert found.high == pytest.approx(expected.high)
    assert found.safe == pytest.approx(expected.safe)


def test_the_upper_end_is_where_half_the_sampling_frequency_is_or_eulers_limit():
    subject = subject_of()
    exact = range_of(subject)
    assert exact.reasons == ("nyquist",) * 3
    for i, model in enumerate(subject.gains.reference_model):
        assert exact.high[i] == sampling_limit(model, 0.01)
        m = model.denominator[1]
        assert math.sqrt(m * exact.high[i]) == pytest.approx(math.pi / 0.01)
    gains = replace(subject.gains, discretisation="euler")
    euler = range_of(replace(subject, gains=gains, sample_s=0.004))
    assert euler.reasons == ("euler",) * 3
    assert euler.high == pytest.approx([250.0] * 3, rel=1e-3)
    assert (euler.safe == euler.high).all()
    # At 100 Hz what Euler bears at most is less than what the loop needs at least.
    assert np.isnan(range_of(replace(subject, gains=gains)).low[:2]).all()
