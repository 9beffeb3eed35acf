"""The log protocol, and what stands in the logs."""

import struct
from itertools import pairwise
from pathlib import Path

import pytest
from pymavlink import DFReader

from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import ARM, ShimClient

_SET_MODE, _TAKEOFF = 176, 22


def _entries(client: ShimClient) -> list[tuple[int, int, int]]:
    client.forget()
    client.send(dialect.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    client.run(0.2)
    return [(m.id, m.num_logs, m.size) for m in client.messages("LOG_ENTRY")]


def _download(client: ShimClient, log_id: int, offset: int = 0, count: int = 2**32 - 1) -> bytes:
    client.forget()
    client.send(dialect.MAVLink_log_request_data_message(1, 1, log_id, offset, count))
    client.run(2.0)
    content = b""
    for piece in client.messages("LOG_DATA"):
        assert piece.ofs == offset + len(content), "in order, without gaps"
        content += bytes(piece.data[: piece.count])
    return content


@pytest.fixture
def flown() -> ShimClient:
    """A PX4 that has taken off."""
    client = ShimClient(ShimOptions(seed=1))
    client.boot()
    client.command(ARM, 1)
    client.take_off()
    client.run(10.0)
    return client


def _messages(content: bytes) -> list[tuple[str, bytes]]:
    """The messages of a ULog file, after its header of 16 bytes."""
    found, at = [], 16
    while at < len(content):
        size, kind = struct.unpack_from("<Hc", content, at)
        found.append((kind.decode(), content[at + 3 : at + 3 + size]))
        at += 3 + size
    assert at == len(content), "nothing is cut off"
    return found


def test_the_ulog_holds_the_flight(flown: ShimClient) -> None:
    ((log_id, count, size),) = _entries(flown)
    assert (log_id, count) == (0, 1)
    content = _download(flown, log_id, count=size)
    assert len(content) == size
    assert content[:8] == b"ULog\x01\x12\x35\x01"
    assert struct.unpack_from("<Q", content, 8) == (2_000_000,)
    messages = _messages(content)
    subscriptions = {
        body[3:].decode(): struct.unpack_from("<H", body, 1)[0]
        for kind, body in messages
        if kind == "A"
    }
    formats = {body.split(b":")[0].decode() for kind, body in messages if kind == "F"}
    assert set(subscriptions) == formats
    wanted = subscriptions["vehicle_local_position"]
    rows = [
        struct.unpack("<Q6f", body[2:])
        for kind, body in messages
        if kind == "D" and struct.unpack_from("<H", body)[0] == wanted
    ]
    assert {b[0] - a[0] for a, b in pairwise(rows)} == {100_000}
    assert rows[0][3] == pytest.approx(0.0, abs=0.05)
    assert rows[-1][3] == pytest.approx(-flown.simulation.state.position_enu_m[2], abs=0.5)


def test_a_part_of_a_log_can_be_asked_for(flown: ShimClient) -> None:
    ((log_id, _, size),) = _entries(flown)
    whole = _download(flown, log_id, count=size)
    assert _download(flown, log_id, 100, 1000) == whole[100:1100]
    flown.forget()
    flown.send(dialect.MAVLink_log_request_data_message(1, 1, log_id, 2**31, 90))
    flown.run(0.1)
    assert [m.count for m in flown.messages("LOG_DATA")] == [0]


def test_a_download_ends_when_it_is_told_to(flown: ShimClient) -> None:
    ((log_id, _, _),) = _entries(flown)
    flown.send(dialect.MAVLink_log_request_data_message(1, 1, log_id, 0, 2**32 - 1))
    flown.run(0.03)
    flown.send(dialect.MAVLink_log_request_end_message(1, 1))
    flown.run(0.1)
    flown.forget()
    flown.run(0.2)
    assert flown.messages("LOG_DATA") == []


def test_logs_of_others_and_logs_that_are_not_meet_silence(flown: ShimClient) -> None:
    flown.forget()
    flown.send(dialect.MAVLink_log_request_list_message(2, 1, 0, 0xFFFF))
    flown.send(dialect.MAVLink_log_request_data_message(1, 1, 77, 0, 90))
    flown.run(0.2)
    assert flown.messages("LOG_ENTRY") == flown.messages("LOG_DATA") == []


def test_erasing_begins_anew(flown: ShimClient) -> None:
    ((_, _, size),) = _entries(flown)
    flown.send(dialect.MAVLink_log_erase_message(1, 1))
    flown.run(0.3)
    ((log_id, count, new_size),) = _entries(flown)
    assert (log_id, count) == (0, 1)
    assert new_size < size / 4


def test_before_the_first_log_there_is_an_empty_list() -> None:
    client = ShimClient(ShimOptions())
    client.run_until(1.0)
    assert _entries(client) == [(0, 0, 0)]


def test_ardupilots_log_is_read_by_pymavlink(tmp_path: Path) -> None:
    client = ShimClient(ShimOptions(autopilot="ardupilot", boot_scale=0.05, seed=1))
    client.run_until(6.0)
    client.command(_SET_MODE, 1, 4)
    client.run(0.3)
    client.command(ARM, 1)
    client.run(0.3)
    client.command(_TAKEOFF, 0, 0, 0, 0, 0, 0, 4.0)
    client.run(9.0)
    ((log_id, _, size),) = _entries(client)
    assert log_id == 1
    file = tmp_path / "1.bin"
    file.write_bytes(_download(client, log_id, count=size))
    reader = DFReader.DFReader_binary(str(file))
    try:
        rows = []
        while (message := reader.recv_match(type="NKF")) is not None:
            rows.append(message)
    finally:
        reader.close()
    assert pytest.approx(-client.simulation.state.position_enu_m[2], abs=0.3) == rows[-1].PD
    assert {b.TimeUS - a.TimeUS for a, b in pairwise(rows)} == {100_000}
