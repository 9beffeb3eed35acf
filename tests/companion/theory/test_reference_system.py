import numpy as np
import pytest

from companion.control import l1_adaptive
from companion.control.l1_adaptive import L1Gains
from companion.control.matrix_exponential import matrix_exponential
from companion.control.transfer_function import TransferFunction, first_order
from companion.theory.loops import AxisLoop
from companion.theory.plant import AxisPlant, evaluate, imaginary
from companion.theory.reference_system import largest_prediction_errors, simulate_reference
from tests.companion.theory.loops_for_tests import horizontal

M, C = first_order(0.5), first_order(0.215)
SECOND_ORDER_C = TransferFunction((0.24, 0.0144), (1.0, 0.24, 0.0144))
SECOND_ORDER_M = TransferFunction((2.0, 3.0), (1.0, 4.0, 3.0))
TIMES = np.arange(0.0, 20.0, 0.01)


def still(t, y):
    return 0.0


def step_response(transfer, times, length_s=160.0, step_s=1e-3):
    """By the inverse transform of the frequency response, which is the exact one."""
    count = round(length_s / step_s)
    omega = 2.0 * np.pi * np.fft.rfftfreq(count, step_s)
    omega[0] = 1e-9
    impulse = np.fft.irfft(transfer(imaginary(omega)), count)
    return np.interp(times, np.arange(count) * step_s, np.cumsum(impulse) - 0.5 * impulse)


@pytest.mark.parametrize("low_pass", [C, SECOND_ORDER_C])
@pytest.mark.parametrize("model", [M, SECOND_ORDER_M])
@pytest.mark.parametrize("delay_s", [0.0, 0.0403])
def test_a_step_of_r1_gives_the_step_response_of_h_c(model, low_pass, delay_s):
    loop = AxisLoop(horizontal(delay_s=delay_s), model, low_pass, 0.7, 300.0)
    run = simulate_reference(loop.plant, model, low_pass, TIMES, np.ones(len(TIMES)), still)
    expected = step_response(lambda s: loop.h(s) * evaluate(low_pass, s), run.times_s)
    assert np.abs(run.y1_ref_m_s - expected).max() < 2e-5


def test_a_disturbance_gives_the_response_of_g():
    loop = AxisLoop(horizontal(), M, C, 0.7, 300.0)
    run = simulate_reference(
        loop.plant, M, C, TIMES, np.zeros(len(TIMES)), lambda t, y: 0.1 * (1.0 - np.exp(-t))
    )
    expected = 0.1 * step_response(lambda s: loop.g(s) / (s + 1.0), run.times_s)
    assert np.abs(run.y1_ref_m_s - expected).max() < 2e-5


def test_a_disturbance_that_is_linear_in_the_speed_is_a_change_of_the_plant():
    """d = -c y1 on A(s) is no disturbance on A(s) / (1 + c A(s))."""
    c, plain = 0.05, AxisPlant(TransferFunction((9.81,), (1.0, 0.15)), 0.0)
    dragged = AxisPlant(TransferFunction((9.81,), (1.0, 0.15 + 9.81 * c)), 0.0)
    times = TIMES[:600]
    r1 = np.sin(times)
    other = simulate_reference(dragged, M, C, times, r1, still)
    for step_s in (1e-3, 2.5e-4):
        one = simulate_reference(plain, M, C, times, r1, lambda t, y: -c * y, step_s=step_s)
        # No delay: the disturbance is that of the step's beginning.
        assert np.abs(one.at(times) - other.at(times)).max() < 2.0 * step_s


@pytest.mark.parametrize("drag", [0.15, 0.0])
def test_it_begins_in_equilibrium(drag):
    run = simulate_reference(
        horizontal(drag=drag), M, C, TIMES, np.full(len(TIMES), 1.2), lambda t, y: 0.03, 1.2
    )
    assert np.abs(run.y1_ref_m_s - 1.2).max() < 1e-9
    assert run.u_ref == pytest.approx(np.full(len(run.u_ref), 1.2 * drag / 9.80665 - 0.03))
    assert (run.d_ref == 0.03).all()


@pytest.mark.parametrize(
    ("times", "r1"), [([0.0], [1.0]), ([0.0, 1.0], [1.0]), ([0.0, 1.0, 1.0], [1.0, 1.0, 1.0])]
)
def test_times_that_do_not_rise_or_do_not_fit_are_refused(times, r1):
    with pytest.raises(ValueError, match="rising"):
        simulate_reference(horizontal(), M, C, np.array(times), np.array(r1), still)


