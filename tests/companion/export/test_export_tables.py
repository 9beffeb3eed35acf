import csv
import json
import math
import os
import sys
import tracemalloc
from pathlib import Path

import pyarrow as arrow
import pyarrow.parquet as parquet
import pytest
from pymavlink import mavutil

from companion.commands.export import ExportRequest, run_export
from companion.commands.recover import RecoverRequest, run_recover
from companion.export.csv_files import csv_tables
from companion.export.errors import ExportError
from companion.export.packet_tables import (
    autopilot_times_s,
    layout,
    read_messages,
    taken_apart,
    write_packet_tables,
)
from companion.export.record_tables import write_record_tables
from companion.export.source import survey
from companion.flight.records import CHANNELS
from companion.mavlink.dialect import MESSAGE_CLASSES, message_class
from companion.recording.flight_files import FlightFilesError, flight_files
from companion.recording.flight_log import FlightLog, recovered_first
from companion.recording.mcap_log import McapLog
from companion.recording.mcap_reader import read_records
from companion.recording.tlog import read_tlog


@pytest.fixture(scope="module")
def tables(flown_once, tmp_path_factory):
    """Folder of the Parquet tables of the flight."""
    folder = tmp_path_factory.mktemp("tables") / "parquet"
    run_export(ExportRequest(flown_once, "parquet", folder))
    return folder


@pytest.fixture(scope="module")
def cells(flown_once, tmp_path_factory):
    """Folder of the CSV tables of the flight."""
    folder = tmp_path_factory.mktemp("cells") / "csv"
    run_export(ExportRequest(flown_once, "csv", folder))
    return folder


@pytest.fixture(scope="module")
def records(flown_once):
    topics = {}
    for record in read_records(flown_once / "flight.mcap"):
        topics.setdefault(record.topic, []).append(record)
    return topics


def test_there_is_one_table_a_topic_with_one_row_a_record(tables, records):
    found = {path.stem: parquet.read_metadata(path).num_rows for path in tables.glob("*.parquet")}
    assert found == {topic: len(of_topic) for topic, of_topic in records.items()}


def test_each_number_is_the_records_own_and_what_is_not_finite_is_null(tables, records):
    table = parquet.read_table(tables / "control.parquet").to_pylist()
    nulls = 0
    for row, record in zip(table, records["control"], strict=True):
        values = record.values
        assert row["log_time_s"] == record.time_s
        assert row["autopilot_time_s"] == values["autopilot_time_s"]
        assert [row[f"position_enu_m_{axis}"] for axis in "xyz"] == values["position_enu_m"]
        w_first = [row[f"attitude_flu_to_enu_{axis}"] for axis in "wxyz"]
        assert w_first == values["attitude_flu_to_enu"]
        assert row["phase"] == values["phase"]
        assert row["sent"] is values["sent"]
        assert row["thrust"] == values["thrust"]
        nulls += row["desired_enu_m_x"] is None
    assert 0 < nulls < len(table)


def test_a_column_says_its_unit_its_frame_and_what_it_is(tables):
    schema = parquet.read_schema(tables / "control.parquet")
    velocity = schema.field("velocity_enu_m_s_y").metadata
    assert velocity[b"unit"] == b"m/s"
    assert velocity[b"frame"] == b"world frame ENU"
    assert velocity[b"about"] == b"as reported"
    assert schema.field("computed_us").metadata[b"unit"] == "µs".encode()
    assert schema.field("position_enu_m_x").type == arrow.float64()
    speed = parquet.read_schema(tables / "mavlink" / "GLOBAL_POSITION_INT.parquet").field("vx")
    assert speed.metadata[b"unit"] == b"cm/s"


def test_what_is_no_figure_is_json(tables, records):
    table = parquet.read_table(tables / "input.parquet").to_pylist()
    assert [json.loads(row["values"]) for row in table] == [
        record.values["values"] for record in records["input"]
    ]


