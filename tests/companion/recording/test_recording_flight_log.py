import errno
import math
import os
import signal
import subprocess
import sys
import tracemalloc

import pytest

from companion.mavlink.codec import Packer
from companion.mavlink.messages import VehicleStateOfHealth, heartbeat
from companion.recording import append_file
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME, FlightLog, FlightLogError
from companion.recording.mcap_log import read_records
from companion.recording.tlog import read_tlog

PACKET = Packer(1).pack(heartbeat(VehicleStateOfHealth.ACTIVE))


def fly(log, *, start_s=0.0, end_s=2.0):
    steps = round((end_s - start_s) * 100)
    for step in range(steps):
        time_s = start_s + 0.01 * step
        log.frame_in(time_s, PACKET)
        log.record("tick", time_s, {"time_s": time_s, "error_m": 0.001 * step})
        log.frame_out(time_s + 0.001, PACKET)


def test_a_flight_is_recorded_whole(tmp_path):
    log = FlightLog(tmp_path / "deep" / "flight")

    fly(log)
    log.close()
    log.close()

    packets = list(read_tlog(log.folder / TLOG_NAME))
    assert len(packets) == 400
    assert sum(packet.sent for packet in packets) == 200
    assert len(list(read_records(log.folder / MCAP_NAME))) == 200
    assert (log.trouble, log.lost) == (None, 0)


def test_the_same_flight_makes_the_same_bytes(tmp_path):
    for name in ("a", "b"):
        log = FlightLog(tmp_path / name, base_us=1_700_000_000_000_000)
        fly(log)
        log.close()

    for name in (TLOG_NAME, MCAP_NAME):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_while_flying_the_files_are_at_most_a_quarter_of_a_second_behind(tmp_path):
    log = FlightLog(tmp_path)

    fly(log, end_s=0.3)
    for step in range(3, 20):
        end_s = 0.1 * (step + 1)
        fly(log, start_s=0.1 * step, end_s=end_s)
        last_packet_s = list(read_tlog(tmp_path / TLOG_NAME))[-1].time_us / 1e6
        last_record_s = list(read_records(tmp_path / MCAP_NAME))[-1].time_s
        assert end_s - last_packet_s <= 0.25
        assert end_s - last_record_s <= 0.25
    log.close()


KILLED = """
import sys
import tracemalloc
from pathlib import Path
from companion.recording.flight_log import FlightLog
log = FlightLog(Path(sys.argv[1]))
packet = bytes.fromhex(sys.argv[2])
for step in range(300):
    log.frame_in(0.01 * step, packet)
    log.record("tick", 0.01 * step, {"step": step})
sys.stdout.write("flown")
sys.stdout.flush()
sys.stdin.read()
"""


def test_after_kill_9_both_files_are_readable_up_to_the_end(tmp_path):
    flight = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path), PACKET.hex()],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        assert flight.stdout.read(5) == b"flown"
    finally:
        flight.send_signal(signal.SIGKILL)
        flight.communicate()

    packets = list(read_tlog(tmp_path / TLOG_NAME))
    records = list(read_records(tmp_path / MCAP_NAME))
    assert [packet.raw for packet in packets] == [PACKET] * len(packets)
    assert [record.values["step"] for record in records] == list(range(len(records)))
    assert len(packets) >= 275
    assert len(records) >= 275


def test_a_folder_that_holds_a_flight_is_refused_and_left_alone(tmp_path):
    first = FlightLog(tmp_path)
    fly(first)
    first.close()
    before = (tmp_path / TLOG_NAME).read_bytes()

    with pytest.raises(FlightLogError, match=r"holds a flight's log already.*--out"):
        FlightLog(tmp_path)

    assert (tmp_path / TLOG_NAME).read_bytes() == before


@pytest.mark.parametrize("below", ["", "/sub"])
def test_a_file_in_the_folders_place_is_explained(tmp_path, below):
    (tmp_path / "taken").write_text("mine")

    with pytest.raises(FlightLogError, match=r"taken.*a file has that name.*--out"):
        FlightLog(tmp_path / f"taken{below}")


@pytest.mark.parametrize("code", [errno.EROFS, errno.EACCES, errno.ENOSPC])
def test_a_folder_that_cannot_be_written_is_explained(tmp_path, monkeypatch, code):
    def refuse(*_args, **_kwargs):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr("companion.recording.tlog.AppendFile", refuse)

    with pytest.raises(FlightLogError) as caught:
        FlightLog(tmp_path / "x")

    message = str(caught.value)
    assert os.strerror(code) in message
    assert str(tmp_path / "x") in message
    assert "--out" in message


