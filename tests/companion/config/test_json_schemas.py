"""The JSON Schemas that editors check YAML files by are those of the models that read them."""

import json
import re
from pathlib import Path

import pytest
from jsonschema import Draft7Validator

from companion.config.folders import configs_folder, schema_path
from companion.config.models import ControllerConfig, MissionConfig
from companion.config.validation import validate
from companion.config.yaml_source import parse_yaml, read_yaml
from companion.trajectories.from_file import TrajectoryFileError, load_trajectory
from tools.schemas import MODELS, schema_text

CONFIGS = configs_folder()
FILES = sorted(CONFIGS.rglob("*.yaml"))
MODELINE = re.compile(r"# yaml-language-server: \$schema=(\S+)\n")


def validator(kind):
    return Draft7Validator(json.loads(schema_path(kind).read_text(encoding="utf-8")))


def schema_of(path):
    """The schema that a file's first line names."""
    found = MODELINE.match(path.read_text(encoding="utf-8"))
    assert found, f"{path}: its first line names no schema"
    return (path.parent / found[1]).resolve()


@pytest.mark.parametrize("kind", MODELS)
def test_a_shipped_schema_is_what_the_model_says(kind):
    assert schema_path(kind).read_text(encoding="utf-8") == schema_text(kind), (
        "write them anew: python -m tools.schemas"
    )
    Draft7Validator.check_schema(json.loads(schema_text(kind)))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(CONFIGS)))
def test_a_shipped_file_follows_the_schema_that_it_names(path):
    named = schema_of(path)
    assert named.parent == CONFIGS / "schemas"
    found = validator(named.stem).iter_errors(read_yaml(path).data)
    assert [f"{one.json_path}: {one.message}" for one in found] == []


@pytest.mark.parametrize(
    ("folder", "kind"),
    [("missions", "mission"), ("controllers", "controller"), ("scenarios", "scenario"),
     ("faults", "faults"), ("campaigns", "campaign"), ("vehicles", "vehicle"),
     ("trajectories", "trajectory")],
)  # fmt: skip
def test_files_of_a_folder_name_the_schema_of_their_kind(folder, kind):
    assert {schema_of(path).stem for path in (CONFIGS / folder).rglob("*.yaml")} == {kind}


def test_the_simulators_own_files_follow_theirs():
    profiles = Path(__file__).parents[3] / "sitl_shim" / "sensors" / "profiles"
    for path in sorted(profiles.glob("*.yaml")):
        assert not list(validator("sensors").iter_errors(read_yaml(path).data)), path


TAKEN = [
    "trajectory: 5\nseed: 3",
    "trajectory: loop.csv\nswitch: ['t=8:mpc-l1', {at_s: 9, to: l1-off}]",
    "faults: {link: [{loss: 0.3}]}\norigin: {heading_deg: vehicle, offset_enu_m: [0, 1, 2]}",
    "mocap: {options: {rate: 100, name: x}}\nhover_s: 4",
    "link: {forward: [{url: 'udpout://127.0.0.1:14550'}], system_id: null}",
]


@pytest.mark.parametrize("text", TAKEN)
def test_what_a_mission_takes_its_schema_takes(text):
    source = parse_yaml(text, "mission.yaml")
    validate(MissionConfig, source)
    assert list(validator("mission").iter_errors(source.data)) == []


@pytest.mark.parametrize(
    "text",
    [
        "hover: 2",
        "trajectory: 6",
        "hover_s: -1",
        "autopilot: inav",
        "origin: {offset_enu_m: [0, 0]}",
        "seed: true",
        "geofence: {low: [0, 0, 0]}",
    ],
)
def test_mistakes_are_seen_in_the_editor(text):
    assert list(validator("mission").iter_errors(parse_yaml(text, "m").data))


def test_a_controllers_sections_go_with_its_framework():
    data = read_yaml(CONFIGS / "controllers" / "mpc-l1" / "bebop2.yaml").data
    check = validator("controller")
    assert not list(check.iter_errors(data))
    without = {key: value for key, value in data.items() if key != "l1"}
    assert "'l1' is a required property" in [one.message for one in check.iter_errors(without)]
    assert list(check.iter_errors({**data, "framework": "pid"}))


def test_hover_texts_say_meaning_unit_limits_and_default():
    mission = json.loads(schema_path("mission").read_text(encoding="utf-8"))
    said = mission["properties"]["takeoff_height_m"]["description"]
    assert said.endswith("(m; 0.5 … 20; default: 2.5)")
    for kind, model in (("mission", MissionConfig), ("controller", ControllerConfig)):
        schema = json.loads(schema_path(kind).read_text(encoding="utf-8"))
        assert set(schema["properties"]) == set(model.model_fields)
        assert all(one.get("description") for one in schema["properties"].values())


@pytest.mark.parametrize(
    ("text", "good"),
    [
        ("points: [[0, 0, 0, 1], [1, 0, 0, 1]]", True),
        ("name: x\npoints: [[0, 0, 0, 1], [1.5, 0.2, 0, 1]]", True),
        ("points: [[0, 0, 0, 1]]", False),
        ("points: [[0, 0, 0], [1, 0, 0]]", False),
        ("points: [[0, 0, 0, 1], [1, 0, 0, 20000]]", False),
        ("name: 3\npoints: [[0, 0, 0, 1], [1, 0, 0, 1]]", False),
        ("knots: []", False),
    ],
)
def test_a_trajectorys_schema_and_its_reader_agree(text, good, tmp_path):
    path = tmp_path / "t.yaml"
    path.write_text(text)
    try:
        load_trajectory(path)
        read = True
    except TrajectoryFileError:
        read = False
    errors = list(validator("trajectory").iter_errors(parse_yaml(text, "t").data))
    assert (read, not errors) == (good, good)