def test_the_messages_are_those_that_pymavlink_reads(tables, flown_once):
    log = mavutil.mavlink_connection(str(flown_once / "flight.tlog"), dialect="all")
    expected = {}
    while (message := log.recv_match()) is not None:
        expected.setdefault(message.get_type(), []).append(message)
    found = {path.stem: path for path in (tables / "mavlink").glob("*.parquet")}
    unknown = {name for name in expected if name.startswith("UNKNOWN")}
    assert set(found) == set(expected) - unknown - {"BAD_DATA"}
    for name in ("ODOMETRY", "ATTITUDE_QUATERNION", "STATUSTEXT", "COMMAND_LONG", "PARAM_VALUE"):
        rows = parquet.read_table(found[name]).to_pylist()
        assert len(rows) == len(expected[name])
        for row, message in list(zip(rows, expected[name], strict=True))[::7]:
            assert row["system"] == message.get_srcSystem()
            assert row["component"] == message.get_srcComponent()
            for field in message.get_fieldnames():
                assert_same(row, field, getattr(message, field))


def test_what_the_dialect_does_not_know_is_counted_by_its_number(tmp_path):
    log = FlightLog(tmp_path, CHANNELS)
    foreign = bytes([0xFD, 1, 0, 0, 0, 1, 1]) + (54321).to_bytes(3, "little") + b"\x07\0\0"
    for time_s in (0.0, 0.1):
        log.frame_in(time_s, foreign)
    log.close()
    into = csv_tables(tmp_path / "tables")
    assert write_packet_tables(flight_files(tmp_path), into, lambda *_: None) == ([], {54321: 2})


def assert_same(row, field, value):
    if isinstance(value, list):
        for k, item in enumerate(value):
            assert_same(row, f"{field}_{k}", item)
    elif isinstance(value, float) and not math.isfinite(value):
        assert row[field] is None
    else:
        assert row[field] == value


def test_messages_and_records_have_one_time_axis(tables, records):
    sent = parquet.read_table(tables / "mavlink" / "SET_ATTITUDE_TARGET.parquet").to_pylist()
    ticks = [r.time_s for r in records["control"] if r.values["sent"]]
    assert all(row["sent"] for row in sent)
    times = [row["log_time_s"] for row in sent if row["log_time_s"] > ticks[0] - 1e-3]
    assert times[:50] == pytest.approx(ticks[:50], abs=5e-6)  # a tlog counts in steps of 4 µs


def test_messages_tell_the_autopilots_time_where_they_have_one(tables, records):
    odometry = parquet.read_table(tables / "mavlink" / "ODOMETRY.parquet").to_pylist()
    told = {row["autopilot_time_s"] for row in odometry if row["component"] == 1}
    assert {r.values["autopilot_time_s"] for r in records["control"]} <= told
    heartbeats = parquet.read_table(tables / "mavlink" / "HEARTBEAT.parquet").to_pylist()
    assert {row["autopilot_time_s"] for row in heartbeats} == {None}
    made = read_messages(30, [(1500).to_bytes(4, "little"), b""])
    assert autopilot_times_s(made) == [1.5, None]