class FullDisk:
    """Stands for the file of the system; takes so many bytes and then no more."""

    room = 10_000_000

    def __init__(self, path, mode):
        self._real = FullDisk.real(path, mode)

    def write(self, data):
        taken = min(len(data), FullDisk.room)
        if taken == 0 and data:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        FullDisk.room -= taken
        return self._real.write(data[:taken])

    def __getattr__(self, name):
        return getattr(self._real, name)


@pytest.fixture
def disk(monkeypatch):
    monkeypatch.setattr(FullDisk, "real", append_file.io.FileIO, raising=False)
    monkeypatch.setattr(append_file.io, "FileIO", FullDisk)
    monkeypatch.setattr(FullDisk, "room", 10_000_000)
    return FullDisk


def test_a_disk_that_fills_up_in_flight_does_not_disturb_the_flight(tmp_path, disk):
    log = FlightLog(tmp_path)
    fly(log, end_s=1.0)
    assert log.trouble is None

    disk.room = 137  # a part of the next write fits
    fly(log, start_s=1.0, end_s=2.0)
    log.close()

    assert TLOG_NAME in log.trouble
    assert os.strerror(errno.ENOSPC) in log.trouble
    assert log.lost > 0
    packets = list(read_tlog(tmp_path / TLOG_NAME))
    assert [packet.raw for packet in packets] == [PACKET] * len(packets)
    assert len(packets) >= 150
    assert (tmp_path / TLOG_NAME).stat().st_size == len(packets) * (8 + len(PACKET))
    assert len(list(read_records(tmp_path / MCAP_NAME))) >= 75


def test_a_disk_that_is_full_at_the_very_end_is_reported_by_close(tmp_path, disk):
    log = FlightLog(tmp_path)
    fly(log, end_s=0.1)

    disk.room = 0
    log.close()

    assert TLOG_NAME in log.trouble
    assert MCAP_NAME in log.trouble


@pytest.mark.parametrize("time_s", [math.nan, math.inf, -math.inf, -0.001, -1e9, 1e9, 1e300])
def test_impossible_times_are_refused_and_disturb_nothing(tmp_path, time_s):
    log = FlightLog(tmp_path)
    fly(log, end_s=0.5)

    log.frame_in(time_s, PACKET)
    log.frame_out(time_s, PACKET)
    log.record("tick", time_s, {"time_s": time_s, "error_m": 0.0})
    log.flush_if_due(time_s)
    fly(log, start_s=0.5, end_s=1.0)

    assert len(list(read_tlog(tmp_path / TLOG_NAME))) >= 150, "flushed as before"
    log.close()
    assert (log.trouble, log.lost) == (None, 3)
    assert len(list(read_tlog(tmp_path / TLOG_NAME))) == 200
    assert len(list(read_records(tmp_path / MCAP_NAME))) == 100


def test_a_record_that_cannot_be_encoded_is_lost_alone(tmp_path):
    class Unspeakable:
        def __str__(self):
            raise ValueError("no words")

    log = FlightLog(tmp_path)
    log.record("tick", 0.0, {"step": 1})
    log.record("tick", 0.1, {"step": Unspeakable()})
    log.record("tick", 0.2, {"step": 3})
    log.close()

    assert (log.trouble, log.lost) == (None, 1)
    assert [r.values["step"] for r in read_records(tmp_path / MCAP_NAME)] == [1, 3]


@pytest.mark.parametrize("method", ["flush", "close"])
@pytest.mark.parametrize("name", ["_tlog", "_mcap"])
@pytest.mark.parametrize(
    ("raised", "said"),
    [(ValueError("broken"), "ValueError: broken"), (MemoryError(), "written: MemoryError")],
)
def test_whatever_a_file_raises_gives_up_that_file_alone(
    tmp_path, monkeypatch, name, method, raised, said
):
    log = FlightLog(tmp_path)
    fly(log, end_s=0.1)

    def fail(_self):
        raise raised

    monkeypatch.setattr(type(getattr(log, name)), method, fail)
    log.close()
    log.close()

    broken, whole = (TLOG_NAME, MCAP_NAME) if name == "_tlog" else (MCAP_NAME, TLOG_NAME)
    assert said in log.trouble
    assert broken in log.trouble
    assert whole not in log.trouble


def test_an_hour_of_flight_takes_no_more_memory_than_a_minute(tmp_path):
    log = FlightLog(tmp_path)
    fly(log, end_s=20.0)
    tracemalloc.start()
    try:
        fly(log, start_s=20.0, end_s=40.0)
        before = tracemalloc.get_traced_memory()[0]
        fly(log, start_s=40.0, end_s=240.0)
        grown = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    log.close()

    assert grown * 3600.0 / 200.0 < 0.3 * 2**20
