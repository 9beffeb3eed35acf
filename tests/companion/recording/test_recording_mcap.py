import json
import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, make_reader

from companion.recording.json_record import record_json
from companion.recording.mcap_log import McapLog, read_records
from companion.recording.schema import (
    ChannelSpec,
    Field,
    json_schema,
    spec_from_record,
    unit_of,
)

BASE_US = 1_700_000_000_000_000


class Status(Enum):
    SOLVED = "solved"
    FAILED = "failed"


RECORD = {
    "time_s": 1.25,
    "position_enu_m": (1.0, -2.0, 3.0),
    "attitude_flu_to_enu": (1.0, 0.0, 0.0, 0.0),
    "iterations": 7,
    "fallback": False,
    "status": Status.SOLVED,
    "solve_time_us": None,
    "plan_m": (0.1, 0.2),
    "note": 'said "so"',
}
PLAIN = json.loads(json.dumps(RECORD | {"status": "solved"}))
TICK = ChannelSpec(
    "tick",
    (
        Field("time_s"),
        Field("position_enu_m", "array"),
        Field("attitude_flu_to_enu", "array"),
        Field("iterations", "integer"),
        Field("fallback", "boolean"),
        Field("status", "string"),
        Field("solve_time_us"),
        Field("plan_m", "array"),
        Field("note", "string", "what a person should know"),
    ),
    "What one tick did.",
)


def written(path, count=10):
    log = McapLog(path, [TICK], BASE_US)
    for number in range(count):
        log.write("tick", 0.01 * number, RECORD | {"iterations": number})
        log.write("state", 0.01 * number, {"speed_m_s": float(number)})
    return log


def test_records_come_back_in_order_with_their_times(tmp_path):
    written(tmp_path / "a.mcap").close()

    records = list(read_records(tmp_path / "a.mcap"))

    assert [record.topic for record in records] == ["tick", "state"] * 10
    assert records[8].time_s == 0.04
    assert records[8].values == PLAIN | {"iterations": 4}


def test_an_unfinished_log_is_read_up_to_the_last_flush(tmp_path):
    path = tmp_path / "a.mcap"
    log = written(path)
    log.flush()
    log.write("tick", 9.0, RECORD)

    read = list(read_records(path))
    log.close()

    assert len(read) == 20
    assert len(list(read_records(path))) == 21


def test_the_librarys_reader_gives_the_records_of_an_unfinished_log(tmp_path):
    path = tmp_path / "a.mcap"
    log = written(path)
    log.flush()
    found = []

    def read(file):
        for _, channel, message in NonSeekingReader(file).iter_messages(log_time_order=False):
            found.append((channel.topic, message.log_time))

    with path.open("rb") as file, pytest.raises(EndOfFile):
        read(file)
    log.close()

    assert len(found) == 20
    assert found[-1] == ("state", BASE_US * 1000 + 90_000_000)


def test_a_finished_log_has_an_index_and_schemas(tmp_path):
    path = tmp_path / "a.mcap"
    written(path).close()

    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        ticks = list(reader.iter_messages(topics=["tick"]))

    assert summary.statistics.message_count == 20
    assert {channel.topic for channel in summary.channels.values()} == {"tick", "state"}
    assert {channel.message_encoding for channel in summary.channels.values()} == {"json"}
    assert {schema.encoding for schema in summary.schemas.values()} == {"jsonschema"}
    assert len(ticks) == 10


@settings(deadline=None, derandomize=True)
@given(st.integers(8, 5000))
def test_a_log_cut_off_anywhere_is_read_without_an_error(tmp_path_factory, length):
    path = tmp_path_factory.mktemp("cut") / "a.mcap"
    log = McapLog(path, [TICK])
    for number in range(20):
        log.write("tick", 0.1 * number, RECORD | {"iterations": number})
        log.flush()
    log.close()
    data = path.read_bytes()
    path.write_bytes(data[:length])

    read = [record.values["iterations"] for record in read_records(path)]

    assert read == list(range(len(read)))
    if length >= len(data):
        assert len(read) == 20


def test_the_same_records_make_the_same_bytes(tmp_path):
    for name in ("a.mcap", "b.mcap"):
        written(tmp_path / name).close()

    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


numbers = st.one_of(
    st.none(), st.integers(-1000, 1000), st.floats(-1e6, 1e6), st.sampled_from((math.nan, math.inf))
)
records = st.fixed_dictionaries(
    {
        "a": numbers,
        "b": numbers,
        "c": st.lists(numbers, min_size=2, max_size=3),
        "d": st.sampled_from(([1.0, 2.0], [1.0, math.nan])),
        "e": st.one_of(st.text(max_size=5), st.booleans(), st.none()),
    }
)


