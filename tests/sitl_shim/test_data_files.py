import shutil
from pathlib import Path

import pytest

from sitl_shim.data_file import DataFileError
from sitl_shim.plant.vehicle import load_vehicle
from sitl_shim.sensors.profile import load_profile
from sitl_shim.simulation import ShimOptions, Simulation
from sitl_shim.wind import load_scenario

BEBOP = Path(__file__).parents[2] / "sitl_shim" / "plant" / "vehicles" / "bebop2.yaml"


@pytest.fixture
def changed(tmp_path):
    """A copy of the bebop2 with one piece of text replaced."""

    def change(old, new):
        text = BEBOP.read_text()
        assert old in text
        path = tmp_path / "mine.yaml"
        path.write_text(text.replace(old, new, 1))
        return path

    return change


def line_of(path, text):
    return next(n for n, line in enumerate(path.read_text().splitlines(), 1) if text in line)


def test_a_copied_file_loads_as_the_named_vehicle(tmp_path):
    copy = tmp_path / "copy.yaml"
    shutil.copy(BEBOP, copy)
    assert load_vehicle(copy) == load_vehicle(str(copy)) == load_vehicle("bebop2")


def test_an_unknown_key_is_told_with_file_line_and_the_key_that_was_meant(changed):
    path = changed("friction:", "fricton:")
    with pytest.raises(DataFileError) as caught:
        load_vehicle(path)
    message = str(caught.value)
    assert str(path) in message
    assert (
        f"line {line_of(path, 'fricton')}: the key 'ground_contact.fricton' is unknown" in message
    )
    assert "did you mean 'friction'?" in message


def test_a_missing_key_is_told_with_what_to_do(changed):
    with pytest.raises(DataFileError, match=r"the key 'propulsion\.thrust_shape' is missing; add"):
        load_vehicle(changed("  thrust_shape: 0.0\n", ""))


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("mass_kg: 0.5", "mass_kg: -0.5", "mass_kg"),
        ("mass_kg: 0.5", "mass_kg: heavy", "mass_kg"),
        ("mass_kg: 0.5", "mass_kg: '0.5'", "mass_kg"),
        ("mass_kg: 0.5", "mass_kg: .nan", "mass_kg"),
        ("spin: ccw", "spin: left", "rotors.0.spin"),
        ("[0.0033, 0.0039, 0.0066]", "[0.0033, 0.0039]", "inertia_kg_m2"),
        ("empty_voltage_v: 10.5", "empty_voltage_v: 13.0", "battery"),
    ],
)
def test_a_value_that_cannot_be_is_told_with_its_line_and_key(changed, old, new, key):
    path = changed(old, new)
    with pytest.raises(DataFileError) as caught:
        load_vehicle(path)
    message = str(caught.value)
    assert str(path) in message
    assert f"'{key}" in message
    assert "line " in message


def test_the_line_told_is_the_line_of_the_value(changed):
    path = changed("foot_depth_m: 0.05", "foot_depth_m: 0")
    with pytest.raises(DataFileError, match=f"line {line_of(path, 'foot_depth_m')}:"):
        load_vehicle(path)


def test_a_vehicle_that_cannot_lift_itself_is_refused(changed):
    with pytest.raises(DataFileError, match="cannot lift"):
        load_vehicle(changed("max_thrust_n: 2.5", "max_thrust_n: 1.2"))


def test_a_key_given_twice_is_refused(changed):
    path = changed("mass_kg: 0.5", "mass_kg: 0.5\nmass_kg: 0.6")
    with pytest.raises(DataFileError, match="'mass_kg' is there already"):
        load_vehicle(path)


@pytest.mark.parametrize("text", ["", "- 1\n- 2\n", "just words"])
def test_a_file_that_is_no_mapping_is_told_the_keys(tmp_path, text):
    path = tmp_path / "odd.yaml"
    path.write_text(text)
    with pytest.raises(DataFileError, match="must be a mapping"):
        load_scenario(path)


def test_broken_yaml_and_unsafe_yaml_are_errors_with_the_file(tmp_path):
    for text in ("name: [", "name: !!python/object/apply:os.getcwd []"):
        path = tmp_path / "broken.yaml"
        path.write_text(text)
        with pytest.raises(DataFileError, match=r"broken\.yaml"):
            load_profile(path)


@pytest.mark.parametrize("text", ["name: &a [*a]", "&a {name: *a}", "name: " + "[" * 5000])
def test_yaml_that_nests_without_end_is_told_with_the_file(tmp_path, text):
    path = tmp_path / "snake.yaml"
    path.write_text(text)
    with pytest.raises(DataFileError, match=r"snake\.yaml: nests too deeply"):
        load_scenario(path)


def test_a_date_that_there_is_not_is_told_with_the_file(tmp_path):
    path = tmp_path / "dated.yaml"
    path.write_text("name: 2020-13-45\n")
    with pytest.raises(DataFileError, match=r"dated\.yaml: is not valid YAML: month"):
        load_scenario(path)


def test_a_file_that_is_not_there_or_not_text_is_told(tmp_path):
    with pytest.raises(DataFileError, match="cannot be read"):
        load_vehicle(tmp_path / "absent.yaml")
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataFileError, match="cannot be read"):
        load_vehicle(binary)


