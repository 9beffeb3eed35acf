"""Configuration: what is wrong is told with its place and its remedy."""

from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.config.resolve import configs_folder, load_flight
from companion.config.validation import validate
from companion.config.yaml_source import ConfigError, parse_yaml, read_yaml


def fault(text, model=MissionConfig):
    with pytest.raises(ConfigError) as caught:
        validate(model, parse_yaml(text, "m.yaml"))
    return str(caught.value)


def load(text="", settings=None, overrides=None, folder=None):
    path = None
    if folder is not None:
        path = folder / "m.yaml"
        path.write_text(text, encoding="utf-8")
    return load_flight(path, overrides or {}, settings or {})


def load_fault(*args, **kwargs):
    with pytest.raises(ConfigError) as caught:
        load(*args, **kwargs)
    return str(caught.value)


# Files


def test_defaults_fly_the_figure_eight():
    config = load()
    assert (config.mission.trajectory, config.mission.controller) == (4, "mpc-l1")
    assert (config.vehicle.name, config.mission.wind) == ("bebop2", "calm")


def test_an_unknown_key_is_told_with_line_and_the_key_that_was_meant():
    assert fault("seed: 1\nhover: 2") == (
        "m.yaml, line 2: unknown key 'hover'. Did you mean 'hover_s'?"
    )


def test_an_unknown_key_below_another():
    text = fault("seed: 1\ngeofence:\n  high_m: [1, 1, 1]\n  lowest: [0, 0, 0]")
    assert text.startswith("m.yaml, line 4: unknown key 'geofence.lowest'. ")
    assert "low_m" in text


def test_an_unknown_key_like_no_other_is_told_with_all_that_there_are():
    assert "Known keys: approach_speed_m_s, autopilot, connect, " in fault("zzz: 1")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("hover_s: long", "line 1: 'hover_s': input should be a valid number (given: 'long')."),
        ('hover_s: "4"', "(given: '4'). Write the number without quotes."),
        ("hover_s: true", "'hover_s': input should be a valid number (given: True)"),
        ("seed: true", "'seed': input should be a valid integer (given: True)"),
        ("seed: 1.0", "'seed': input should be a valid integer (given: 1.0)"),
        ("vehicle: 500", "'vehicle': input should be a valid string (given: 500). Write it in"),
        ("geofence: 3", "line 1: 'geofence': keys with values are expected"),
        ("origin: {offset_enu_m: [0, 0]}", "line 1: 'origin.offset_enu_m' has too few entries."),
        ("origin: {offset_enu_m: [0, 0, 0, 0]}", "'origin.offset_enu_m': list should have at"),
        (
            "origin:\n  offset_enu_m:\n  - 0\n  - x\n  - 0",
            "line 4: 'origin.offset_enu_m.1': input should be a valid num",
        ),
        ("origin: {offset_enu_m: up}", "'origin.offset_enu_m': input should be a valid list"),
        ("faults: [a]", "'faults': a name, a YAML file, or keys such as link and vehicle are"),
        ("faults: {1: a}", "'faults': a name, a YAML file, or keys"),
        ("faults: no", "'faults': a name, a YAML file, or keys"),
        ("origin: {heading_deg: north}", "input should be 'vehicle'"),
    ],
)
def test_a_wrong_type_is_never_bent_into_a_right_one(text, says):
    assert says in fault(text)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("hover_s: -1", "'hover_s': input should be greater than or equal to 0 (given: -1)"),
        ("hover_s: 61", "'hover_s': input should be less than or equal to 60"),
        ("hover_s: .nan", "'hover_s': input should be a finite number"),
        ("timeouts: {land_s: .inf}", "'timeouts.land_s': input should be a finite number"),
        ("seed: -1", "'seed': input should be greater than or equal to 0"),
        ("seed: 4294967296", "'seed': input should be less than 4294967296"),
        ("trajectory: 6", "'trajectory': test trajectories are numbered 1 to 5; else give a"),
        ("trajectory: true", "'trajectory': test trajectories are numbered 1 to 5"),
        ("trajectory: 4.0", "'trajectory': test trajectories are numbered 1 to 5"),
        ("trajectory: ''", "'trajectory': test trajectories are numbered 1 to 5"),
        ("autopilot: inav", "'autopilot': input should be 'auto', 'px4' or 'ardupilot'"),
        ("geofence: {low_m: [0, 9, 0]}", "'geofence': low_m must be below high_m on each axis"),
    ],
)
def test_out_of_range(text, says):
    assert says in fault(text)


