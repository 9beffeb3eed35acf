"""EVENT and its companions; pymavlink does not know them, so the bytes are looked at."""

import struct
from itertools import pairwise

import pytest
from pymavlink.dialects.v20 import all as dialect

from sitl_shim.autopilot.px4.announcements import event_id
from sitl_shim.autopilot.px4.health_report import health_report
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import ARM, AUTO_LOITER, OFFBOARD, ShimClient, airborne

_EVENT, _SEQUENCE, _REQUEST, _ERROR = 410, 411, 412, 413
_SEEDS = {_EVENT: 160, _SEQUENCE: 106, _REQUEST: 33, _ERROR: 77}


def _payloads(client: ShimClient, message_id: int) -> list[bytes]:
    """Payloads, with the zeros that MAVLink 2 cuts off."""
    found = []
    for frame in client.frames():
        if frame[7:10] == message_id.to_bytes(3, "little"):
            end = 10 + frame[1]
            checksum = dialect.x25crc(frame[1:end])
            checksum.accumulate(bytes([_SEEDS[message_id]]))
            assert frame[end : end + 2] == struct.pack("<H", checksum.crc)
            found.append(frame[10:end].ljust(53, b"\0"))
    return found


def _events(client: ShimClient) -> list[tuple[int, int, int, bytes]]:
    """Id, sequence number, levels, arguments."""
    return [
        (*struct.unpack_from("<I4xH", payload), payload[12], payload[13:])
        for payload in _payloads(client, _EVENT)
    ]


def _names(client: ShimClient, *names: str) -> list[str]:
    by_id = {event_id(name): name for name in names}
    return [by_id[found[0]] for found in _events(client) if found[0] in by_id]


@pytest.fixture
def client() -> ShimClient:
    shim_client = ShimClient(ShimOptions(seed=1))
    shim_client.boot()
    return shim_client


@pytest.mark.parametrize(
    ("name", "little_endian"),
    [
        ("commander_armed_by", "f3ca9001"),
        ("commander_takeoff_detected", "69454101"),
        ("commander_failsafe_enter_generic", "d0dbde01"),
        ("commander_arming_check_summary", "e093a801"),
    ],
)
def test_ids_are_those_that_px4_was_recorded_with(name: str, little_endian: str) -> None:
    assert event_id(name).to_bytes(4, "little").hex() == little_endian


@pytest.mark.parametrize(
    ("stream", "mission", "recorded"),
    [
        (False, False, "00000010008000 0000b03a7f80b03a7f80"),
        (True, False, "00000000008000 0000b07a7f80b07a7f80"),
        (False, True, "00000010008000 0000b83a7f80b83a7f80"),
    ],
)
def test_the_summary_of_the_checks_is_as_recorded(
    stream: bool, mission: bool, recorded: str
) -> None:
    report = health_report(ready=True, stream=stream, mission=mission)
    assert report[0].arguments == bytes.fromhex(recorded)
    ids = {event.id for event in report}
    assert (event_id("check_modes_offboard_signal") in ids) is not stream
    assert (event_id("check_modes_mission") in ids) is not mission


def test_the_checks_are_reported_while_booting_and_whenever_they_change(
    client: ShimClient,
) -> None:
    summary = "commander_arming_check_summary"
    assert _names(client, summary) == [summary] * 2
    client.forget()
    client.start_stream()
    client.run(0.3)
    assert _names(client, summary) == [summary]


def test_a_flight_is_told_in_events(client: ShimClient) -> None:
    client.forget()
    client.command(ARM, 1)
    client.take_off()
    client.run(8.0)
    told = _names(
        client,
        "commander_armed_by",
        "navigator_takeoff_default_alt",
        "commander_takeoff_detected",
    )
    assert told == [
        "commander_armed_by",
        "navigator_takeoff_default_alt",
        "commander_takeoff_detected",
    ]
    (armed, *_) = [e for e in _events(client) if e[0] == event_id("commander_armed_by")]
    assert (armed[2], armed[3][0]) == (0x66, 4)
    assert client.texts() == [], "there is no ground station"


def test_the_failsafe_says_what_was_lost_and_what_is_done() -> None:
    client = airborne(parameters={"COM_OBL_RC_ACT": 5.0})
    stop = client.start_stream()
    client.run(0.3)
    client.set_mode(OFFBOARD)
    client.run(0.5)
    stop()
    client.run(2.0)
    (entered,) = [
        e for e in _events(client) if e[0] == event_id("commander_failsafe_enter_generic")
    ]
    assert entered[2] == 0x42
    assert struct.unpack_from("<IB", entered[3]) == (OFFBOARD, 5)
    assert client.simulation.autopilot.heartbeat.custom_mode == AUTO_LOITER


def test_sequence_numbers_run_on_and_overflow(client: ShimClient) -> None:
    numbers = [event[1] for event in _events(client)]
    assert numbers[0] == 65_527
    assert all((b - a) % 65_536 == 1 for a, b in pairwise(numbers))
    client.run(3.1)
    newest = struct.unpack_from("<H", _payloads(client, _SEQUENCE)[-1])[0]
    assert newest == _events(client)[-1][1]


def _request(client: ShimClient, first: int, last: int, *, damaged: bool = False) -> None:
    payload = struct.pack("<HHBB", first, last, 1, 1)
    body = struct.pack("<BBBBBB", len(payload), 0, 0, 9, 1, 191)
    body += _REQUEST.to_bytes(3, "little") + payload
    checksum = dialect.x25crc(body)
    checksum.accumulate(bytes([_SEEDS[_REQUEST]]))
    end = struct.pack("<H", checksum.crc ^ damaged)
    client.send_bytes(b"\xfd" + body + end)
    client.run(0.1)


def test_events_are_told_again_when_they_are_asked_for(client: ShimClient) -> None:
    before = _events(client)
    client.forget()
    _request(client, before[1][1], before[3][1])
    assert _events(client) == before[1:4]


def test_events_that_are_gone_are_an_error(client: ShimClient) -> None:
    oldest = _events(client)[0][1]
    client.forget()
    _request(client, 100, 101)
    errors = [struct.unpack_from("<HHBBB", p) for p in _payloads(client, _ERROR)]
    assert errors == [(100, oldest, 1, 191, 0), (101, oldest, 1, 191, 0)]


def test_a_damaged_request_is_none(client: ShimClient) -> None:
    first = _events(client)[0][1]
    client.forget()
    _request(client, first, first, damaged=True)
    assert _events(client) == []


def test_ardupilot_has_no_events() -> None:
    client = ShimClient(ShimOptions(autopilot="ardupilot", boot_scale=0.05))
    client.run(6.0)
    assert _payloads(client, _EVENT) == _payloads(client, _SEQUENCE) == []