def test_csv_holds_the_same(tables, cells):
    for path in tables.rglob("*.parquet"):
        table = parquet.read_table(path)
        with (cells / path.relative_to(tables)).with_suffix(".csv").open(newline="") as file:
            header, *rows = csv.reader(file)
        assert header == table.column_names
        assert len(rows) == table.num_rows
    table = parquet.read_table(tables / "plan.parquet").to_pylist()
    with (cells / "plan.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for row, expected in zip(rows, table, strict=True):
        assert float(row["predicted_end_enu_m_x"]) == expected["predicted_end_enu_m_x"]
        assert row["status"] == expected["status"]


def test_csv_says_of_each_column_what_it_is(cells):
    with (cells / "columns.csv").open(newline="", encoding="utf-8") as file:
        columns = {(row["table"], row["column"]): row for row in csv.DictReader(file)}
    headers = set()
    for path in cells.rglob("*.csv"):
        if path.name != "columns.csv":
            table = str(path.relative_to(cells).with_suffix(""))
            headers |= {(table, name) for name in path.read_text().split("\n", 1)[0].split(",")}
    assert headers == set(columns)
    assert columns["control", "y_tilde_m_s_x"]["unit"] == "m/s"


@pytest.mark.parametrize("kind", ["parquet", "csv"])
def test_what_is_there_is_not_written_over(kind, flight, capsys):
    run_export(ExportRequest(flight, kind))
    before = sorted((flight / kind).rglob("*"))
    with pytest.raises(ExportError, match=r"is there already and is not written over.*--out"):
        run_export(ExportRequest(flight, kind))
    assert sorted((flight / kind).rglob("*")) == before
    assert f"written: {flight / kind}: " in capsys.readouterr().out


def test_an_empty_folder_may_be_filled(flight, tmp_path):
    (tmp_path / "mine").mkdir()
    run_export(ExportRequest(flight, "csv", tmp_path / "mine"))
    assert (tmp_path / "mine" / "control.csv").is_file()


def test_a_log_that_was_cut_off_is_exported_as_far_as_it_goes(flight, records):
    for name in ("flight.mcap", "flight.tlog"):
        data = (flight / name).read_bytes()
        (flight / name).write_bytes(data[: int(0.6 * len(data))])
    whole = [r for r in read_records(flight / "flight.mcap") if r.topic == "control"]
    packets = sum(1 for _ in read_tlog(flight / "flight.tlog"))
    run_export(ExportRequest(flight))
    control = parquet.read_metadata(flight / "parquet" / "control.parquet").num_rows
    assert 0 < control == len(whole) < len(records["control"])
    rows = sum(
        parquet.read_metadata(path).num_rows
        for path in (flight / "parquet" / "mavlink").glob("*.parquet")
    )
    assert packets - 60 < rows <= packets


def test_a_damaged_log_names_the_remedy_and_what_it_saves_is_exported(flight, capsys):
    path = flight / "flight.mcap"
    data = bytearray(path.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 100] = bytes(100)
    path.write_bytes(data)
    with pytest.raises(FlightFilesError, match="companion recover"):
        run_export(ExportRequest(flight))
    assert [p.name for p in flight.iterdir() if "parquet" in p.name] == []
    assert run_recover(RecoverRequest(path)) == 0
    capsys.readouterr()
    run_export(ExportRequest(flight))
    assert "flight.recovered.mcap, which was recovered" in capsys.readouterr().out
    assert parquet.read_metadata(flight / "parquet" / "control.parquet").num_rows > 100


def test_a_table_that_cannot_be_written_leaves_nothing(flight, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("companion.commands.export.write_packet_tables", full)
    with pytest.raises(ExportError, match=r"cannot be written: No space left.*--out"):
        run_export(ExportRequest(flight, "csv"))
    assert sorted(p.name for p in flight.iterdir()) == ["flight.mcap", "flight.tlog"]


def test_without_pyarrow_one_line_says_how_to_get_it(flight, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ExportError, match=r"pip install 'companion\[study\]'") as caught:
        run_export(ExportRequest(flight))
    assert "\n" not in str(caught.value)
    assert sorted(p.name for p in flight.iterdir()) == ["flight.mcap", "flight.tlog"]


def test_ulog_is_refused_with_the_reason(flight):
    with pytest.raises(ExportError, match=r"no maintained library writes a new ULog"):
        run_export(ExportRequest(flight, "ulog"))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda path: None, "is not there"),
        (lambda path: path.mkdir(), "holds no flight.mcap"),
        (lambda path: path.write_bytes(b"text"), "is no log"),
    ],
)
def test_what_is_no_flight_is_said_to_be_none(tmp_path, make, words):
    path = tmp_path / "elsewhere"
    make(path)
    with pytest.raises(FlightFilesError, match=words):
        run_export(ExportRequest(path))


