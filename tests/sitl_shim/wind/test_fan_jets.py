"""The fan's jet by itself, and as it stands across the five test trajectories."""

import math

import numpy as np
import pytest

from sitl_shim.plant.rigid_body import make_drag_acceleration
from sitl_shim.plant.vehicle import load_vehicle
from sitl_shim.wind import load_scenario, make_wind
from sitl_shim.wind.jet import FanJet
from sitl_shim.wind.turbulence import FirstOrderNoise

CROSSING_TIMES_S = {1: 7.0, 2: 6.0, 3: 6.5, 4: 6.0, 5: 6.5}
DIRECTIONS = {
    1: (0.5, -0.86, 0.0),
    2: (1.0, 0.2, 0.0),
    3: (0.3, 1.0, 0.1),
    4: (1.0, 0.3, 0.0),
    5: (-0.3, 1.0, 0.0),
}
STEP_S = 0.01
TIMES_S = np.arange(0.0, 20.0, STEP_S)
HOVER_S = 4.0


def ramped(t):
    x = np.clip(t / 2.0, 0.0, 1.0)
    return 2.0 * (7 * x**5 - 14 * x**6 + 10 * x**7 - 2.5 * x**8) + np.maximum(t - 2.0, 0.0)


def path(number, t):
    """Positions (n, 3) of a test trajectory at times after its hover."""
    s = ramped(np.asarray(t, dtype=float))
    cos, sin = np.cos, np.sin
    if number == 1:
        x, y, z = -cos(0.67 * s), -0.6 * cos(0.67 * s), 1.2 - 0.25 * cos(0.67 * s)
    elif number == 2:
        x, y, z = cos(s), sin(s), 1.2 + 0.0 * s
    elif number == 3:
        tilt = math.radians(25.0)
        along = 1.2 * cos(1.1 * s)
        x, y, z = along * math.cos(tilt), 0.8 * sin(1.1 * s), 1.2 + along * math.sin(tilt)
    elif number == 4:
        x, y, z = 1.2 * sin(0.8 * s), 0.9 * sin(1.6 * s), 1.2 + 0.35 * sin(0.8 * s + 0.7)
    else:
        r = 1.2 * cos(1.65 * s)
        x, y, z = r * cos(0.55 * s), r * sin(0.55 * s), 1.2 + 0.4 * sin(1.1 * s)
    return np.stack([x, y, z], axis=-1)


def pushes(number, seed):
    """Size of the wind's acceleration (m/s2) on a bebop2 that flies the path exactly."""
    positions = path(number, TIMES_S)
    velocities = np.gradient(positions, STEP_S, axis=0)
    wind = make_wind(load_scenario(f"fan-{number}"), seed)
    drag = make_drag_acceleration(load_vehicle("bebop2"))
    level = (1.0, 0.0, 0.0, 0.0)
    sizes = []
    for t, position, velocity in zip(
        TIMES_S.tolist(), positions.tolist(), velocities.tolist(), strict=True
    ):
        air = wind.velocity_enu_m_s(HOVER_S + t, tuple(position))
        relative = tuple(v - a for v, a in zip(velocity, air, strict=True))
        sizes.append(math.dist(drag(level, relative), drag(level, tuple(velocity))))
    return np.array(sizes)


@pytest.mark.parametrize("number", range(1, 6))
def test_the_axis_crosses_the_path_where_and_as_it_should(number):
    (jet,) = load_scenario(f"fan-{number}").winds
    crossing = path(number, CROSSING_TIMES_S[number])
    assert jet.crossing_enu_m == pytest.approx(tuple(crossing), abs=1e-4)
    assert jet.direction_enu == DIRECTIONS[number]
    assert (jet.peak_m_s, jet.width_m, jet.turbulence) == (4.0, 0.4, 0.2)


@pytest.mark.parametrize("number", range(1, 6))
def test_the_fan_stands_clear_of_the_path(number):
    (jet,) = load_scenario(f"fan-{number}").winds
    direction = np.array(jet.direction_enu) / math.hypot(*jet.direction_enu)
    along = (path(number, TIMES_S) - jet.crossing_enu_m) @ direction
    assert along.min() > -jet.fan_distance_m + 0.3


