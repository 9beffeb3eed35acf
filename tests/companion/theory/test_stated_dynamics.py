"""The dynamics that the vehicles' files state are those that an identification finds."""

import pytest

from companion.config.models import VehicleConfig
from companion.config.resolve import find_config
from companion.config.validation import validate
from companion.config.yaml_source import read_yaml
from companion.experiments.identification_flight import fly_identification
from companion.identification.identify import identify
from companion.identification.recommend_plus import lag_s
from companion.identification.vehicle_file import identified_vehicle


@pytest.mark.parametrize("name", ["bebop2", "x500"])
def test_an_identification_flight_in_the_shim_finds_the_stated_dynamics(name):
    vehicle = validate(VehicleConfig, read_yaml(find_config("vehicle", name)))
    _, kept = fly_identification(name, autopilot="px4", seed=7, sensors="exact")
    found = identified_vehicle(identify(kept.recording()), vehicle, "test").dynamics
    stated = vehicle.dynamics
    own, seen = stated.attitude, found.attitude
    assert seen.natural_frequency_rad_s == pytest.approx(own.natural_frequency_rad_s, rel=0.03)
    assert seen.damping == pytest.approx(own.damping, rel=0.03)
    assert found.loop_delay_s == pytest.approx(stated.loop_delay_s, abs=0.003)
    dead_time_s = found.loop_delay_s + seen.delay_s
    assert dead_time_s == pytest.approx(stated.loop_delay_s + own.delay_s, abs=0.003)
    # The climb loop is far from a second order of its own: its lag is what counts.
    assert lag_s(found.climb, found.loop_delay_s) == pytest.approx(
        lag_s(stated.climb, stated.loop_delay_s), rel=0.15
    )
    assert found.tilt_gain == pytest.approx(1.0, abs=0.02)
    assert found.linear_drag_1_s == pytest.approx(stated.linear_drag_1_s, abs=0.03)
    assert found.quadratic_drag_1_m == pytest.approx(stated.quadratic_drag_1_m, abs=0.02)
