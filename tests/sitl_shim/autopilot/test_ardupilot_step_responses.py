"""Step responses of ArduCopter, read off over MAVLink: setpoint sent → motion reported."""

import math

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import least_squares

from tests.sitl_shim.autopilot.copter_client import hovering, tilted

_ATTITUDE, _LOCAL_POSITION = 30, 32
Samples = npt.NDArray[np.float64]


def _step(vehicle: str, axis: str, size: float) -> tuple[Samples, Samples]:
    """Times since the first setpoint of the step was sent (s), and the response over the step.

    Args:
        vehicle: what flies.
        axis: roll, pitch, yaw (deg) or climb (m/s).
        size: of the step.
    """
    # Of a step of 0.5 m/s the estimator's drift would be a good part.
    client = hovering(vehicle, sensors="exact" if axis == "climb" else None)
    for message in (_ATTITUDE, _LOCAL_POSITION):
        client.set_interval(message, 5_000)
    stop = client.every(0.01, lambda: client.climb(0.0, tilted()))
    client.run(2.0)
    stop()
    client.forget()
    begin_s = client.time_s
    if axis == "climb":
        client.every(0.01, lambda: client.climb(size, tilted()))
    else:
        angles = {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 90.0}
        angles[f"{axis}_deg"] += size
        client.every(0.01, lambda: client.climb(0.0, tilted(**angles)))
    client.run(2.5)
    if axis == "climb":
        rows = [(t - begin_s, -m.vz) for t, m in client.received("LOCAL_POSITION_NED")]
    else:
        rows = [
            (t - begin_s, math.degrees(getattr(m, axis))) for t, m in client.received("ATTITUDE")
        ]
    data = np.array(rows)
    return data[:, 0], (data[:, 1] - data[:5, 1].mean()) / size


def _crossing_s(times: Samples, response: Samples, level: float) -> float:
    return float(times[int(np.argmax(response > level))])


@pytest.mark.parametrize("axis", ["roll", "pitch"])
@pytest.mark.parametrize("size_deg", [5.0, -5.0])
def test_a_tilt_of_arducopter_is_that_which_was_measured(axis: str, size_deg: float) -> None:
    times, response = _step("arducopter", axis, size_deg)
    assert _crossing_s(times, response, 0.10) == pytest.approx(0.070, abs=0.025)
    assert _crossing_s(times, response, 0.63) == pytest.approx(0.211, rel=0.15)
    assert _crossing_s(times, response, 0.90) == pytest.approx(0.372, rel=0.15)
    assert response.max() < 1.03  # less than 1 % beside the estimator's own motion


def test_a_turn_of_arducopter_is_that_which_was_measured() -> None:
    times, response = _step("arducopter", "yaw", 30.0)
    assert _crossing_s(times, response, 0.10) == pytest.approx(0.339, rel=0.1)
    assert _crossing_s(times, response, 0.63) == pytest.approx(0.599, rel=0.1)
    assert _crossing_s(times, response, 0.90) == pytest.approx(0.742, rel=0.1)
    assert response.max() == pytest.approx(1.115, abs=0.03)


def test_a_climb_of_arducopter_is_that_which_was_measured() -> None:
    times, response = _step("arducopter", "climb", 0.5)
    assert _crossing_s(times, response, 0.10) == pytest.approx(0.209, rel=0.15)
    assert _crossing_s(times, response, 0.63) == pytest.approx(0.509, rel=0.1)
    assert _crossing_s(times, response, 0.90) == pytest.approx(0.709, rel=0.15)
    assert response.max() == pytest.approx(1.10, abs=0.06)


def _second_order(times: Samples, delay_s: float, omega: float, zeta: float) -> Samples:
    t = np.maximum(times - delay_s, 0.0)
    damped = omega * np.sqrt(1.0 - zeta**2)
    decay = np.exp(-zeta * omega * t)
    return 1.0 - decay * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t))


@pytest.mark.parametrize("axis", ["roll", "pitch"])
@pytest.mark.parametrize(
    ("vehicle", "omega", "zeta", "delay_s"),
    [("bebop2", 12.0, 0.8, 0.040), ("sih_quadx", 10.0, 1.0, 0.050)],
)
def test_other_vehicles_answer_as_they_do_under_px4(
    vehicle: str, axis: str, omega: float, zeta: float, delay_s: float
) -> None:
    times, response = _step(vehicle, axis, 10.0)
    within = times < 1.5
    times, response = times[within], response[within]

    def residuals(p: Samples) -> Samples:
        return p[3] * _second_order(times, p[0], p[1], min(p[2], 0.999)) - response

    fit = least_squares(residuals, [0.05, 10.0, 0.7, 1.0], diff_step=1e-4)
    assert fit.x[0] == pytest.approx(delay_s, abs=0.012)
    assert fit.x[1] == pytest.approx(omega, rel=0.15)
    assert min(fit.x[2], 1.0) == pytest.approx(zeta, rel=0.15)
