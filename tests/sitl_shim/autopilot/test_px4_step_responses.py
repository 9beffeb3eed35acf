"""Step responses, read off over MAVLink: setpoint sent → attitude reported."""

import math

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import least_squares

from tests.sitl_shim.mavlink.shim_client import OFFBOARD, ShimClient, airborne

_ATTITUDE = 30
_SEED = 1
Samples = npt.NDArray[np.float64]


def _quaternion(roll_rad: float, pitch_rad: float, yaw_rad: float) -> tuple[float, ...]:
    """Z-Y-X, FRD to NED, written out here so that it is not the shim's own."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def _attitude_step(vehicle: str, axis: str, step_deg: float) -> tuple[Samples, Samples]:
    """Times since the first setpoint of the step was sent (s), and the angle over the step."""
    client: ShimClient = airborne(vehicle, seed=_SEED)
    client.set_interval(_ATTITUDE, 4000)
    client.run(0.1)
    yaw = client.last("ATTITUDE").yaw
    hover = client.simulation.vehicle.autopilot_parameters["MPC_THR_HOVER"]
    level = _quaternion(0.0, 0.0, yaw)
    stop = client.every(0.01, lambda: client.setpoint(level, hover))
    client.run(0.3)
    client.set_mode(OFFBOARD)
    client.run(2.0)
    assert client.simulation.autopilot.heartbeat.custom_mode == OFFBOARD
    stop()
    angle = math.radians(step_deg)
    tilted = _quaternion(*((angle, 0.0) if axis == "roll" else (0.0, angle)), yaw)
    client.forget()
    begin_s = client.time_s
    client.every(0.01, lambda: client.setpoint(tilted, hover))
    client.run(1.5)
    reported = client.received("ATTITUDE")
    times = np.array([time_s - begin_s for time_s, _ in reported])
    angles = np.array([getattr(message, axis) for _, message in reported])
    return times, (angles - angles[:10].mean()) / angle


def _crossing_s(times: Samples, response: Samples, level: float) -> float:
    return float(times[int(np.argmax(response > level))])


@pytest.mark.parametrize("axis", ["roll", "pitch"])
def test_the_attitude_step_of_sih_quadx_is_that_of_px4(axis: str) -> None:
    times, response = _attitude_step("sih_quadx", axis, 8.0)
    response = response / response[times > 1.1].mean()
    assert _crossing_s(times, response, 0.10) == pytest.approx(0.100, rel=0.15)
    assert _crossing_s(times, response, 0.50) == pytest.approx(0.220, rel=0.15)
    assert _crossing_s(times, response, 0.63) == pytest.approx(0.264, rel=0.15)
    assert 0.410 * 0.85 <= _crossing_s(times, response, 0.90) <= 0.455 * 1.15
    smooth = np.convolve(response, np.ones(15) / 15, mode="valid")
    assert smooth.max() < 1.03  # no overshoot beyond the estimator's wander


def _second_order(times: Samples, delay_s: float, omega: float, zeta: float) -> Samples:
    t = np.maximum(times - delay_s, 0.0)
    damped = omega * np.sqrt(1.0 - zeta**2)
    decay = np.exp(-zeta * omega * t)
    return 1.0 - decay * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t))


@pytest.mark.parametrize("axis", ["roll", "pitch"])
@pytest.mark.parametrize("step_deg", [5.0, 15.0])
def test_the_attitude_step_of_bebop2_is_second_order_with_12_rad_s_and_damping_08(
    axis: str, step_deg: float
) -> None:
    times, response = _attitude_step("bebop2", axis, step_deg)

    def residuals(p: Samples) -> Samples:
        return p[3] * _second_order(times, p[0], p[1], min(p[2], 0.999)) - response

    fit = least_squares(residuals, [0.05, 10.0, 0.7, 1.0], diff_step=1e-4)
    delay_s, omega, zeta, gain = fit.x
    assert omega == pytest.approx(12.0, rel=0.10)
    assert zeta == pytest.approx(0.8, abs=0.1)
    assert gain == pytest.approx(1.0, abs=0.03)
    # 15 + 15 ms of transport; motors, filters and the ticks add a little.
    assert 0.030 <= delay_s <= 0.050
    assert np.sqrt(np.mean(fit.fun**2)) < 0.015


def test_x500_answers_quickly_and_without_much_overshoot() -> None:
    times, response = _attitude_step("x500", "roll", 10.0)
    assert 0.08 <= _crossing_s(times, response, 0.63) <= 0.20
    assert response.max() < 1.08
    assert response[times > 1.0].mean() == pytest.approx(1.0, abs=0.04)
