"""The density of the unexplained acceleration: a size, whose interval is one of sizes."""

import math

import numpy as np
import pytest

from companion.config.models import VehicleConfig
from companion.config.resolve import find_config
from companion.config.validation import validate
from companion.config.yaml_source import read_yaml
from companion.identification.noise_fit import Density, densities
from companion.identification.scatter import Residual, VelocityScatter, likeliest
from companion.identification.vehicle_file import identified_vehicle, vehicle_yaml
from tests.companion.identification.identified_for_tests import identified

Z = Density(0.03, 0.1)


@pytest.fixture
def base_vehicle():
    return validate(VehicleConfig, read_yaml(find_config("vehicle", "bebop2")))


def test_no_interval_reaches_below_zero():
    for spread in (0.01, 0.4, 0.9, 1.0, 1.7):
        (*_, z) = densities([Z, Z, Density(0.0077, spread)])
        assert 0.0 <= z.low < z.value < z.high
        assert z.high == pytest.approx(0.0077 * math.exp(1.96 * spread))
        assert z.half_width_95 == pytest.approx(0.5 * (z.high - z.low))


def test_x_and_y_that_differ_by_chance_are_told_as_one():
    x, y, z = densities([Density(0.0005, 1.3), Density(0.0065, 0.43), Z])
    assert x == y
    assert 0.003 < x.value < 0.0065
    assert 0.0 < x.low < x.value < x.high < 0.0065 * math.exp(1.96 * 0.43)
    assert z.value == 0.03


def test_what_both_have_is_known_better_than_of_one():
    x, _, _ = densities([Density(0.03, 0.2), Density(0.03, 0.2), Z])
    assert x.value == pytest.approx(0.03)
    assert x.high == pytest.approx(0.03 * math.exp(1.96 * 0.2 / math.sqrt(2.0)))


def test_two_axes_without_any_leave_an_upper_bound():
    x, y, _ = densities([Density(0.0005, 1.3), Density(0.0004, 1.2), Z])
    assert x == y
    assert x.low == 0.0
    assert x.high == pytest.approx(0.0004 * math.exp(1.96 * 1.2))


def test_x_and_y_that_differ_stay_apart():
    x, y, _ = densities([Density(0.305, 0.034), Density(0.535, 0.032), Z])
    assert (x.value, y.value) == (0.305, 0.535)


def test_white_noise_alone_gives_a_bound_that_a_walk_would_have_to_keep():
    rng = np.random.default_rng(5)
    times = np.arange(0.0, 6.0, 0.02)
    white = Residual(times, 0.015 * rng.standard_normal(len(times)), np.ones((len(times), 1)))
    flat = likeliest(VelocityScatter, [white])
    bound = flat.scatter.density * math.exp(flat.half_widths[1] / flat.scatter.density)
    walk = VelocityScatter(0.015, 0.05, 1.0)
    moved = np.linalg.cholesky(walk.covariance(times)) @ rng.standard_normal(len(times))
    seen = likeliest(VelocityScatter, [Residual(times, moved, np.ones((len(times), 1)))])
    assert flat.scatter.density < 0.005 < bound < 0.03
    assert seen.half_widths[1] < 0.8 * seen.scatter.density


def test_the_vehicle_s_file_tells_the_ends(base_vehicle):
    noise = identified().noise_estimates
    found = densities([Density(0.0005, 1.3), Density(0.0004, 1.2), Z])
    noise = type(noise)(noise.position_m, noise.velocity_m_s, tuple(found), noise.tilt_rad)
    told = identified(noise_estimates=noise)
    text = vehicle_yaml(told, identified_vehicle(told, base_vehicle, "test"))
    assert "at most 0.0042, at most 0.0042, 0.025 to 0.036" in text
    assert "hold 95 of 100 flights" not in text
