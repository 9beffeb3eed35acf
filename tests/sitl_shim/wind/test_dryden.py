import math

import numpy as np
import pytest

from sitl_shim.wind import load_scenario, make_wind
from sitl_shim.wind.dryden import DrydenGusts, low_altitude_scales

HERE = (0.0, 0.0, 1.2)
STEP_S = 0.02


def gusts(seed=1, speed=3.5, direction=(1.0, 0.0, 0.0), intensity=1.0):
    return DrydenGusts(
        intensity_m_s=intensity,
        altitude_m=3.048,
        passing_speed_m_s=speed,
        direction_enu=direction,
        generator=np.random.default_rng(seed),
    )


@pytest.fixture(scope="module")
def record():
    """Ten short records one after another of a fast wind: some 5,000 correlation times."""
    wind = gusts(seed=5, speed=60.0)
    return np.array([wind.velocity_enu_m_s(k * STEP_S, HERE) for k in range(60_000)])


def correlation(values, lag):
    values = values - values.mean()
    return float(np.mean(values[:-lag] * values[lag:]) / np.mean(values**2))


def test_scale_lengths_are_the_specifications():
    horizontal, vertical, ratio = low_altitude_scales(304.8)  # 1000 ft: all become equal
    assert horizontal == pytest.approx(304.8)
    assert vertical == pytest.approx(304.8)
    assert ratio == pytest.approx(1.0)
    # 20 ft: L_u = 20 / (0.177 + 0.01646)^1.2 ft
    horizontal, vertical, ratio = low_altitude_scales(20 * 0.3048)
    assert horizontal == pytest.approx(20.0 / 0.19346**1.2 * 0.3048)
    assert vertical == pytest.approx(20.0 * 0.3048)
    assert ratio == pytest.approx(0.19346**0.4)


def test_below_ten_feet_the_scales_of_ten_feet_hold():
    assert low_altitude_scales(1.2) == low_altitude_scales(3.048)


def test_the_variances_are_what_was_asked_for(record):
    _, _, ratio = low_altitude_scales(3.048)
    deviations = record.std(axis=0)
    assert deviations == pytest.approx([1.0, 1.0, ratio], rel=0.05)
    assert np.abs(record.mean(axis=0)).max() < 0.1


def test_the_longitudinal_gust_forgets_exponentially_over_its_scale_length(record):
    horizontal, _, _ = low_altitude_scales(3.048)
    for lag in (5, 15, 30):
        travelled = 60.0 * lag * STEP_S / horizontal
        assert correlation(record[:, 0], lag) == pytest.approx(math.exp(-travelled), abs=0.05)


def test_the_lateral_gust_forgets_as_its_second_order_filter_does(record):
    """Autocorrelation of the lateral Dryden spectrum: exp(-x) (1 - x/2), x in scale lengths."""
    horizontal, _, _ = low_altitude_scales(3.048)
    for lag in (5, 15, 30, 45):
        x = 60.0 * lag * STEP_S / horizontal
        expected = math.exp(-x) * (1.0 - 0.5 * x)
        assert correlation(record[:, 1], lag) == pytest.approx(expected, abs=0.05)


def test_the_vertical_gust_has_the_shorter_scale_length():
    wind = gusts(seed=3, speed=10.0)
    _, vertical, _ = low_altitude_scales(3.048)
    values = np.array([wind.velocity_enu_m_s(k * STEP_S, HERE)[2] for k in range(40_000)])
    for lag in (5, 10, 25):
        x = 10.0 * lag * STEP_S / vertical
        assert correlation(values, lag) == pytest.approx(math.exp(-x) * (1 - 0.5 * x), abs=0.05)


def test_it_starts_in_its_stationary_state():
    start = np.array([gusts(seed).velocity_enu_m_s(0.0, HERE) for seed in range(1500)])
    _, _, ratio = low_altitude_scales(3.048)
    assert start.std(axis=0) == pytest.approx([1.0, 1.0, ratio], rel=0.06)


def test_the_gusts_follow_the_wind_round():
    along, across = gusts(), gusts(direction=(0.0, 2.0, 0.0))
    for k in range(50):
        u, v, w = along.velocity_enu_m_s(k * STEP_S, HERE)
        assert across.velocity_enu_m_s(k * STEP_S, HERE) == pytest.approx((-v, u, w))


def test_a_gust_depends_on_seed_and_time_and_not_on_who_asks_how_often():
    coarse, fine = gusts(seed=4), gusts(seed=4)
    for k in range(400):
        fine.velocity_enu_m_s(k * 0.0013, HERE)
    assert coarse.velocity_enu_m_s(0.52, HERE) == fine.velocity_enu_m_s(0.52, HERE)
    assert gusts(seed=5).velocity_enu_m_s(0.52, HERE) != coarse.velocity_enu_m_s(0.52, HERE)


def test_between_two_moments_close_by_the_wind_changes_little():
    wind = gusts()
    before = wind.velocity_enu_m_s(1.0, HERE)
    after = wind.velocity_enu_m_s(1.0 + 1e-6, HERE)
    assert after == pytest.approx(before, abs=1e-3)
    assert after != before


def test_time_does_not_go_back():
    wind = gusts()
    wind.velocity_enu_m_s(1.0, HERE)
    with pytest.raises(ValueError, match="cannot go back"):
        wind.velocity_enu_m_s(0.5, HERE)


def test_the_scenario_blows_at_35_m_s_with_gusts_of_1_m_s():
    start = np.array(
        [make_wind(load_scenario("gusts"), seed).velocity_enu_m_s(0.0, HERE) for seed in range(300)]
    )
    mean = start.mean(axis=0)
    assert math.hypot(*mean) == pytest.approx(3.5, abs=0.15)
    assert start[:, :2].std(axis=0) == pytest.approx([1.0, 1.0], rel=0.12)


def test_two_gusts_of_one_scenario_are_not_the_same_gust(tmp_path):
    one = """
  - kind: dryden
    intensity_m_s: 1.0
    altitude_m: 10.0
    passing_speed_m_s: 3.0
    direction_enu: [1.0, 0.0, 0.0]"""
    single, double = tmp_path / "single.yaml", tmp_path / "double.yaml"
    single.write_text(f"name: single\nwinds:{one}\n")
    double.write_text(f"name: double\nwinds:{one}{one}\n")
    alone = make_wind(load_scenario(single), 1).velocity_enu_m_s(0.0, HERE)
    both = make_wind(load_scenario(double), 1).velocity_enu_m_s(0.0, HERE)
    assert both != pytest.approx([2.0 * value for value in alone])
