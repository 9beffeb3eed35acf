"""What makes figures on `bebop2` comparable, read off over MAVLink alone."""

import math
import statistics

import numpy as np
import pytest

from tests.sitl_shim.mavlink.shim_client import OFFBOARD, ShimClient, airborne

_EAST = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
_ODOMETRY, _ATTITUDE_TARGET = 331, 83
_DELAY_S = 0.015
_TICK_S = 0.004


def _in_offboard(seed: int = 1) -> ShimClient:
    client = airborne("bebop2", seed=seed)
    client.set_interval(_ODOMETRY, 10_000)
    stop = client.start_stream(_EAST, 0.49, hz=100.0)
    client.run(0.3)
    client.set_mode(OFFBOARD)
    client.run(0.3)
    stop()
    assert client.simulation.autopilot.heartbeat.custom_mode == OFFBOARD
    return client


def test_telemetry_arrives_15_ms_late() -> None:
    client = airborne("bebop2")
    for time_s, message in client.received("ODOMETRY"):
        assert time_s - message.time_usec / 1e6 == pytest.approx(_DELAY_S, abs=1e-6)


def _echoed(client: ShimClient, thrust: float) -> bool:
    return any(m.thrust == pytest.approx(thrust) for m in client.messages("ATTITUDE_TARGET"))


def test_setpoints_act_15_ms_after_they_were_sent() -> None:
    client = _in_offboard()
    client.set_interval(_ATTITUDE_TARGET, 8_000)
    client.run(0.2)
    delays = []
    for index in range(20):
        thrust = 0.45 + 0.002 * index
        client.run(0.03 + 0.004 * (index % 3))
        client.forget()
        sent_s = client.time_s
        client.setpoint(_EAST, thrust)
        client.wait_for(lambda asked=thrust: _echoed(client, asked), 0.2)
        delays.append(client.received("ATTITUDE_TARGET")[-1][0] - sent_s)
    # 15 + 15 ms, up to a tick to be seen, up to a period of the message to be told.
    assert min(delays) >= 2 * _DELAY_S
    assert max(delays) <= 2 * _DELAY_S + _TICK_S + 0.008 + 1e-6


def test_reported_noise_is_a_millimetre_and_15_mm_per_second() -> None:
    client = airborne("bebop2")
    client.set_interval(_ODOMETRY, 10_000)
    client.run(0.2)
    client.forget()
    client.run(10.0)
    truth = {m.time_usec: m for m in client.messages("ODOMETRY", component=240)}
    reported = client.messages("ODOMETRY")
    assert len(reported) > 950
    for field, deviation in [("x", 1e-3), ("y", 1e-3), ("z", 1e-3)] + [
        (name, 1.5e-2) for name in ("vx", "vy", "vz")
    ]:
        errors = [getattr(m, field) - getattr(truth[m.time_usec], field) for m in reported]
        assert statistics.pstdev(errors) == pytest.approx(deviation, rel=0.1)
        assert abs(statistics.fmean(errors)) < 0.2 * deviation


def test_drag_per_mass_is_015_v_plus_002_v_squared() -> None:
    client = _in_offboard()
    half = math.radians(-15.0) / 2.0
    # Nose down, facing east; thrust for a level flight at that tilt.
    c, s = math.cos(half) * math.sqrt(0.5), math.sin(half) * math.sqrt(0.5)
    forward = (c, -s, s, c)
    stop = client.every(0.01, lambda: client.setpoint(forward, 0.49 / math.cos(2 * half)))
    client.run(4.0)
    stop()
    client.every(0.01, lambda: client.setpoint(_EAST, 0.49))
    client.run(0.6)
    client.forget()
    client.run(5.0)
    truth = client.messages("ODOMETRY", component=240)
    times = np.array([m.time_usec for m in truth]) / 1e6
    speed = np.array([m.vy for m in truth])  # NED: y is east
    thrust_tilt = np.array([2.0 * (m.q[2] * m.q[3] - m.q[0] * m.q[1]) for m in truth])
    # Deceleration without what the small remaining tilt contributes (thrust is about weight).
    slope = np.gradient(np.convolve(speed, np.ones(25) / 25, mode="same"), times)
    measured = -(slope + 9.80665 * thrust_tilt)[50:-50]
    mid = speed[50:-50]
    assert mid.max() > 4.5
    linear, quadratic = np.linalg.lstsq(np.stack([mid, mid**2], axis=1), measured, rcond=None)[0]
    assert linear == pytest.approx(0.15, abs=0.03)
    assert quadratic == pytest.approx(0.02, abs=0.005)


def _levelled(seed: int) -> tuple[float, float, float]:
    """Tilt of the truth (roll, pitch, degrees) and climb acceleration over g, at hover thrust."""
    client = _in_offboard(seed)
    client.every(0.01, lambda: client.setpoint(_EAST, 0.49))
    client.run(1.0)
    client.forget()
    client.run(1.0)
    truth = client.messages("ODOMETRY", component=240)
    half = len(truth) // 2
    rolls, pitches = [], []
    for m in truth[half:]:
        w, x, y, z = m.q
        rolls.append(math.degrees(math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))))
        pitches.append(math.degrees(math.asin(2 * (w * y - z * x))))
    span_s = (truth[-1].time_usec - truth[0].time_usec) / 1e6
    climb = -(truth[-1].vz - truth[0].vz) / span_s
    drag = 0.15 * -statistics.fmean(m.vz for m in truth)
    return statistics.fmean(rolls), statistics.fmean(pitches), (climb + drag) / 9.80665


def test_trim_and_thrust_spread_over_the_seeds_and_stay_within_their_limits() -> None:
    rolls, pitches, thrusts = zip(*(_levelled(seed) for seed in range(12)), strict=True)
    for tilt in (rolls, pitches):
        assert max(map(abs, tilt)) <= 0.8 + 0.1
        assert statistics.pstdev(tilt) > 0.2
    # At 0.49 the nominal vehicle does not quite hover (its hover is 0.4903).
    assert max(map(abs, thrusts)) <= 0.03 + 0.01
    assert statistics.pstdev(thrusts) > 0.008
