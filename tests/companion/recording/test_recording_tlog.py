import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavutil

from companion.mavlink.codec import Packer
from companion.mavlink.messages import VehicleStateOfHealth, heartbeat
from companion.recording.tlog import TlogWriter, read_tlog

BASE_US = 1_700_000_000_000_000


def packets(count):
    packer = Packer(1)
    return [packer.pack(heartbeat(VehicleStateOfHealth.ACTIVE)) for _ in range(count)]


def written(path, count=20, base_us=BASE_US):
    log = TlogWriter(path, base_us)
    for number, raw in enumerate(packets(count)):
        log.write(0.1 * number, raw, sent=number % 2 == 1)
    return log


def test_packets_come_back_with_time_and_direction(tmp_path):
    written(tmp_path / "a.tlog").close()

    records = list(read_tlog(tmp_path / "a.tlog"))

    assert [record.raw for record in records] == packets(20)
    assert [record.sent for record in records] == [False, True] * 10
    for number, record in enumerate(records):
        assert 0 <= BASE_US + 100_000 * number - record.time_us < 4


def test_pymavlinks_own_reader_reads_it(tmp_path):
    written(tmp_path / "a.tlog").close()
    log = mavutil.mavlogfile(str(tmp_path / "a.tlog"))

    messages = []
    while (message := log.recv_msg()) is not None:
        messages.append(message)
    log.close()

    assert [message.get_type() for message in messages] == ["HEARTBEAT"] * 20
    assert [message.get_seq() for message in messages] == list(range(20))
    assert [message._link for message in messages] == [0, 1] * 10
    assert messages[7]._timestamp == pytest.approx(BASE_US / 1e6 + 0.7, abs=1e-5)


def test_what_is_flushed_is_in_the_file_though_it_is_not_closed(tmp_path):
    path = tmp_path / "a.tlog"
    log = written(path)
    assert os.path.getsize(path) == 0

    log.flush()

    assert len(list(read_tlog(path))) == 20
    log.close()


@settings(deadline=None, derandomize=True)
@given(st.integers(0, 20 * (8 + 18)))
def test_a_log_cut_off_anywhere_is_read_up_to_the_last_whole_packet(tmp_path_factory, length):
    path = tmp_path_factory.mktemp("cut") / "a.tlog"
    written(path).close()
    data = path.read_bytes()
    ends = [sum(8 + len(raw) for raw in packets(20)[: n + 1]) for n in range(20)]
    path.write_bytes(data[:length])

    assert len(list(read_tlog(path))) == sum(end <= length for end in ends)


def test_a_file_that_is_no_tlog_is_refused(tmp_path):
    path = tmp_path / "a.tlog"
    path.write_bytes(b"This is a text, and a text is no log.")

    with pytest.raises(ValueError, match="no whole tlog"):
        list(read_tlog(path))


def test_an_existing_log_is_never_written_over(tmp_path):
    path = tmp_path / "a.tlog"
    path.write_bytes(b"precious")

    with pytest.raises(FileExistsError):
        TlogWriter(path)

    assert path.read_bytes() == b"precious"
