"""Logs that were cut off or damaged: what is whole is saved, and what is not is said."""

import random
import shutil

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import Writer
from pymavlink import mavutil

from companion.commands.recover import RecoverRequest, run_recover
from companion.mavlink.codec import Packer
from companion.mavlink.messages import VehicleStateOfHealth, heartbeat
from companion.recording.mcap_log import McapLog, read_records
from companion.recording.mcap_parts import MAGIC
from companion.recording.schema import ChannelSpec, Field
from companion.recording.tlog import TlogWriter, read_tlog

BASE_US = 1_700_000_000_000_000
TICK = ChannelSpec("tick", (Field("step", "integer"), Field("noise", "array")))
CHUNKS, PER_CHUNK = 60, 10
PAGE = 4096


def steps(path):
    return [record.values["step"] for record in read_records(path) if record.topic == "tick"]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A finished log of twelve seconds, the same before it was finished, and a tlog."""
    folder = tmp_path_factory.mktemp("flown")
    log = McapLog(folder / "finished.mcap", [TICK], BASE_US)
    draw = random.Random(1)
    for step in range(CHUNKS * PER_CHUNK):
        log.write("tick", 0.02 * step, {"step": step, "noise": [draw.random() for _ in range(9)]})
        if step % 50 == 7:
            log.write("event", 0.02 * step, {"text": f"said {step}"})
        if step % PER_CHUNK == PER_CHUNK - 1:
            log.flush()
    shutil.copy(folder / "finished.mcap", folder / "killed.mcap")
    log.close()
    tlog = TlogWriter(folder / "flight.tlog", BASE_US)
    packer = Packer(1)
    for number in range(400):
        raw = packer.pack(heartbeat(VehicleStateOfHealth.ACTIVE))
        tlog.write(0.02 * number, raw, sent=number % 2 == 1)
    tlog.close()
    return folder


@pytest.fixture
def recover(tmp_path, capsys):
    """Put bytes into a file, recover it, and give the exit status, the words, the new file."""

    def run(data, name="flight.mcap"):
        path = tmp_path / name
        path.write_bytes(data)
        status = run_recover(RecoverRequest(path))
        assert path.read_bytes() == data, "the original stays as it is"
        stem, _, ending = name.rpartition(".")
        said = capsys.readouterr()
        return status, said.out + said.err, tmp_path / f"{stem}.recovered.{ending}"

    return run


def assert_is_whole_and_indexed(path, count):
    """By the library's own reader, which seeks by the index."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        ticks = sum(1 for _ in reader.iter_messages(topics=["tick"]))
        file.seek(0)
        read = sum(1 for _ in NonSeekingReader(file, validate_crcs=True).iter_messages())
    found = {summary.channels[number].topic: n for number, n in
             summary.statistics.channel_message_counts.items()}  # fmt: skip
    assert found["tick"] == ticks == count
    assert summary.statistics.message_count == read
    assert summary.statistics.chunk_count == len(summary.chunk_indexes)


def test_a_finished_log_is_said_to_be_whole_and_nothing_is_written(flown, recover):
    status, said, out = recover((flown / "finished.mcap").read_bytes())

    assert status == 0
    assert "612 records from 2023-11-14 22:13:20.000Z to 2023-11-14 22:13:31.980Z (11.98 s)" in said
    assert "it is whole" in said
    assert not out.exists()


def test_a_killed_log_gets_its_index(flown, recover):
    data = (flown / "killed.mcap").read_bytes()

    status, said, out = recover(data)

    assert status == 0
    assert "612 records" in said
    assert "no index" in said
    assert "cut off" not in said
    assert str(out) in said
    assert_is_whole_and_indexed(out, CHUNKS * PER_CHUNK)
    assert list(read_records(out)) == list(read_records(flown / "finished.mcap"))


def test_what_recover_writes_is_whole(flown, recover, tmp_path, capsys):
    _, _, out = recover((flown / "killed.mcap").read_bytes()[:-100])

    assert run_recover(RecoverRequest(out)) == 0

    assert "it is whole" in capsys.readouterr().out


def test_a_write_that_was_under_way_is_cut_off_and_told(flown, recover):
    data = (flown / "killed.mcap").read_bytes()

    status, said, out = recover(data[:-400])

    assert status == 0
    assert "cut off at the end: " in said
    read = steps(out)
    assert read == list(range(len(read)))
    assert CHUNKS * PER_CHUNK - 2 * PER_CHUNK <= len(read) < CHUNKS * PER_CHUNK
    assert_is_whole_and_indexed(out, len(read))


