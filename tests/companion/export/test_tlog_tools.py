"""The flight's tlog in the tools of others, as they are run from a shell."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from companion.mavlink.dialect import message_name
from companion.recording.mcap_reader import read_records
from companion.recording.tlog import read_tlog

MAVLOGDUMP = Path(sys.executable).with_name("mavlogdump.py")


@pytest.fixture(scope="module")
def dumped(flown_once):
    """What mavlogdump says of each packet of some kinds."""
    done = subprocess.run(
        [
            sys.executable, MAVLOGDUMP, "--dialect", "all", "--format", "json", "--show-source",
            "--types", "ODOMETRY,HEARTBEAT,SET_ATTITUDE_TARGET,STATUSTEXT",
            flown_once / "flight.tlog",
        ],
        check=True, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    return [json.loads(line) for line in done.stdout.splitlines()]


def ids(path):
    for record in read_tlog(path):
        assert record.raw[0] == 0xFD
        yield record, message_name(int.from_bytes(record.raw[7:10], "little"))


def test_mavlogdump_reads_every_packet_with_its_type_and_time(dumped, flown_once):
    kinds = {"ODOMETRY", "HEARTBEAT", "SET_ATTITUDE_TARGET", "STATUSTEXT"}
    expected = [(name, r) for r, name in ids(flown_once / "flight.tlog") if name in kinds]
    assert [line["meta"]["type"] for line in dumped] == [name for name, _ in expected]
    for line, (_, record) in zip(dumped, expected, strict=True):
        assert line["meta"]["timestamp"] == pytest.approx(record.time_us * 1e-6, abs=1e-5)
        assert line["meta"]["srcSystem"] == record.raw[5]


def test_mavlogdump_reads_what_was_flown(dumped, flown_once):
    control = [r.values for r in read_records(flown_once / "flight.mcap") if r.topic == "control"]
    thrusts = [line["data"]["thrust"] for line in dumped if "thrust" in line["data"]]
    sent = [c["thrust"] for c in control if c["sent"]]
    assert thrusts[-len(sent) :] == pytest.approx(sent, abs=1e-6)


def test_mavlogdump_finds_no_damage(flown_once):
    log = flown_once / "flight.tlog"
    done = subprocess.run(
        [sys.executable, MAVLOGDUMP, "--dialect", "all", "--show-types", log],
        check=True,
        capture_output=True,
        text=True,
        timeout=120,
    )
    types = set(done.stdout.split())
    assert "BAD_DATA" not in types
    found = {name for _, name in ids(flown_once / "flight.tlog")}
    known = {name for name in found if not name.startswith("message ")}
    assert known <= types
