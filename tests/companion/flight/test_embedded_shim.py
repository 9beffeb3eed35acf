"""Which embedded shim flies a mission: what it is told of faults."""

from pathlib import Path

import pytest
import yaml

from companion.config.models import MissionConfig
from companion.config.resolve import configs_folder, load_flight
from companion.config.yaml_source import ConfigError
from companion.flight.embedded_shim import embedded_shim, faults_text


def told(faults):
    return faults_text(MissionConfig(faults=faults))


def test_a_mission_without_faults_tells_the_shim_of_none():
    assert embedded_shim(load_flight(None, {}, {})).faults is None


def test_faults_by_name_are_the_shipped_files_path():
    config = load_flight(None, {"faults": "bad-link"}, {})
    assert embedded_shim(config).faults == str(configs_folder() / "faults" / "bad-link.yaml")


def test_a_path_from_another_folder_is_made_absolute(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("own.yaml").write_text("name: own\n")
    assert told("own.yaml") == str(tmp_path / "own.yaml")


def test_faults_in_the_mission_go_as_one_line_of_yaml_with_the_same_content():
    faults = {"link": [{"way": "both", "loss": 1e-05, "until_s": 1e300}], "name": "x " * 300}
    text = told(faults)
    assert text.startswith("{")
    assert "\n" not in text.rstrip("\n")
    assert yaml.safe_load(text) == faults


def test_text_that_begins_with_a_brace_is_the_faults_themselves():
    assert told("{link: [{loss: 0.1}]}") == "{link: [{loss: 0.1}]}"


def test_settings_make_faults_too():
    config = load_flight(None, {}, {"faults.link": "[{loss: 0.1}]"})
    assert yaml.safe_load(embedded_shim(config).faults) == {"link": [{"loss": 0.1}]}


@pytest.mark.parametrize(
    ("faults", "says"),
    [
        ("nope", "unknown fault 'nope'. Give a YAML file or one of: bad-link, "),
        ("nope.yaml", "nope.yaml: no such file. Check the path."),
    ],
)
def test_faults_that_are_not_there_are_refused(faults, says):
    with pytest.raises(ConfigError) as caught:
        told(faults)
    assert str(caught.value).startswith(says)