def test_every_fault_is_told_at_once():
    assert len(fault("hover: 1\nseed: -1\nstate_rate_hz: 1").splitlines()) == 3


def test_a_number_with_an_exponent_is_a_number():
    model = validate(MissionConfig, parse_yaml("timeouts: {ready_s: 1e2}", "m.yaml"))
    assert model.timeouts.ready_s == 100.0


def test_a_missing_key():
    text = fault("framework: mpc-l1\nsource: x\nl1:\n  m: [1, 1, 1]", ControllerConfig)
    assert "m.yaml, line 3: key 'l1.gamma' is missing. Add it." in text


FLAT = "k: [1, 1, 1], gamma: [1, 1, 1]"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "framework: pid-l1\nsource: x\nl1: {m: [1, 1, 1], omega: [1, 1, 1], %s}",
            "needs 'outer_pid'",
        ),
        (
            "framework: l1\nsource: x\nmpc: {}\nl1: {m: [1, 1, 1], omega: [1, 1, 1], %s}",
            "has no 'mpc'",
        ),
        ("framework: l1\nsource: x\nl1: {m: [1, 1, 1], %s}", "give omega or low_pass"),
    ],
)
def test_a_framework_reads_its_own_sections_and_no_others(text, says):
    assert says in fault(text % FLAT, ControllerConfig)


def test_keys_that_do_not_go_together():
    path = configs_folder() / "vehicles" / "bebop2.yaml"
    text = path.read_text(encoding="utf-8") + "\nmaximum_thrust: 0.4\n"
    assert fault(text, VehicleConfig) == (
        "m.yaml: minimum_thrust < hover_thrust < maximum_thrust must hold."
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("seed: 1\nwind: calm\nseed: 2", "m.yaml, line 3: key 'seed' stands there twice."),
        ("geofence:\n  low_m: [0,0,0]\n  low_m: [0,0,0]", "line 3: key 'low_m' stands there"),
        ("- 1\n- 2", "m.yaml: a mapping of keys to values is expected"),
        ("4", "a mapping of keys to values is expected"),
        ("1: 2", "a mapping of keys to values is expected"),
        ("wind: &w calm\nvehicle: *w", "YAML aliases (*name) are not taken; write the value"),
        ("seed: [", "m.yaml, line 1: not YAML: "),
        ("seed: 1\n\twind: x", "m.yaml, line 2: not YAML: "),
        ('seed: !!int ""', "m.yaml: not YAML: "),
        ("seed: !!python/object:os.system x", "m.yaml, line 1: not YAML: "),
        ("a: " + "[" * 5000, "m.yaml, line 1: nests deeper than 40 levels"),
    ],
)
def test_what_is_no_mapping_of_keys(text, says):
    assert says in fault(text)


def test_an_empty_file_leaves_the_defaults():
    assert validate(MissionConfig, parse_yaml("# nothing\n", "m.yaml")) == MissionConfig()