def fly(gamma, r1, d, step_s=0.0005):
    """y1 of the implemented law around A(s), 40 ms of delay, by steps of its own."""
    gains = L1Gains((M,), (C,), (1.0,), (gamma,), (1e9,))
    a, b, _ = horizontal().rational.state_space()
    system = np.zeros((4, 4))
    system[:3, :3], system[:3, 3] = a, b
    advance = matrix_exponential(system * step_s)
    x, queue = np.zeros(4), [0.0] * round(0.04 / step_s)
    zero = np.zeros(1)
    memory = l1_adaptive.start(gains, zero, zero)
    speeds = []
    for k in range(round(8.0 / step_s)):
        speeds.append(x[0])
        # r1 = K (r2 - y2) with K = 1 and y2 = 0.
        memory, record = l1_adaptive.step(
            gains, memory, np.array([r1(k * step_s)]), zero, x[:1].copy(), step_s
        )
        queue.append(float(record.u[0]) + d(k * step_s, x[0]))
        x[3] = queue.pop(0)
        x = advance @ x
    return np.array(speeds)


def test_the_implemented_law_tends_to_the_reference_system_as_gamma_grows():
    step_s = 0.0005
    times = np.arange(0.0, 8.0, step_s)

    def disturbance(t, y):
        return 0.02 * np.sin(1.5 * t) - 0.004 * abs(y) * y

    def r1(t):
        return 1.0 if t >= 1.0 else 0.0

    run = simulate_reference(
        horizontal(), M, C, times, np.array([r1(t) for t in times]), disturbance
    )
    apart = [
        np.abs(fly(gamma, r1, disturbance) - run.at(times)).max() for gamma in (500.0, 5e3, 5e4)
    ]
    assert apart[0] > 3.0 * apart[1] > 3.0 * apart[2]
    assert apart[2] < 0.003


# max |ỹ| against Γ

GAMMAS = np.geomspace(500.0, 20_000.0, 7)
SAMPLE_S = 5e-4


def slope(errors, gammas=GAMMAS):
    return np.polyfit(np.log(gammas), np.log(errors), 1)[0]


def kick(t):
    return (t > 0.1).astype(float)


def smooth(t):
    return np.where(t < np.pi, np.sin(t) ** 4, 0.0)


def test_a_step_on_a_relative_degree_of_1_falls_with_the_root_of_gamma():
    plant = AxisPlant(TransferFunction((1.0,), (1.0, 1.0)), 0.0)
    errors = largest_prediction_errors(plant, M, C, GAMMAS, SAMPLE_S, kick, 3.0)
    assert slope(errors) == pytest.approx(-0.5, abs=0.02)
    # σ jumps by 1/m and ỹ swings up to √(m/Γ) of it, less its damping.
    assert errors[-1] == pytest.approx(np.sqrt(0.5 / GAMMAS[-1]) / 0.5, rel=0.02)


@pytest.mark.parametrize(
    "plant", [AxisPlant(TransferFunction((1.0,), (1.0, 1.0)), 0.0), horizontal()]
)
def test_a_smooth_disturbance_falls_with_gamma_itself(plant):
    errors = largest_prediction_errors(plant, M, C, GAMMAS, SAMPLE_S, smooth, 4.0, gain_k=0.7)
    assert slope(errors) < -0.95
    assert slope(errors) == pytest.approx(-1.0, abs=0.1)


def test_a_lag_in_the_plant_makes_a_step_smooth():
    errors = largest_prediction_errors(horizontal(), M, C, GAMMAS[2:], SAMPLE_S, kick, 4.0)
    assert slope(errors, GAMMAS[2:]) < -0.9


def test_noise_sets_a_floor():
    plant = horizontal()
    noise = 0.015 * np.random.default_rng(1).standard_normal(8000)
    errors = largest_prediction_errors(
        plant, M, C, GAMMAS, SAMPLE_S, smooth, 4.0, velocity_noise_m_s=noise
    )
    assert errors.min() > 0.04
    assert abs(slope(errors[-3:], GAMMAS[-3:])) < 0.2


def test_what_runs_away_is_infinite():
    errors = largest_prediction_errors(
        horizontal(), M, C, np.array([20.0, 1000.0]), 0.002, kick, 60.0
    )
    assert errors[0] == np.inf
    assert np.isfinite(errors[1])
