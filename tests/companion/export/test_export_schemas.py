"""What the logs promise to Foxglove and PlotJuggler: schemas, messages, the layouts' names."""

import json
import re
from xml.etree import ElementTree

import pytest
from jsonschema import Draft202012Validator, validators

from companion.config.folders import configs_folder
from companion.export.foxglove import write_foxglove
from companion.export.foxglove_schemas import SCHEMAS
from companion.flight.records import CHANNELS
from companion.recording.flight_files import flight_files
from companion.recording.schema import Field, json_schema, spec_from_record

LAYOUTS = configs_folder() / "layouts"
ITEM = re.compile(r"^(\w+)\[(\d+)\]$")


def of_type_or_nullable(validator, types, instance, schema):
    if not (instance is None and schema.get("nullable")):
        yield from Draft202012Validator.VALIDATORS["type"](validator, types, instance, schema)


Nullable = validators.extend(Draft202012Validator, {"type": of_type_or_nullable})
"""JSON Schema with OpenAPI's `nullable`, as the log's schemas use it."""


def foxglove_takes(schema):
    """The rules of Foxglove's reader of JSON Schemas: one known type everywhere, no bare object."""
    assert schema["type"] == "object"
    for part in schema["properties"].values():
        if "oneOf" in part:
            assert all(isinstance(one["const"], int) for one in part["oneOf"])
            continue
        assert part["type"] in ("boolean", "string", "number", "integer", "object", "array")
        if part["type"] == "array":
            assert part["items"]["type"] in ("boolean", "string", "number", "integer", "object")
            if part["items"]["type"] == "object":
                foxglove_takes(part["items"])
        elif part["type"] == "object":
            foxglove_takes(part)


@pytest.fixture(scope="module")
def exported(flown_once, tmp_path_factory):
    path = tmp_path_factory.mktemp("foxglove") / "foxglove.mcap"
    write_foxglove(flight_files(flown_once), path, lambda *_: None)
    return path


@pytest.mark.parametrize("log", ["as flown", "exported"])
def test_every_message_fits_its_schema(log, flown_once, exported, messages_of):
    path = flown_once / "flight.mcap" if log == "as flown" else exported
    validators_of = {}
    seen = set()
    for schema, channel, _, values in messages_of(path):
        if schema.id not in validators_of:
            said = json.loads(schema.data)
            Nullable.check_schema(said)
            validators_of[schema.id] = Nullable(said)
        assert schema.encoding == "jsonschema"
        assert channel.message_encoding == "json"
        seen.add(channel.topic)
        validators_of[schema.id].validate(values)
    expected = {"control", "plan", "event", "input", "configuration"}
    if log == "exported":
        expected |= {"transform", "pose", "true_pose", "desired", "scene", "messages", "tracking"}
    assert expected <= seen


def test_a_message_that_does_not_fit_is_found():
    validator = Nullable(json_schema(CHANNELS[0]))
    validator.validate({"thrust": None, "position_enu_m": [None, 1.0, 2.0]})
    assert not validator.is_valid({"thrust": "0.5"})
    assert not validator.is_valid({"position_enu_m": 1.0})
    assert not validator.is_valid({"phase": None})


@pytest.mark.parametrize("spec", CHANNELS, ids=lambda spec: spec.topic)
def test_foxglove_can_read_the_schema_of_a_channel(spec):
    foxglove_takes(json_schema(spec))


def test_foxglove_can_read_the_schema_of_any_record():
    record = {"words": ["a"], "nothing": None, "inside": {"x": 1}, "mixed": [1, "a"], "n": 1}
    schema = json_schema(spec_from_record("odd", record))
    foxglove_takes(schema)
    assert set(schema["properties"]) == {"inside", "n"}
    Nullable(schema).validate(record)


@pytest.mark.parametrize("name", SCHEMAS)
def test_foxglove_can_read_the_schemas_of_what_is_made_for_it(name):
    foxglove_takes(SCHEMAS[name])
    assert SCHEMAS[name]["title"] == name


def test_each_vector_and_time_of_the_channels_says_its_unit():
    unitless = {"u", "applied_u", "sigma_hat", "sigma_bound", "constrained_axes"}
    for spec in CHANNELS:
        for field in spec.fields:
            assert isinstance(field, Field)
            if field.kind == "array" and field.name not in unitless:
                assert "[" in json_schema(spec)["properties"][field.name]["description"], field


def last_values(path, messages_of):
    """Of each topic, each field with a value of it that is not null."""
    found = {}
    for _, channel, _, values in messages_of(path):
        known = found.setdefault(channel.topic, {})
        for name, value in values.items():
            if known.get(name) in (None, [None] * 3):
                known[name] = value
    return found


def assert_there_is(found, topic, field):
    match = ITEM.match(field)
    name, item = (match[1], int(match[2])) if match else (field, None)
    assert topic in found, f"the layout names the topic {topic}"
    assert name in found[topic], f"the layout names {topic}.{name}"
    value = found[topic][name]
    if item is None:
        assert not isinstance(value, list | dict), f"{topic}.{name} is no figure"
    else:
        assert item < len(value), f"{topic}.{field}: there are {len(value)}"


def test_foxgloves_layout_names_only_what_there_is(exported, messages_of):
    layout = json.loads((LAYOUTS / "foxglove.json").read_text())
    found = last_values(exported, messages_of)
    paths = 0
    panels = layout["configById"]
    for panel in panels.values():
        for path in panel.get("paths", ()):
            topic, _, field = path["value"].partition(".")
            assert_there_is(found, topic, field)
            paths += 1
        for topic in (*panel.get("topics", ()), panel.get("topicToRender")):
            assert topic is None or topic in found
    assert paths > 20
    assert panels["3D!flight"]["followTf"] == found["transform"]["parent_frame_id"]
    assert sorted(leaves(layout["layout"])) == sorted(panels)


def leaves(node):
    if isinstance(node, str):
        return [node]
    return leaves(node["first"]) + leaves(node["second"])


def test_plotjugglers_layout_names_only_what_there_is_in_the_flights_own_log(
    flown_once, messages_of
):
    found = last_values(flown_once / "flight.mcap", messages_of)
    curves = ElementTree.parse(LAYOUTS / "plotjuggler.xml").getroot().findall(".//curve")
    assert len(curves) > 40
    for curve in curves:
        assert_there_is(found, *curve.attrib["name"].split("/"))
