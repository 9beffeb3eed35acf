"""The dynamics that the vehicles' files state are those that can be measured over MAVLink."""

import pytest

from companion.config.models import VehicleConfig
from companion.config.resolve import find_config
from companion.config.validation import validate
from companion.config.yaml_source import read_yaml
from tools.measure_responses import measure


@pytest.mark.parametrize("name", ["bebop2", "x500"])
def test_steps_flown_in_the_shim_give_the_stated_dynamics(name):
    stated = validate(VehicleConfig, read_yaml(find_config("vehicle", name))).dynamics
    responses, (linear, quadratic), link_s = measure(name, seed=7, sensors="exact")
    assert link_s == pytest.approx(stated.loop_delay_s, abs=0.003)
    for axis, own in (
        ("roll", stated.attitude),
        ("pitch", stated.attitude),
        ("climb", stated.climb),
    ):
        found = responses[axis]
        assert found.natural_frequency_rad_s == pytest.approx(own.natural_frequency_rad_s, rel=0.03)
        assert found.damping == pytest.approx(own.damping, rel=0.03)
        dead_time_s = stated.loop_delay_s + own.delay_s
        assert found.dead_time_s == pytest.approx(dead_time_s, abs=0.003)
        assert found.gain == pytest.approx(1.0, abs=0.05)
    assert linear == pytest.approx(stated.linear_drag_1_s, abs=0.01)
    assert quadratic == pytest.approx(stated.quadratic_drag_1_m, abs=0.002)
