"""What fuzzing has found, trimmed: each was an error that nobody expected, or a hang."""

import pytest
from mcap.exceptions import McapError

from companion.config.yaml_source import ConfigError, parse_yaml
from companion.flight.check.restore_file import RestoreFileError, read_restore_file
from companion.flight.experiment import EXPERIMENT_CHANNELS
from companion.flight.records import CHANNELS
from companion.flight.replay.recorded import ReplayError
from companion.flight.replay.recorded import read_flight as read_for_replay
from companion.identification.estimates import UnidentifiedError
from companion.mavlink.framing import Frame
from companion.mavlink.messages import Target
from companion.mavlink.stand_in import denial
from companion.recording.mcap_log import McapLog
from companion.report.flight_data import read_flight
from companion.report.identification_log import read_identification
from companion.trajectories.from_file import TrajectoryFileError, load_trajectory
from sitl_shim.data_file import DataFileError
from sitl_shim.faults.schema import load_faults
from sitl_shim.wind.scenario import load_scenario

BOMB = "a: &a [x, x]\n" + "".join(
    f"{chr(97 + i)}: &{chr(97 + i)} [{', '.join([f'*{chr(96 + i)}'] * 9)}]\n" for i in range(1, 24)
)
"""Nine to the 23rd values in two kilobytes."""
DEEP = ("[" * 100_000, "{a: " * 50_000, "- " * 50_000)


def test_aliases_that_multiply_are_refused_before_they_are_followed(tmp_path):
    path = tmp_path / "bomb.yaml"
    path.write_text(BOMB)
    with pytest.raises(DataFileError, match=r"bomb\.yaml: nests too deeply: line 2 has an alias"):
        load_scenario(path)
    with pytest.raises(ConfigError, match="aliases"):
        parse_yaml(BOMB, "bomb.yaml")
    with pytest.raises(TrajectoryFileError, match="aliases"):
        load_trajectory(path)


@pytest.mark.parametrize("text", DEEP, ids=["lists", "mappings", "dashes"])
def test_nesting_without_end_ends_no_process(tmp_path, text):
    """libyaml's composer calls itself for each level, on a stack that Python does not watch."""
    path = tmp_path / "deep.yaml"
    path.write_text("a: " + text)
    with pytest.raises(DataFileError, match=r"deep\.yaml: nests too deeply|is not valid YAML"):
        load_faults(path)
    with pytest.raises(ConfigError, match=r"deep\.yaml, line 1"):
        parse_yaml("a: " + text, "deep.yaml")
    with pytest.raises(TrajectoryFileError, match=r"deep\.yaml"):
        load_trajectory(path)


@pytest.mark.parametrize("text", ['name: !!int ""', "name: !!bool x", "name: !!timestamp x"])
def test_a_tag_that_its_text_does_not_fit_is_told_with_the_file(tmp_path, text):
    path = tmp_path / "tagged.yaml"
    path.write_text(text)
    with pytest.raises(DataFileError, match=r"tagged\.yaml: is not valid YAML"):
        load_scenario(path)


def test_a_data_file_of_a_megabyte_is_not_even_read(tmp_path):
    path = tmp_path / "large.yaml"
    path.write_text("#" * 1_000_001)
    with pytest.raises(DataFileError, match="larger than 1 MB"):
        load_scenario(path)


def test_a_restore_list_that_nests_without_end_is_told(tmp_path):
    path = tmp_path / "restore.json"
    path.write_text('{"parameters": ' + "[" * 100_000)
    with pytest.raises(RestoreFileError, match="is no list of parameters"):
        read_restore_file(path)


@pytest.fixture
def log_of(tmp_path):
    def write(*records):
        log = McapLog(tmp_path / "flight.mcap", (*CHANNELS, *EXPERIMENT_CHANNELS))
        for topic, values in records:
            log.write(topic, 1.0, values)
        log.close()
        (tmp_path / "flight.tlog").write_bytes(b"")
        return tmp_path

    return write


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"autopilot_time_s": []},
        {"autopilot_time_s": 1.0, "u": {"x": 1}},
    ],
    ids=["nothing", "a list for a time", "a mapping for a vector"],
)
def test_records_that_no_flight_wrote_are_told_as_such(log_of, values):
    folder = log_of(("control", values), ("plan", values))
    with pytest.raises((ValueError, McapError), match=r"flight\.mcap"):
        read_flight(folder)


@pytest.mark.parametrize(
    "records",
    [
        [("configuration", {})],
        [("configuration", {"replayable": True})],
        [("configuration", {"replayable": True, "mission": [], "vehicle": 1, "made_by": 3})],
        [("input", {})],
        [("input", {"kind": "adopt"}), ("control", {})],
    ],
)
def test_a_replay_of_what_is_no_flight_is_refused_in_words(log_of, records):
    with pytest.raises(ReplayError, match=r"flight\.mcap"):
        read_for_replay(log_of(*records))


@pytest.mark.parametrize(
    "records",
    [
        [("experiment", {"vehicle": 1})],
        [("control", {"autopilot_time_s": None}), ("experiment", {})],
        [("thrust_report", {"thrust": []}), ("experiment", {"vehicle": {}})],
    ],
)
def test_an_identification_of_what_is_no_flight_is_refused_in_words(log_of, records):
    with pytest.raises(UnidentifiedError, match=r"flight\.mcap|Fly it again"):
        read_identification(log_of(*records))


def test_a_parameter_that_is_longer_than_its_message_is_denied_all_the_same():
    frame = Frame(
        b"\xfd"
        + bytes([255, 0, 0, 0, 255, 190])
        + (323).to_bytes(3, "little")
        + bytes(range(255))
        + b"\0\0",
        2,
        323,
        255,
        190,
        0,
        False,
    )
    answer = denial(frame, Target(255, 190))
    assert answer is not None
    assert answer.payload[:16] == frame.payload[2:18]
