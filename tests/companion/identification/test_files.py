"""What an identification writes can be read by people, and again by the companion."""

import dataclasses
import json

import pytest

from companion.config.models import ControllerConfig, VehicleConfig
from companion.config.resolve import find_config, load_flight
from companion.config.validation import validate
from companion.config.yaml_source import ConfigError, read_yaml
from companion.identification import files
from companion.identification.estimates import Estimate
from companion.identification.figure import draw_identification
from companion.identification.recommend import recommend
from companion.identification.recommend_search import NothingHoldsError
from companion.identification.record import identification_record
from companion.identification.vehicle_file import (
    check_name,
    identified_vehicle,
    vehicle_yaml,
    write_vehicle,
)
from tests.companion.identification.identified_for_tests import identified, response

LONG = "companion identify, in a hall with a great many words about its light and air; " * 3


@pytest.fixture
def base():
    return validate(VehicleConfig, read_yaml(find_config("vehicle", "bebop2")))


@pytest.fixture(scope="module")
def quick_recommendation():
    stated = validate(VehicleConfig, read_yaml(find_config("vehicle", "bebop2")))
    return recommend(stated, climb_rate_field=False, generations=3)


def test_a_vehicle_s_file_is_read_back_as_it_was_written(tmp_path, base):
    path = tmp_path / "vehicle.yaml"
    written = write_vehicle(identified(), base, path, LONG.strip())
    read = validate(VehicleConfig, read_yaml(path))
    assert read.model_dump() == written.model_dump()
    assert read.name == "bebop2"
    assert max(len(line) for line in path.read_text(encoding="utf-8").splitlines()) <= 110


@pytest.mark.parametrize(
    "name", ["my: quad #2", "1.5", "null", "- x", '"q', "it's", "[a", "Größe 😀", "%x", "a\\b"]
)
def test_any_name_is_read_back_as_it_was_given(tmp_path, base, name):
    check_name(name)
    path = tmp_path / "vehicle.yaml"
    named = base.model_copy(update={"name": name})
    write_vehicle(identified(), named, path, f"the dynamics of {name}")
    assert validate(VehicleConfig, read_yaml(path)).name == name


@pytest.mark.parametrize("name", ["", "  ", "two\nlines", "a\rb", "bell\a", "\ud83d"])
def test_a_name_that_no_file_can_bear_is_refused(name):
    with pytest.raises(ConfigError, match="name"):
        check_name(name)


def test_the_vehicle_s_own_delay_is_what_the_loop_s_leaves(base):
    vehicle = identified_vehicle(identified(), base, "test")
    dynamics = vehicle.dynamics
    assert dynamics.attitude.natural_frequency_rad_s == pytest.approx(12.0)
    assert dynamics.attitude.delay_s == pytest.approx(0.040 - 0.030)
    assert dynamics.climb.delay_s == pytest.approx(0.032 - 0.030)
    early = identified_vehicle(identified(climb=response(9.9, 1.0, 0.020)), base, "test")
    assert early.dynamics.climb.delay_s == 0.0


def test_a_drag_that_was_found_negative_is_none(base):
    assert identified_vehicle(identified(), base, "test").dynamics.quadratic_drag_1_m == 0.0


def test_intervals_stand_beside_the_figures(base):
    found = identified()
    text = vehicle_yaml(found, identified_vehicle(found, base, "test"))
    assert "hover_thrust: 0.51  # 0.51 ± 0.002" in text
    assert "# roll: 12.2 ± 0.3 rad/s, ζ 0.82 ± 0.04, 41.0 ± 3.0 ms in all" in text
    assert "linear_drag_1_s: 0.16  # 0.16 ± 0.02 1/s" in text


def test_what_a_climb_rate_field_hides_is_taken_from_the_base(base):
    found = identified(lift=None, hover_thrust=None)
    vehicle = identified_vehicle(found, base, "test")
    assert vehicle.dynamics.lift is None
    assert vehicle.hover_thrust == base.hover_thrust
    assert "not found" in vehicle_yaml(found, vehicle)


def derived(base, found=None):
    return files.derive(found or identified(), base, source="test", climb_rate_field=False)