def as_read(value):
    """What a reader of the log finds of a value."""
    if isinstance(value, list):
        return [as_read(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


class Pair(NamedTuple):
    left: float
    right: float


@dataclass(frozen=True)
class Held:
    value: float
    _kept: int = 1


class TestEncoder:
    @settings(deadline=None, derandomize=True)
    @given(st.lists(records, max_size=8))
    def test_whatever_was_null_before_each_record_is_what_was_given(self, given_records):
        for record in given_records:
            found = json.loads(record_json(record))
            assert found == {name: as_read(value) for name, value in record.items()}

    def test_not_finite_numbers_become_null_wherever_they_are(self):
        encoded = record_json(
            {"a_m": math.nan, "b_m": [1.0, -math.inf], "c": {"d": math.inf}, "e": "nan"}
        )

        assert json.loads(encoded) == {
            "a_m": None,
            "b_m": [1.0, None],
            "c": {"d": None},
            "e": "nan",
        }

    def test_after_a_null_the_next_record_is_whole_again(self):
        encoded = [
            json.loads(record_json({"a": a, "b": b}))
            for a, b in [(1.0, [2.0]), (None, [math.nan]), (3.0, [4.0, 5.0]), (6.0, [])]
        ]

        assert encoded == [
            {"a": 1, "b": [2]}, {"a": None, "b": [None]}, {"a": 3, "b": [4, 5]}, {"a": 6, "b": []},
        ]  # fmt: skip

    def test_a_record_without_fields_is_kept(self):
        assert json.loads(record_json({})) == {}

    def test_what_orjson_refuses_is_encoded_all_the_same(self):
        record = {
            "large": 2**70,
            "half": "\ud800",
            "keys": {1: math.nan},
            "a": (np.float64("inf"),),
        }

        assert json.loads(record_json(record)) == {
            "large": 2**70, "half": "\ud800", "keys": {"1": None}, "a": [None],
        }  # fmt: skip

    def test_named_tuples_and_dataclasses_are_encoded_as_lists_and_objects(self):
        assert json.loads(record_json({"a": Pair(1.0, math.nan), "b": Held(2.5)})) == {
            "a": [1.0, None], "b": {"value": 2.5, "_kept": 1},
        }  # fmt: skip

    def test_arrays_of_numpy_and_nested_ones_are_encoded(self):
        record = {
            "a_m": np.float64(1.5),
            "b_m": np.array([1.0, 2.0]),
            "c": np.array([[1.0, math.nan], [3.0, 4.0]]),
            "d": [(1, 2), (3, 4)],
            "n": np.int64(3),
        }

        encoded = record_json(record)

        assert json.loads(encoded) == {
            "a_m": 1.5, "b_m": [1, 2], "c": [[1, None], [3, 4]], "d": [[1, 2], [3, 4]], "n": 3,
        }  # fmt: skip

    def test_what_json_cannot_say_is_said_as_text(self):
        assert json.loads(record_json({"a": 1j})) == {"a": "1j"}

    def test_names_and_texts_with_special_signs_are_safe(self):
        record = {"100%": 1.0, 'say "x"': "50%\n", "ü": "ü"}

        encoded = record_json(record)

        assert json.loads(encoded) == record

    @settings(deadline=None, derandomize=True)
    @given(
        st.dictionaries(
            st.text(max_size=5),
            st.one_of(
                st.floats(),
                st.integers(-(2**63), 2**63),
                st.booleans(),
                st.none(),
                st.text(max_size=5),
                st.lists(st.floats(), max_size=4),
                st.lists(st.one_of(st.none(), st.text(max_size=3), st.floats()), max_size=3),
            ),
            max_size=6,
        ),
    )
    def test_any_record_becomes_json_that_says_the_same(self, record):
        assert_says(json.loads(record_json(record)), record)


def assert_says(decoded, value):
    """The JSON has the value exactly, null where it is not finite."""
    if isinstance(value, dict):
        assert decoded.keys() == value.keys()
        for name in value:
            assert_says(decoded[name], value[name])
    elif isinstance(value, list):
        assert len(decoded) == len(value)
        for ours, expected in zip(decoded, value, strict=True):
            assert_says(ours, expected)
    elif isinstance(value, float) and not math.isfinite(value):
        assert decoded is None
    elif isinstance(value, float | int) and not isinstance(value, bool):
        assert decoded == value
    else:
        assert decoded == value or float(decoded) == float(value)


class TestSchema:
    def test_a_dataclass_describes_its_records_with_units(self):
        schema = json_schema(TICK)

        properties = schema["properties"]
        assert {name: part.get("type") for name, part in properties.items()} == {
            "time_s": "number",
            "position_enu_m": "array",
            "attitude_flu_to_enu": "array",
            "iterations": "integer",
            "fallback": "boolean",
            "status": "string",
            "solve_time_us": "number",
            "plan_m": "array",
            "note": "string",
        }
        assert properties["position_enu_m"]["description"] == "[m, world frame ENU]"
        assert properties["position_enu_m"]["items"] == {"type": "number", "nullable": True}
        assert properties["note"]["description"] == "what a person should know"
        assert "w, x, y, z" in properties["attitude_flu_to_enu"]["description"]
        assert schema["type"] == "object"
        assert schema["description"] == "What one tick did."

    @pytest.mark.parametrize(
        ("name", "unit"),
        [
            ("velocity_enu_m_s", "m/s, world frame ENU"),
            ("acceleration_enu_m_s2", "m/s², world frame ENU"),
            ("rate_flu_rad_s", "rad/s, body frame FLU"),
            ("yaw_rad", "rad"),
            ("solve_time_us", "µs"),
            ("time_s", "s"),
            ("thrust", ""),
            ("axis", ""),
        ],
    )
    def test_units_are_read_off_names(self, name, unit):
        assert unit_of(name) == unit

    def test_a_record_describes_its_channel(self):
        spec = spec_from_record(
            "x", {"a": 1.0, "b": 1, "c": True, "d": "s", "e": (1, 2.0), "f": [[1.0]], "g": None}
        )

        assert [(field.name, field.kind) for field in spec.fields] == [
            ("a", "number"),
            ("b", "integer"),
            ("c", "boolean"),
            ("d", "string"),
            ("e", "array"),
            ("f", "any"),
            ("g", "any"),
        ]