def test_files_that_can_not_be_read(tmp_path):
    for name, content, says in (
        ("latin.yaml", b"wind: \xe9", "can't be read: not UTF-8"),
        ("large.yaml", b"#" * 1_000_001, "larger than 1 MB"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ConfigError, match=says):
            read_yaml(tmp_path / name)
    with pytest.raises(ConfigError, match=r"none.yaml: can't be read: No such file"):
        read_yaml(tmp_path / "none.yaml")
    with pytest.raises(ConfigError, match="can't be read: Is a directory"):
        read_yaml(tmp_path)


_KEYS = ("seed", "hover_s", "geofence", "low_m", "<<", "*a", "&a ")
_MARKS = (": ", ":\n  ", "\n", "- ", "[", "]", "{", "}", ", ", "? ", ">", "%", "---\n", '"', "'")
_VALUES = ("1", "-2.5", ".nan", "true", "~", "!!int ", "!!bool ", "!!float ", "!!timestamp ")
_TAGS = ("!!binary ", "!!set ", "!!omap ", "!!null ", "!own ")
_PIECES = st.sampled_from((*_KEYS, *_MARKS, *_VALUES, *_TAGS))


@settings(deadline=None, derandomize=True, max_examples=300)
@given(st.lists(_PIECES | st.text(max_size=5), max_size=25).map("".join))
@example('seed: !!int ""')
@example("seed: !!bool x")
@example("seed: !!timestamp x")
@example("hover_s: " + "9" * 400)
@example("hover_s: 1" + ":59" * 400 + ".5")
@example("? [1]\n: 2")
def test_any_text_is_a_model_or_a_refusal(text):
    try:
        model = validate(MissionConfig, parse_yaml(text, "m.yaml"))
    except ConfigError:
        return
    assert isinstance(model, MissionConfig)


# --set and options


def test_set_reaches_mission_controller_and_vehicle():
    config = load(
        settings={
            "hover_s": "2",
            "geofence.high_m": "[3, 3, 5]",
            "mission.seed": "7",
            "controller.l1.gamma": "[100, 100, 200]",
            "controller.mpc.r_max_m_s2": "1e3",
            "vehicle.hover_thrust": "0.45",
        }
    )
    assert (config.mission.hover_s, config.mission.seed) == (2, 7)
    assert config.mission.geofence.high_m == (3, 3, 5)
    assert config.mission.geofence.low_m == (-3, -3, 0.2)
    assert config.controller.l1.gamma == (100, 100, 200)
    assert config.controller.mpc.r_max_m_s2 == 1000
    assert config.vehicle.hover_thrust == 0.45


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("hover", "2", "--set hover: unknown key 'hover'. Did you mean 'hover_s'?"),
        ("hover_s", "99", "--set hover_s: 'hover_s': input should be less than or equal to 60"),
        ("hover_s", "'2'", "--set hover_s: 'hover_s': input should be a valid number"),
        ("controller.l1.gama", "1", "--set controller.l1.gama: unknown key 'l1.gama'. Did you mea"),
        ("controller.l1.gamma", "[-1, 1, 1]", "--set controller.l1.gamma: 'l1.gamma.0': input"),
        ("controller.mpc.horizon", "1", "--set controller.mpc.horizon: 'mpc.horizon': input shou"),
        ("vehicle.tilt", "3", "--set vehicle.tilt: unknown key 'tilt'. Did you mean 'tilt_limit"),
        ("vehicle.hover_thrust", "x", "--set vehicle.hover_thrust: 'hover_thrust': input should"),
        ("vehicle.name.x", "1", "--set vehicle.name.x: 'name' has no keys below it"),
        ("vehicle.minimum_thrust", "0.9", "with --set vehicle.minimum_thrust: minimum_thrust < "),
        ("geofence.low_m", "[9, 0, 0]", "with --set geofence.low_m: 'geofence': low_m must be"),
        ("hover_s", "[", "--set hover_s=[: not YAML"),
        ("hover_s", "&a [*a]", "--set hover_s=&a [*a]: YAML aliases"),
        ("a..b", "1", "--set a..b: unknown key 'a'"),
        (
            "link.forward",
            "[{urls: x, zzz: 1}]",
            "unknown key 'link.forward.0.zzz'. Known keys: allow_commands, allow_setpoints, ",
        ),
        ("link.signing", "{zzz: 1}", "'link.signing.zzz'. Known keys: key_file, link_id."),
    ],
)
def test_a_wrong_set_is_told_by_its_key_and_not_by_a_line(key, value, says, tmp_path):
    text = load_fault("hover_s: 3\n", {key: value}, folder=tmp_path)
    assert says in text
    assert "line 1: '" not in text


def test_a_colon_without_a_space_is_told_with_the_known_keys(tmp_path):
    text = load_fault("seed: 3\n", {"link.forward": "[{url:'udpin://h:1'}]"}, folder=tmp_path)
    assert text == (
        "--set link.forward: unknown key \"url:'udpin://h:1'\" in 'link.forward.0': YAML wants a "
        "space after the colon. Write url: 'udpin://h:1'. Known keys: allow_commands, "
        "allow_setpoints, remote, truth, url."
    )
    text = load_fault("preflight: {fix:true}\n", folder=tmp_path)
    assert "line 1: unknown key 'fix:true' in 'preflight': YAML wants a space" in text
    assert "Write fix: true. Known keys: accept, battery" in text
    long = load_fault("seed: 3\n", {"link.signing": f"{{key:{'a' * 300}}}"}, folder=tmp_path)
    assert len(long) < 400


def test_a_wrong_option_is_told_by_its_name(tmp_path):
    text = load_fault("seed: 3\n", overrides={"seed": -1, "trajectory": 9}, folder=tmp_path)
    assert "--seed: 'seed': input should be greater" in text
    assert "--traj: 'trajectory': test trajectories are numbered" in text