def test_a_topic_whose_fields_change_keeps_all_of_them(tmp_path, quiet):
    log = McapLog(tmp_path / "flight.mcap")
    log.write("odd", 0.0, {"a": 1, "v": [1.0, 2.0], "s": "text"})
    log.write("odd", 1.0, {"a": 2.5, "b": True, "v": [1.0, 2.0, 3.0], "s": 4})
    log.write("odd", 2.0, {"a": None, "v": None})
    log.close()
    rows = []

    def begin(table):
        class Kept:
            def write(self, columns):
                names = [column.name for column in table.columns]
                rows.extend(
                    dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)
                )

            def close(self):
                pass

        return Kept()

    files = flight_files(tmp_path)
    ((table, count),) = write_record_tables(files, survey(files, quiet), begin, quiet)
    assert count == 3
    assert {c.name: c.kind for c in table.columns} == {
        "log_time_s": "number", "a": "number", "v_x": "number", "v_y": "number", "v_z": "number",
        "s": "string", "b": "boolean",
    }  # fmt: skip
    assert [row["a"] for row in rows] == [1, 2.5, None]
    assert [row["v_z"] for row in rows] == [None, 3.0, None]
    assert [row["s"] for row in rows] == ['"text"', "4", None]
    assert [row["b"] for row in rows] == [None, True, None]


def test_a_long_log_takes_no_more_memory_than_a_short_one(tmp_path, quiet):
    peaks = []
    for count in (10_000, 60_000):
        folder = tmp_path / str(count)
        folder.mkdir()
        log = McapLog(folder / "flight.mcap")
        for k in range(count):
            log.write("many", k * 0.01, {"a": float(k), "b": "words"})
        log.close()
        files = flight_files(folder)
        found = survey(files, quiet)

        def begin(_table):
            return Nowhere()

        tracemalloc.start()
        write_record_tables(files, found, begin, quiet)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 2.0 * peaks[0], "six times the log"


class Nowhere:
    def write(self, columns):
        pass

    def close(self):
        pass


def test_the_layout_of_each_message_is_as_long_as_the_message():
    for message_id, message in MESSAGE_CLASSES.items():
        assert layout(message_id).itemsize == message.unpacker.size, message.msgname


def test_a_packet_of_either_protocol_is_taken_apart(flown_once):
    ping = message_class("PING")(1, 2, 3, 4)
    one = mavutil.mavlink.MAVLink(None, srcSystem=7, srcComponent=9)
    for old in (True, False):
        raw = ping.pack(one, force_mavlink1=old)
        packet = taken_apart(bytes(raw))
        assert (packet.message_id, packet.system, packet.component) == (4, 7, 9)
        (row,) = read_messages(packet.message_id, [packet.payload])
        assert (row["time_usec"], row["seq"]) == (1, 2)


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_whatever_a_log_calls_its_topics_its_tables_lie_in_the_folder_asked_for(tmp_path, kind):
    folder = tmp_path / "flight"
    folder.mkdir()
    log = McapLog(folder / "flight.mcap")
    for topic in ("/tmp/there", "../../up", "..__up", "/"):
        log.write(topic, 0.0, {"a": 1.0})
    log.close()
    out = tmp_path / "deep" / "out"
    run_export(ExportRequest(folder, kind, out))
    tables = {path.relative_to(out).as_posix() for path in out.rglob(f"*.{kind}")}
    assert tables - {"columns.csv"} == {f"{s}.{kind}" for s in ("tmp_there", "up", "up-2", "topic")}
    assert not [path for path in tmp_path.rglob(f"*.{kind}") if not path.is_relative_to(out)]


def test_tables_go_into_an_empty_folder_that_one_stands_in(flown_once, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_export(ExportRequest(flown_once, "csv", Path()))
    assert (Path() / "control.csv").is_file()
    assert not (tmp_path / ".unfinished").exists()


def test_records_of_another_shape_are_told_with_their_file(tmp_path):
    log = McapLog(tmp_path / "flight.mcap")
    log.write("control", 0.0, {"position_enu_m": [0.0, 0.0, 1.0]})
    log.close()
    with pytest.raises(ExportError, match=r"flight\.mcap: its records are not"):
        run_export(ExportRequest(tmp_path, "foxglove", tmp_path / "out"))


def test_what_was_recovered_counts_unless_the_log_went_on(tmp_path):
    log, recovered = tmp_path / "flight.mcap", tmp_path / "flight.recovered.mcap"
    recovered.touch()
    assert recovered_first(log) == recovered, "the log itself is gone"
    log.touch()
    os.utime(recovered, (1000.0, 1000.0))
    assert recovered_first(log) == log
    os.utime(log, (999.0, 999.0))
    assert recovered_first(log) == recovered