@pytest.mark.parametrize("number", range(1, 6))
def test_the_push_on_the_path_peaks_between_1_and_16_m_s2(number):
    sizes = [pushes(number, seed) for seed in range(1, 6)]
    peaks = [size.max() for size in sizes]
    assert min(peaks) >= 1.0
    assert max(peaks) <= 1.6
    assert 0.12 <= np.mean(sizes) <= 0.30


def jet(seed=1, turbulence=0.0):
    return FanJet(
        crossing_enu_m=(1.0, 2.0, 1.5),
        direction_enu=(0.0, 3.0, 0.0),
        fan_distance_m=1.5,
        peak_m_s=4.0,
        width_m=0.4,
        turbulence=turbulence,
        correlation_time_s=0.1,
        generator=np.random.default_rng(seed),
    )


def test_the_profile_is_gaussian_across_and_constant_along():
    for along in (-1.4, 0.0, 3.0):
        for across in (0.0, 0.4, 0.8):
            above = jet().velocity_enu_m_s(0.0, (1.0, 2.0 + along, 1.5 + across))
            beside = jet().velocity_enu_m_s(0.0, (1.0 - across, 2.0 + along, 1.5))
            speed = 4.0 * math.exp(-0.5 * (across / 0.4) ** 2)
            assert above == pytest.approx((0.0, speed, 0.0))
            assert beside == pytest.approx((0.0, speed, 0.0))


def test_behind_the_fan_and_far_from_the_axis_the_air_is_still():
    wind = jet(turbulence=0.2)
    assert wind.velocity_enu_m_s(0.0, (1.0, 0.4, 1.5)) == (0.0, 0.0, 0.0)
    assert wind.velocity_enu_m_s(0.0, (5.0, 2.0, 1.5)) == (0.0, 0.0, 0.0)


def test_turbulence_is_a_fifth_of_the_local_mean_as_a_vector():
    wind = jet(seed=2, turbulence=0.2)
    for across, mean in ((0.0, 4.0), (0.4, 4.0 * math.exp(-0.5))):
        air = np.array(
            [
                jet_velocity
                for k in range(20_000)
                for jet_velocity in [
                    wind.velocity_enu_m_s((k + 20_000 * (across > 0)) * 0.02, (1 + across, 2, 1.5))
                ]
            ]
        )
        assert air.mean(axis=0) == pytest.approx([0.0, mean, 0.0], abs=0.02 * mean)
        spread = air.std(axis=0) / mean
        assert math.hypot(*spread) == pytest.approx(0.2, rel=0.05)
        assert spread == pytest.approx([0.2 / math.sqrt(3)] * 3, rel=0.08)
        assert np.abs(air - [0.0, mean, 0.0]).max() <= 2.5001 * 0.2 / math.sqrt(3) * mean


def test_turbulence_forgets_over_its_correlation_time():
    noise = FirstOrderNoise(0.1, np.random.default_rng(3))
    values = np.array([noise.at(k * 0.01) for k in range(60_000)])
    assert values.std(axis=0) == pytest.approx([1.0] * 3, rel=0.04)
    for lag in (5, 10, 20):
        kept = np.mean(values[:-lag] * values[lag:], axis=0)
        assert kept == pytest.approx([math.exp(-lag * 0.1)] * 3, abs=0.04)
    assert abs(np.mean(values[:, 0] * values[:, 1])) < 0.04


def test_turbulence_starts_at_its_full_size():
    start = [FirstOrderNoise(1.0, np.random.default_rng(seed)).at(0.0) for seed in range(1000)]
    assert np.std(start) == pytest.approx(1.0, rel=0.06)


def test_turbulence_is_the_same_for_a_seed_however_long_the_vehicle_was_elsewhere():
    stayed, returned = jet(turbulence=0.2), jet(turbulence=0.2)
    inside, outside = (1.0, 2.0, 1.5), (9.0, 2.0, 1.5)
    for k in range(500):
        stayed.velocity_enu_m_s(k * 0.004, inside)
        returned.velocity_enu_m_s(k * 0.004, outside)
    assert stayed.velocity_enu_m_s(2.0, inside) == returned.velocity_enu_m_s(2.0, inside)


def test_turbulence_does_not_go_back_in_time():
    noise = FirstOrderNoise(0.1, np.random.default_rng(1))
    noise.at(1.0)
    with pytest.raises(ValueError, match="cannot go back"):
        noise.at(0.9)
