"""Microservices: commands, requests, time, ping, texts, addressing, forwarding."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.autopilot.interface import StatusText
from sitl_shim.mavlink.statustext import status_messages
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import ARM, ShimClient

_REQUEST = 512
_BOTH = (LinkKind.ONBOARD, LinkKind.GROUND_STATION)


@pytest.fixture
def client() -> ShimClient:
    shim_client = ShimClient(ShimOptions(seed=1, airborne_at_enu_m=(0.0, 0.0, 30.0)))
    shim_client.run_until(0.5)
    shim_client.forget()
    return shim_client


@pytest.mark.parametrize(
    ("message_id", "name"),
    [
        (148, "AUTOPILOT_VERSION"),
        (242, "HOME_POSITION"),
        (49, "GPS_GLOBAL_ORIGIN"),
        (245, "EXTENDED_SYS_STATE"),
        (436, "CURRENT_MODE"),
        (1, "SYS_STATUS"),
        (147, "BATTERY_STATUS"),
        (230, "ESTIMATOR_STATUS"),
        (437, "AVAILABLE_MODES_MONITOR"),
    ],
)
def test_a_requested_message_comes_before_its_acknowledgement(
    client: ShimClient, message_id: int, name: str
) -> None:
    client.command(_REQUEST, message_id)
    client.run(0.05)
    names = [message.get_type() for _, message in client.inbox()]
    assert name in names[: names.index("COMMAND_ACK")]
    assert client.acks(_REQUEST) == [0]


@pytest.mark.parametrize("message_id", [253, 12915, 127])
def test_a_message_that_is_not_available_is_denied(client: ShimClient, message_id: int) -> None:
    client.command(_REQUEST, message_id)
    client.run(0.05)
    assert client.acks(_REQUEST) == [2]


def test_autopilot_version_says_what_px4_says(client: ShimClient) -> None:
    client.command(520, 1)
    client.run(0.05)
    version = client.last("AUTOPILOT_VERSION")
    assert version.capabilities == 0xE8FF
    assert version.flight_sw_version == 17891392
    assert client.acks(520) == [0]


def test_protocol_version_is_the_frame_that_px4_sent() -> None:
    client = ShimClient(ShimOptions(truth=False))
    client.run_until(1.0)
    client.command(519, 1)
    frames: list[bytes] = []
    for _ in range(10):
        frames += [datagram.data for datagram in client.shim.step()]
    payload = "c8006400cb0000000000000000007f64b93802fe01b4"
    (frame,) = [data for data in frames if data[7:10] == (300).to_bytes(3, "little")]
    assert frame[10:-2].hex() == payload


def test_available_modes_are_listed_whole_or_one_by_one(client: ShimClient) -> None:
    client.command(_REQUEST, 435, 0)
    client.run(0.05)
    rows = client.messages("AVAILABLE_MODES")
    assert [row.mode_index for row in rows] == list(range(1, rows[0].number_modes + 1))
    by_mode = {row.custom_mode: row for row in rows}
    assert by_mode[0x00060000].mode_name == "Offboard"
    assert by_mode[0x05040000].standard_mode == 5
    client.forget()
    client.command(_REQUEST, 435, 3)
    client.run(0.05)
    assert client.messages("AVAILABLE_MODES") == [rows[2]] or (
        client.last("AVAILABLE_MODES").to_dict() == rows[2].to_dict()
    )


@pytest.mark.parametrize("command", [31999, 16, 224, 241])
def test_an_unknown_command_is_unsupported(client: ShimClient, command: int) -> None:
    client.command(command, 1)
    client.run(0.05)
    assert client.acks(command) == [3]


def test_acknowledgements_come_after_5_to_15_ms_and_name_their_sender() -> None:
    client = ShimClient(ShimOptions(vehicle="sih_quadx"), component=42)
    client.run_until(5.0)
    client.command(ARM, 1)
    sent_s = client.time_s
    client.run(0.1)
    ((received_s, ack),) = client.received("COMMAND_ACK")
    assert 0.005 <= received_s - sent_s <= 0.015
    assert (ack.target_system, ack.target_component) == (1, 42)


@pytest.mark.parametrize("target", [(2, 1), (1, 100), (1, 191)])
def test_commands_for_others_meet_silence(client: ShimClient, target: tuple[int, int]) -> None:
    client.command(_REQUEST, 148, target=target)
    client.run(0.1)
    assert client.messages("COMMAND_ACK") == []


def test_component_0_is_answered(client: ShimClient) -> None:
    client.command(_REQUEST, 148, target=(1, 0))
    client.run(0.1)
    assert client.acks(_REQUEST) == [0]


@settings(deadline=None, derandomize=True, max_examples=60)
@given(
    autopilot=st.sampled_from(["px4", "ardupilot"]),
    command=st.one_of(
        st.sampled_from([20, 21, 22, 176, 178, 192, 224, 300, 400, 510, 511, 512, 519, 520]),
        st.integers(0, 65535),
    ),
    parameters=st.lists(
        st.one_of(
            st.floats(width=32, allow_nan=True, allow_infinity=True), st.sampled_from([1.0, 6.0])
        ),
        min_size=7,
        max_size=7,
    ),
)
def test_every_command_is_acknowledged_whatever_its_parameters(
    autopilot: str, command: int, parameters: list[float]
) -> None:
    client = ShimClient(ShimOptions(autopilot=autopilot, airborne_at_enu_m=(0.0, 0.0, 30.0)))
    client.run(0.5)
    client.command(command, *parameters)
    client.run(0.3)
    assert client.acks(command)


@settings(deadline=None, derandomize=True, max_examples=100)
@given(noise=st.binary(max_size=300))
def test_noise_never_stops_it(noise: bytes) -> None:
    client = ShimClient(ShimOptions())
    client.run(0.5)
    client.send_bytes(noise)
    client.send_bytes(bytes(600))  # whatever frame the noise began has ended
    client.command(_REQUEST, 148)
    client.run(0.1)
    assert client.acks(_REQUEST) == [0]


def test_timesync_is_answered_with_the_boot_time() -> None:
    client = ShimClient(ShimOptions(vehicle="sih_quadx"))
    client.run_until(2.0)
    client.forget()
    client.send(dialect.MAVLink_timesync_message(0, 123456789))
    client.run(0.01)
    (answer,) = [m for m in client.messages("TIMESYNC") if m.tc1 != 0]
    assert answer.ts1 == 123456789
    assert answer.tc1 / 1e9 == pytest.approx(2.0, abs=0.01)


def test_answers_to_its_own_timesync_are_not_answered(client: ShimClient) -> None:
    client.send(dialect.MAVLink_timesync_message(5, 6))
    client.run(0.1)
    assert all(m.tc1 == 0 for m in client.messages("TIMESYNC"))


def test_its_own_timesync_carries_the_boot_time(client: ShimClient) -> None:
    client.run(1.0)
    for time_s, message in client.received("TIMESYNC"):
        assert message.tc1 == 0
        assert message.ts1 / 1e9 == pytest.approx(time_s - 0.015, abs=1e-6)


def test_ping_to_everybody_is_answered_to_its_sender(client: ShimClient) -> None:
    client.send(dialect.MAVLink_ping_message(77, 5, 0, 0))
    client.run(0.1)
    (answer,) = [m for m in client.messages("PING") if m.target_system != 0]
    assert (answer.time_usec, answer.seq) == (77, 5)
    assert (answer.target_system, answer.target_component) == (1, 191)


@pytest.mark.parametrize(
    ("request_hex", "reply_hex"),
    [
        # As MAVProxy asks a real PX4, and is refused: "@PARAM/param.pck" is not there.
        ("0000790410000000000000004050415241", "01007981010400000000000" + "00a00000000"),
        ("01007901000000000000000000", "02007981010100000000000004"),
    ],
)
def test_files_are_refused_at_once(client: ShimClient, request_hex: str, reply_hex: str) -> None:
    payload = bytes.fromhex(request_hex).ljust(251, b"\0")
    client.send(dialect.MAVLink_file_transfer_protocol_message(0, 1, 1, payload))
    client.run(0.1)
    reply = bytes(client.last("FILE_TRANSFER_PROTOCOL").payload)
    assert reply == bytes.fromhex(reply_hex).ljust(251, b"\0")


# --- texts ---


def test_texts_go_only_to_links_with_a_ground_stations_heartbeat() -> None:
    client = ShimClient(ShimOptions(), _BOTH)
    client.every(1.0, lambda: client.heartbeat(18, link=0))
    client.every(1.0, lambda: client.heartbeat(6, link=1))
    client.boot()
    client.command(ARM, 1)
    client.run(0.2)
    assert client.texts(link=0) == []
    assert client.texts(link=1) == [
        "[logger] ./log/2026-01-01/00_00_02.ulg\t",
        "Armed by external command\t",
    ]


@settings(deadline=None, derandomize=True)
@given(text=st.text(st.characters(codec="ascii", exclude_characters="\x00"), max_size=180))
def test_chunks_put_together_are_the_text(text: str) -> None:
    chunks = list(status_messages(StatusText(2, text), 9))
    assert "".join(chunk.text for chunk in chunks) == text
    assert [chunk.chunk_seq for chunk in chunks] == list(range(len(chunks)))
    assert all(len(chunk.text) <= 50 and chunk.id == 9 for chunk in chunks)


# --- several links ---


def test_a_ground_stations_heartbeat_is_forwarded_to_the_companion() -> None:
    client = ShimClient(ShimOptions(), _BOTH)
    client.run_until(1.0)
    client.forget()
    client.heartbeat(6, link=1)
    client.run(0.1)
    (beat,) = client.messages("HEARTBEAT", component=191, link=0)
    assert beat.type == 6
    assert client.messages("HEARTBEAT", component=191, link=1) == []


def test_each_link_has_its_own_rates() -> None:
    client = ShimClient(ShimOptions(), _BOTH)
    client.run_until(1.0)
    client.set_interval(30, -1)  # on the onboard link
    client.run(0.1)
    client.forget()
    client.run(1.0)
    assert client.messages("ATTITUDE", link=0) == []
    assert len(client.messages("ATTITUDE", link=1)) == pytest.approx(50, abs=1)


def test_frames_of_a_link_are_numbered_without_gaps(client: ShimClient) -> None:
    client.run(2.0)
    for component in (1, 240):
        numbers = [frame[4] for frame in client.frames() if frame[6] == component]
        assert all((b - a) % 256 == 1 for a, b in itertools.pairwise(numbers))


def test_another_system_id_is_used_throughout() -> None:
    client = ShimClient(ShimOptions(system_id=7))
    client.run_until(1.0)
    client.command(_REQUEST, 148, target=(7, 1))
    client.command(_REQUEST, 148, target=(1, 1))
    client.run(0.1)
    assert client.acks(_REQUEST) == [0]
    assert {m.get_srcSystem() for _, m in client.inbox()} == {7}
    assert not math.isnan(client.last("ATTITUDE").roll)