def test_zeros_at_the_end_are_no_records_and_no_error(flown, recover, tmp_path):
    data = (flown / "killed.mcap").read_bytes() + bytes(2 * PAGE)
    path = tmp_path / "zeros.mcap"
    path.write_bytes(data)
    assert steps(path) == list(range(CHUNKS * PER_CHUNK))

    status, said, out = recover(data)

    assert status == 0
    assert f"cut off at the end: {2 * PAGE:,} bytes" in said
    assert "all zeros" in said
    assert steps(out) == list(range(CHUNKS * PER_CHUNK))


def test_pieces_that_were_half_written_in_the_middle_are_skipped(flown, recover):
    data = (flown / "killed.mcap").read_bytes()
    third = len(data) // 3
    torn = data[: third + 33] + data[third - 500 : 2 * third] + data[2 * third + 700 :]

    status, said, out = recover(torn)

    assert status == 0
    assert said.count("lost: ") == 2
    read = steps(out)
    assert sorted(set(read)) == sorted(read), "no record twice"
    assert len(read) >= CHUNKS * PER_CHUNK - 5 * PER_CHUNK


@settings(deadline=None, derandomize=True, max_examples=60)
@given(st.data())
def test_damage_anywhere_costs_only_the_chunks_that_it_hits(flown, tmp_path_factory, data):
    finished = data.draw(st.booleans())
    original = (flown / ("finished.mcap" if finished else "killed.mcap")).read_bytes()
    damaged = bytearray(original)
    if data.draw(st.booleans()):
        place = data.draw(st.integers(0, len(original) - 1))
        damaged[place] ^= data.draw(st.integers(1, 255))
    else:
        place = data.draw(st.integers(0, (len(original) - 1) // PAGE)) * PAGE
        damaged[place : place + PAGE] = bytes(len(original[place : place + PAGE]))
    path = tmp_path_factory.mktemp("damaged") / "flight.mcap"
    path.write_bytes(damaged)

    status = run_recover(RecoverRequest(path))

    out = path.with_name("flight.recovered.mcap")
    if not out.exists():  # a byte without meaning
        assert status == 0
        assert steps(path) == list(range(CHUNKS * PER_CHUNK))
        return
    assert status == 0
    read = steps(out)
    assert read == sorted(set(read))
    chunk = len(original) / CHUNKS
    hit = PAGE / chunk
    assert len(read) >= CHUNKS * PER_CHUNK - (hit + 2) * PER_CHUNK
    assert_is_whole_and_indexed(out, len(read))


@settings(deadline=None, derandomize=True, max_examples=60)
@given(st.data())
def test_reading_a_damaged_log_gives_what_was_written_or_says_that_it_is_damaged(
    flown, tmp_path_factory, data
):
    damaged = bytearray((flown / "finished.mcap").read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("damaged") / "flight.mcap"
    path.write_bytes(damaged[: data.draw(st.integers(0, len(damaged)))])

    read = []
    try:
        for record in read_records(path):
            read.append(record)
    except McapError:
        pass

    written = list(read_records(flown / "finished.mcap"))
    assert [record.values for record in read] == [record.values for record in written[: len(read)]]


@pytest.mark.parametrize("size", range(len(MAGIC) + 1))
def test_a_file_shorter_than_its_magic_bytes_holds_nothing(tmp_path, recover, size):
    path = tmp_path / "short.mcap"
    path.write_bytes(MAGIC[:size])
    assert list(read_records(path)) == []

    status, said, out = recover(MAGIC[:size])

    assert status == 1
    assert "nothing in it is whole" in said
    assert not out.exists()


@pytest.mark.parametrize("data", [b"", b"junk" * 500])
def test_an_index_that_was_not_made_is_not_told(recover, data):
    status, said, out = recover(data)

    assert status == 1
    assert "nothing was written" in said
    assert "one was made" not in said
    assert not out.exists()


def test_a_damaged_chunk_names_the_remedy_to_who_reads_it(flown, tmp_path):
    data = bytearray((flown / "finished.mcap").read_bytes())
    data[len(data) // 2] ^= 1
    path = tmp_path / "flight.mcap"
    path.write_bytes(data)

    with pytest.raises(McapError, match=r"damaged: the record at byte \d+ .*companion recover"):
        list(read_records(path))


def test_a_chunk_that_claims_terabytes_takes_no_memory(flown, tmp_path):
    data = bytearray((flown / "killed.mcap").read_bytes())
    place = data.find(b"\x04\0\0\0zstd")
    data[place - 12 : place - 4] = (1 << 42).to_bytes(8, "little")
    path = tmp_path / "flight.mcap"
    path.write_bytes(data)

    with pytest.raises(McapError, match=f"says that it holds {1 << 42} bytes"):
        list(read_records(path))


def test_another_programs_file_is_refused(tmp_path, recover):
    path = tmp_path / "foreign.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(library="another")
        schema = writer.register_schema("s", "jsonschema", b"{}")
        channel = writer.register_channel("c", "json", schema)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()

    status, said, _ = recover(path.read_bytes())

    assert status == 2
    assert "written by 'another'" in said


class TestTlog:
    def test_a_whole_one_is_said_to_be_whole(self, flown, recover):
        status, said, out = recover((flown / "flight.tlog").read_bytes(), "flight.tlog")

        assert status == 0
        assert "400 packets" in said
        assert "it is whole" in said
        assert not out.exists()

    @pytest.mark.parametrize("cut", [1, 8, 11, 25])
    def test_it_is_trimmed_to_whole_packets(self, flown, recover, cut):
        data = (flown / "flight.tlog").read_bytes()

        status, said, out = recover(data[:-cut], "flight.tlog")

        assert status == 0
        assert "399 packets" in said
        assert "cut off at the end" in said
        assert out.read_bytes() == data[: len(data) // 400 * 399]

    @settings(deadline=None, derandomize=True, max_examples=60)
    @given(st.data())
    def test_damage_anywhere_costs_only_the_packets_that_it_hits(
        self, flown, tmp_path_factory, data
    ):
        original = (flown / "flight.tlog").read_bytes()
        size = data.draw(st.integers(1, 500))
        place = data.draw(st.integers(0, len(original) - 1))
        noise = data.draw(st.one_of(st.just(bytes(size)), st.binary(min_size=size, max_size=size)))
        damaged = (original[:place] + noise + original[place + size :])[: len(original)]
        path = tmp_path_factory.mktemp("damaged") / "flight.tlog"
        path.write_bytes(damaged)

        run_recover(RecoverRequest(path))

        out = path.with_name("flight.recovered.tlog")
        packets = list(read_tlog(out if out.exists() else path))
        written = [packet.raw for packet in read_tlog(flown / "flight.tlog")]
        hit = size / (len(original) / 400)
        assert len(packets) >= 400 - hit - 2
        raws = [packet.raw for packet in packets]
        before = next((i for i, (a, b) in enumerate(zip(raws, written, strict=False)) if a != b),
                      len(raws))  # fmt: skip
        assert raws[before:] == written[len(written) - len(raws) + before :]

    @pytest.mark.parametrize("byte", range(5))
    @pytest.mark.parametrize("record", [1, 200, 398])
    def test_a_time_that_leaps_against_those_around_it_is_lost(self, flown, recover, record, byte):
        data = (flown / "flight.tlog").read_bytes()
        size = len(data) // 400
        damaged = bytearray(data)
        damaged[record * size + byte] ^= 0x04

        status, said, out = recover(bytes(damaged), "flight.tlog")

        assert status == 0
        assert "399 packets" in said
        assert f"lost: {size} bytes at byte {record * size:,}: up to 0.04 s" in said
        assert out.read_bytes() == data[: record * size] + data[(record + 1) * size :]

    @pytest.mark.parametrize("step_s", [-3600.0, -2.0, -0.5, -0.3, 0.5, 3600.0])
    def test_a_clock_that_was_set_costs_nothing(self, tmp_path, capsys, step_s):
        log = TlogWriter(tmp_path / "flight.tlog", BASE_US)
        raw = Packer(1).pack(heartbeat(VehicleStateOfHealth.ACTIVE))
        for number in range(20):
            log.write(0.2 * number + (step_s if number >= 10 else 0.0), raw, sent=False)
        log.close()

        assert run_recover(RecoverRequest(tmp_path / "flight.tlog")) == 0

        assert "20 packets" in (said := capsys.readouterr().out)
        assert "it is whole" in said

    def test_pymavlink_reads_what_was_recovered_to_the_end(self, flown, recover):
        data = bytearray((flown / "flight.tlog").read_bytes())
        data[3000:5000] = bytes(2000)

        status, said, out = recover(bytes(data[:-3]), "flight.tlog")

        assert status == 0
        assert said.count("lost: ") == 1
        assert said.count("cut off at the end") == 1
        log = mavutil.mavlogfile(str(out))
        last = None
        while (message := log.recv_msg()) is not None:
            last = message
        log.close()
        assert last.get_type() == "HEARTBEAT"
        assert last._timestamp == pytest.approx(BASE_US / 1e6 + 0.02 * 398, abs=1e-5)


class TestCommand:
    def folder_with(self, tmp_path, flown):
        folder = tmp_path / "flight"
        folder.mkdir()
        shutil.copy(flown / "killed.mcap", folder / "flight.mcap")
        shutil.copy(flown / "flight.tlog", folder / "flight.tlog")
        return folder

    def test_a_folder_is_recovered_log_by_log(self, flown, tmp_path, capsys):
        folder = self.folder_with(tmp_path, flown)

        assert run_recover(RecoverRequest(folder)) == 0

        said = capsys.readouterr().out
        assert "flight.mcap: 612 records" in said
        assert "flight.tlog: 400 packets" in said
        assert sorted(path.name for path in folder.iterdir()) == [
            "flight.mcap",
            "flight.recovered.mcap",
            "flight.tlog",
        ]

    def test_nothing_is_ever_written_over(self, flown, tmp_path, capsys):
        folder = self.folder_with(tmp_path, flown)
        taken = folder / "flight.recovered.mcap"
        taken.write_bytes(b"precious")

        assert run_recover(RecoverRequest(folder)) == 2

        assert "exists already" in capsys.readouterr().err
        assert taken.read_bytes() == b"precious"
        elsewhere = tmp_path / "elsewhere.mcap"
        assert run_recover(RecoverRequest(folder / "flight.mcap", elsewhere)) == 0
        assert_is_whole_and_indexed(elsewhere, CHUNKS * PER_CHUNK)

    def test_a_log_that_is_refused_leaves_the_other_to_be_recovered(self, flown, tmp_path, capsys):
        folder = self.folder_with(tmp_path, flown)
        (folder / "flight.recovered.mcap").write_bytes(b"precious")
        tlog = (flown / "flight.tlog").read_bytes()
        (folder / "flight.tlog").write_bytes(tlog[:-1])

        assert run_recover(RecoverRequest(folder)) == 2

        said = capsys.readouterr()
        assert "flight.recovered.mcap exists already" in said.err
        assert "flight.tlog: 399 packets" in said.out
        assert (folder / "flight.recovered.tlog").read_bytes() == tlog[: len(tlog) // 400 * 399]

    @pytest.mark.parametrize("tlog", [b"", b"no packet"])
    def test_of_two_logs_the_worse_one_gives_the_status(self, flown, tmp_path, tlog):
        folder = self.folder_with(tmp_path, flown)
        (folder / "flight.tlog").write_bytes(tlog)

        assert run_recover(RecoverRequest(folder)) == 1

        assert_is_whole_and_indexed(folder / "flight.recovered.mcap", CHUNKS * PER_CHUNK)

    def test_a_place_that_cannot_be_written_leaves_nothing(self, flown, tmp_path, capsys):
        folder = self.folder_with(tmp_path, flown)

        status = run_recover(RecoverRequest(folder / "flight.mcap", tmp_path / "no" / "x.mcap"))

        assert status == 2
        said = capsys.readouterr()
        assert "--out" in said.err
        assert "612 records" in said.out
        assert "one was made" not in said.out

    @pytest.mark.parametrize(
        ("name", "why"),
        [
            ("", "holds neither flight.mcap nor flight.tlog"),
            ("gone.mcap", "cannot be read: No such file"),
            ("notes.txt", "a log ends in .mcap or .tlog"),
        ],
    )
    def test_what_is_no_log_is_explained(self, tmp_path, capsys, name, why):
        assert run_recover(RecoverRequest(tmp_path / name)) == 2
        assert why in capsys.readouterr().err

    def test_one_name_for_two_files_is_refused(self, flown, tmp_path, capsys):
        folder = self.folder_with(tmp_path, flown)

        assert run_recover(RecoverRequest(folder, tmp_path / "x.mcap")) == 2

        assert "--out names one file" in capsys.readouterr().err


def test_the_librarys_reader_gives_all_of_a_killed_log(flown):
    with (flown / "killed.mcap").open("rb") as file:
        found = NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False)
        numbers = [next(found)[2].log_time for _ in range(CHUNKS * PER_CHUNK + 12)]
        with pytest.raises(EndOfFile):  # where the end of a finished one would be
            next(found)
    assert numbers[-1] == BASE_US * 1000 + 11_980_000_000