def test_an_unknown_name_is_answered_with_the_known_ones():
    with pytest.raises(DataFileError, match="bebop2, sih_quadx, x500"):
        load_vehicle("bebop3")
    with pytest.raises(DataFileError, match="calm, fan-1"):
        load_scenario("storm")
    with pytest.raises(DataFileError, match="gnss, mocap"):
        load_profile("radar")


def test_a_wind_of_unknown_kind_is_told(tmp_path):
    path = tmp_path / "odd.yaml"
    path.write_text("name: odd\nwinds:\n  - kind: tornado\n    speed: 3.0\n")
    with pytest.raises(DataFileError, match=r"line 3: 'winds\.0'.*tornado"):
        load_scenario(path)


def test_a_jet_without_direction_is_refused(tmp_path):
    path = tmp_path / "jet.yaml"
    fan = Path(__file__).parents[2] / "configs" / "scenarios" / "fan-4.yaml"
    path.write_text(fan.read_text().replace("[1.0, 0.3, 0.0]", "[0.0, 0.0, 0.0]"))
    with pytest.raises(DataFileError, match="direction may not be zero"):
        load_scenario(path)


@pytest.mark.parametrize(
    ("payload", "words"),
    [
        ("[{at_s: 2.0, mass_kg: 0.1}, {at_s: 1.0, mass_kg: 0.0}]", ["'payload'", "must rise"]),
        ("[{at_s: 2.0, mass_kg: 0.1}, {at_s: 2.0, mass_kg: 0.0}]", ["'payload'", "must rise"]),
        ("[{at_s: -1.0, mass_kg: 0.1}]", ["'payload.0.at_s'", "line 3"]),
        ("[{at_s: 1.0, mass_kg: .inf}]", ["'payload.0.mass_kg'", "line 3"]),
        ("[{at_s: .nan, mass_kg: 0.1}]", ["'payload.0.at_s'", "line 3"]),
        ("[{at_s: 1.0, mass: 0.1}]", ["'payload.0.mass'", "did you mean 'mass_kg'?"]),
        ("[{at_s: 1.0}]", ["'payload.0'", "either mass_kg or mass_share", "line 3"]),
        ("[{at_s: 1.0, mass_kg: 0.1, mass_share: 0.1}]", ["either mass_kg or mass_share"]),
        ("[{at_s: 1.0, since: take-off, mass_kg: 0.1}]", ["'payload.0.since'", "setpoints"]),
        ("[{at_s: 1, since: setpoints, mass_kg: 1}, {at_s: 2, mass_kg: 0}]", ["comes before"]),
        ("0.1", ["'payload'"]),
    ],
)
def test_a_payload_that_cannot_be_is_told_with_its_place(tmp_path, payload, words):
    path = tmp_path / "load.yaml"
    path.write_text(f"name: load\nwinds: []\npayload: {payload}\n")
    with pytest.raises(DataFileError) as caught:
        load_scenario(path)
    for word in (str(path), *words):
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("motors", "words"),
    [
        ("[{at_s: 1.0, rotor: 5, thrust_factor: 0.9}]", ["'motors.0.rotor'", "line 3"]),
        ("[{at_s: 1.0, rotor: 1, thrust_factor: 1.1}]", ["'motors.0.thrust_factor'", "line 3"]),
        ("[{at_s: 1.0, rotor: 1}]", ["'motors.0.thrust_factor'", "is missing"]),
        (
            "[{at_s: 2.0, rotor: 1, thrust_factor: 0.9}, {at_s: 1.0, rotor: 2, thrust_factor: 0}]",
            ["'motors'", "must rise"],
        ),
    ],
)
def test_a_motor_that_cannot_be_is_told_with_its_place(tmp_path, motors, words):
    path = tmp_path / "weak.yaml"
    path.write_text(f"name: weak\nwinds: []\nmotors: {motors}\n")
    with pytest.raises(DataFileError) as caught:
        load_scenario(path)
    for word in (str(path), *words):
        assert word in str(caught.value)


def test_two_motors_may_weaken_at_once(tmp_path):
    path = tmp_path / "weak.yaml"
    both = "{at_s: 1.0, rotor: 1, thrust_factor: 0.9}, {at_s: 1.0, rotor: 2, thrust_factor: 0.0}"
    path.write_text(f"name: weak\nwinds: []\nmotors: [{both}]\n")
    assert [motor.rotor for motor in load_scenario(path).motors] == [1, 2]


@pytest.mark.parametrize("mass_kg", [-0.5, -0.46, -1.5])
def test_a_payload_that_leaves_no_vehicle_is_told_with_file_and_key(tmp_path, mass_kg):
    path = tmp_path / "load.yaml"
    path.write_text(
        "name: load\nwinds: []\n"
        f"payload: [{{at_s: 1.0, mass_kg: -0.2}}, {{at_s: 2.0, mass_kg: {mass_kg}}}]\n"
    )
    with pytest.raises(DataFileError) as caught:
        Simulation(ShimOptions(scenario=path))
    assert f"{path}: 'payload.1.mass_kg' cannot be {mass_kg:g}: bebop2 with it" in str(caught.value)
    Simulation(ShimOptions(scenario=path, vehicle="x500"))  # which weighs 2 kg