def test_options_win_over_the_file_and_set_over_both(tmp_path):
    config = load("seed: 1\nhover_s: 1\n", {"seed": "3"}, {"seed": 2}, tmp_path)
    assert (config.mission.seed, config.mission.hover_s) == (3, 1)


# Names and paths


@pytest.mark.parametrize(
    ("key", "says"),
    [
        (
            "vehicle",
            "unknown vehicle 'nope'. Give a YAML file or one of: arducopter, bebop2, sih_quadx, x",
        ),
        (
            "controller",
            "unknown controller 'nope'. Give a YAML file or one of: l1, lqr-l1, mpc-l1, mpc-l1-plu",
        ),
    ],
)
def test_an_unknown_name_is_told_with_the_known_ones(key, says):
    assert load_fault(overrides={key: "nope"}).startswith(says)
    assert load_fault(overrides={key: "nope.yaml"}) == "nope.yaml: no such file. Check the path."
    assert "no such file" in load_fault(overrides={key: "n" * 5000 + ".yaml"})
    assert "Give a YAML file or" in load_fault(overrides={key: "../vehicles/bebop2"})


def test_paths_in_a_mission_are_relative_to_it_and_options_to_where_one_is(tmp_path, monkeypatch):
    folder = tmp_path / "missions"
    folder.mkdir()
    shipped = configs_folder()
    for name, source in (
        ("mine.yaml", shipped / "vehicles" / "bebop2.yaml"),
        ("gains.yaml", shipped / "controllers" / "mpc-l1" / "bebop2.yaml"),
    ):
        text = source.read_text(encoding="utf-8").replace("hover_thrust: 0.5", "hover_thrust: 0.4")
        (folder / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    text = "vehicle: mine.yaml\ncontroller: gains.yaml\nwind: w.yaml\ntrajectory: own.csv\n"
    text += "faults: f.yaml\n"
    (folder / "m.yaml").write_text(text, encoding="utf-8")

    config = load_flight(Path("missions/m.yaml"), {}, {})
    assert config.vehicle.hover_thrust == 0.4
    assert config.mission.trajectory == "missions/own.csv"
    assert config.mission.wind == "missions/w.yaml"
    assert config.mission.faults == "missions/f.yaml"
    overridden = load_flight(Path("missions/m.yaml"), {"trajectory": "own.csv"}, {"wind": "w.yaml"})
    assert (overridden.mission.trajectory, overridden.mission.wind) == ("own.csv", "w.yaml")


def test_names_in_a_mission_stay_names_and_absolute_paths_absolute(tmp_path):
    config = load("vehicle: x500\nwind: gusts\ntrajectory: /a/b.csv\n", folder=tmp_path)
    assert (config.vehicle.name, config.mission.wind) == ("x500", "gusts")
    assert config.mission.trajectory == "/a/b.csv"


def test_a_vehicles_file_gets_the_controller_of_the_vehicle_that_it_names(tmp_path):
    path = tmp_path / "mine.yaml"
    text = (configs_folder() / "vehicles" / "x500.yaml").read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    mine = load(overrides={"vehicle": str(path)})
    assert mine.controller == load(overrides={"vehicle": "x500"}).controller
    path.write_text(text.replace("name: x500", "name: other"), encoding="utf-8")
    said = load_fault(overrides={"vehicle": str(path)})
    assert said.startswith("there is no 'mpc-l1' for the vehicle 'other', only for arducopter, b")


@pytest.mark.parametrize("vehicle", ["arducopter", "bebop2", "sih_quadx", "x500"])
def test_every_shipped_vehicle_is_named_as_its_file_and_has_a_controller(vehicle):
    assert load(overrides={"vehicle": vehicle}).vehicle.name == vehicle


TUNED = ["pid-l1", "lqr-l1", "mpc-pid", "pid", "pid-l1-error", "mpc-pid-joint"]


@pytest.mark.parametrize("name", [*TUNED, *(f"mpc-pid-t{n}" for n in range(1, 6))])
def test_a_shipped_baseline_says_by_which_command_its_gains_were_found(name):
    config = load_flight(None, {"controller": name}, {})
    assert "companion tune" in config.controller.source


@pytest.mark.parametrize("name", ["pid-l1", "lqr-l1", "l1", "pid-l1-error"])
def test_all_frameworks_over_l1_have_the_same_l1_controller(name):
    own = load_flight(None, {}, {}).controller.l1
    assert load_flight(None, {"controller": name}, {}).controller.l1 == own