def test_all_files_can_be_flown_with(tmp_path, base, quick_recommendation, monkeypatch):
    monkeypatch.setattr(files, "recommend", lambda *_, **__: quick_recommendation)
    found = derived(base)
    assert found.note == ""
    assert list(tmp_path.iterdir()) == []
    paths = files.write_files(found, tmp_path)
    assert [path.name for path in paths] == [
        "vehicle.yaml",
        "identify.png",
        "mpc-l1.yaml",
        "mpc-l1-plus.yaml",
    ]
    assert sorted(tmp_path.iterdir()) == sorted(paths)
    vehicle = str(tmp_path / "vehicle.yaml")
    for name in ("mpc-l1.yaml", "mpc-l1-plus.yaml"):
        controller = str(tmp_path / name)
        flight = load_flight(None, {"controller": controller, "vehicle": vehicle}, {})
        assert flight.vehicle == found.vehicle
    read = validate(ControllerConfig, read_yaml(tmp_path / "mpc-l1.yaml"))
    assert read == quick_recommendation.controller
    plus = validate(ControllerConfig, read_yaml(tmp_path / "mpc-l1-plus.yaml"))
    assert plus == found.plus
    assert plus.fallback == "mpc-l1.yaml"


@pytest.fixture
def nothing_holds(monkeypatch):
    def nothing(*_, **__):
        raise NothingHoldsError("too slow")

    monkeypatch.setattr(files, "recommend", nothing)


def test_without_gains_that_hold_there_is_no_file_of_them(tmp_path, base, nothing_holds):
    found = derived(base)
    files.write_files(found, tmp_path)
    assert found.recommendation is None
    assert found.note == "too slow"
    assert not (tmp_path / "mpc-l1.yaml").exists()
    assert found.plus.fallback == "none"


def test_gains_of_an_identification_before_do_not_stay(tmp_path, base, nothing_holds):
    (tmp_path / "mpc-l1.yaml").write_text("of another vehicle")
    files.write_files(derived(base), tmp_path)
    assert not (tmp_path / "mpc-l1.yaml").exists()


def test_old_gains_go_before_a_new_vehicle_is_written(tmp_path, base, nothing_holds, monkeypatch):
    def full_disk(*_, **__):
        assert not (tmp_path / "mpc-l1.yaml").exists()
        raise OSError("no space left")

    (tmp_path / "mpc-l1.yaml").write_text("of another vehicle")
    (tmp_path / "vehicle.yaml").write_text("another vehicle")
    monkeypatch.setattr(files, "write_vehicle", full_disk)
    with pytest.raises(OSError, match="no space left"):
        files.write_files(derived(base), tmp_path)


def test_a_file_that_could_not_be_written_whole_is_not_there(tmp_path, base, monkeypatch):
    def half(self, text, encoding):
        with self.open("w", encoding=encoding) as file:
            file.write(text[:20])
        raise OSError("no space left")

    monkeypatch.setattr(type(tmp_path), "write_text", half)
    with pytest.raises(OSError, match="no space left"):
        write_vehicle(identified(), base, tmp_path / "vehicle.yaml", "test")
    assert list(tmp_path.iterdir()) == []


def test_the_record_is_plain_json(quick_recommendation):
    record = identification_record(identified(), quick_recommendation)
    again = json.loads(json.dumps(record, allow_nan=False))
    assert again["roll"]["damping"] == {"value": 0.82, "half_width_95": 0.04, "unit": "1"}
    assert again["lift"]["gain"]["value"] == 1.0
    assert again["residual_rms"]["roll"] == pytest.approx(0.004, rel=0.1)
    assert again["mpc_l1"]["gains"]["framework"] == "mpc-l1"
    assert identification_record(identified(lift=None), None)["lift"] is None


def test_the_figure_has_a_panel_for_each_axis_and_bears_few_of_them(tmp_path):
    path = tmp_path / "identify.png"
    draw_identification(identified(), "bebop2", path)
    full = path.stat().st_size
    assert path.read_bytes().startswith(b"\x89PNG")
    few = dataclasses.replace(identified(), curves=identified().curves[:1])
    draw_identification(few, "bebop2", path)
    assert 5_000 < path.stat().st_size < full


def test_a_half_width_of_the_mean_of_roll_and_pitch_is_smaller(base):
    from companion.identification.vehicle_file import _mean

    mean = _mean(Estimate(1.0, 0.3, "1"), Estimate(2.0, 0.4, "1"))
    assert mean.value == 1.5
    assert mean.half_width_95 == pytest.approx(0.25)
