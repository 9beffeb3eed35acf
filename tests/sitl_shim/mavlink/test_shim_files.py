"""MAVLink FTP: what is there, what is refused, and the parameter file."""

import struct
from typing import NamedTuple

import pytest

from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.mavlink.services.parameter_file import packed_parameters
from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import ShimClient

_TERMINATE, _RESET, _LIST, _OPEN, _READ, _CRC, _BURST = 1, 2, 3, 4, 5, 14, 15
_ACK, _NAK = 128, 129
_SIZE, _SESSION, _NO_SESSIONS, _EOF, _UNKNOWN, _PROTECTED, _NOT_FOUND = 3, 4, 5, 6, 7, 9, 10


class Reply(NamedTuple):
    sequence: int
    session: int
    opcode: int
    requested: int
    complete: int
    offset: int
    data: bytes


class Files:
    """A client of MAVLink FTP."""

    def __init__(self, client: ShimClient) -> None:
        self.client = client
        self.sequence = 0

    def ask(self, opcode: int, data: bytes = b"", **fields: int) -> list[Reply]:
        self.sequence += 1
        self.client.forget()
        self.send(opcode, data, **fields)
        return self.replies()

    def send(
        self, opcode: int, data: bytes = b"", *, session: int = 0, size: int = -1, offset: int = 0
    ) -> None:
        size = len(data) if size < 0 else size
        payload = struct.pack("<HBBBBBxI", self.sequence, session, opcode, size, 0, 0, offset)
        message = dialect.MAVLink_file_transfer_protocol_message(
            0, 1, 1, (payload + data).ljust(251, b"\0")
        )
        self.client.send(message)
        self.client.run(1.0 if opcode == _BURST else 0.1)

    def replies(self) -> list[Reply]:
        found = []
        for message in self.client.messages("FILE_TRANSFER_PROTOCOL"):
            raw = bytes(message.payload)
            sequence, session, opcode, size, requested, complete, offset = struct.unpack_from(
                "<HBBBBBxI", raw
            )
            data = raw[12 : 12 + size]
            found.append(Reply(sequence, session, opcode, requested, complete, offset, data))
        return found

    def read(self, path: str) -> bytes:
        """The whole of a file, by bursts."""
        (opened,) = self.ask(_OPEN, path.encode())
        (size,) = struct.unpack("<I", opened.data)
        content = b""
        while len(content) < size:
            for reply in self.ask(_BURST, session=opened.session, size=239, offset=len(content)):
                if reply.opcode == _ACK:
                    assert reply.offset == len(content)
                    content += reply.data
                else:
                    assert reply.data == bytes([_EOF])
        self.ask(_TERMINATE, session=opened.session)
        return content


def _files(autopilot: str = "px4") -> Files:
    client = ShimClient(ShimOptions(autopilot=autopilot, seed=1))
    client.run_until(3.0)
    return Files(client)


def _refusal(replies: list[Reply]) -> int:
    (reply,) = replies
    assert reply.opcode == _NAK
    assert len(reply.data) == 1
    return reply.data[0]


def _entries(files: Files, path: str) -> list[str]:
    (reply,) = files.ask(_LIST, path.encode())
    assert reply.opcode == _ACK
    return reply.data.decode().strip("\0").split("\0")


def test_directories_lead_to_the_log() -> None:
    files = _files()
    assert _entries(files, "/") == ["Dlog"]
    assert _entries(files, "log") == ["D2026-01-01"]
    (entry,) = _entries(files, "/log/2026-01-01")
    assert entry.startswith("F00_00_02.ulg\t")
    assert int(entry.partition("\t")[2]) > 500


def test_a_log_is_read_in_bursts_and_in_pieces() -> None:
    files = _files()
    path = "/log/2026-01-01/00_00_02.ulg"
    content = files.read(path)
    assert content.startswith(b"ULog")
    (opened,) = files.ask(_OPEN, path.encode())
    (piece,) = files.ask(_READ, session=opened.session, size=100, offset=50)
    assert piece.data == content[50:150]
    assert (piece.requested, piece.offset) == (_READ, 50)
    (checksum,) = files.ask(_CRC, path.encode())
    assert checksum.opcode == _ACK


def test_the_packets_of_a_burst_are_numbered_and_the_last_says_so() -> None:
    files = _files("ardupilot")
    (opened,) = files.ask(_OPEN, b"@PARAM/param.pck")
    replies = files.ask(_BURST, session=opened.session, size=10, offset=0)
    assert [r.sequence for r in replies] == list(
        range(files.sequence + 1, files.sequence + 1 + len(replies))
    )
    assert [r.complete for r in replies[:-1]] == [0] * (len(replies) - 1)
    assert replies[-1].complete == 1
    (more,) = files.ask(_READ, session=opened.session, size=10, offset=10 * len(replies))
    assert more.opcode == _ACK


@pytest.mark.parametrize(
    ("opcode", "data", "fields", "reason"),
    [
        (_OPEN, b"/etc/extras/component_general.json.xz", {}, _NOT_FOUND),
        (_OPEN, b"@PARAM/param.pck?withdefaults=1", {}, _NOT_FOUND),
        (_LIST, b"/nowhere", {}, _NOT_FOUND),
        (_LIST, b"/", {"offset": 1}, _EOF),
        (_CRC, b"/nowhere", {}, _NOT_FOUND),
        (_READ, b"", {"session": 3, "size": 10}, _SESSION),
        (_BURST, b"", {"session": 3, "size": 10}, _SESSION),
        (_TERMINATE, b"", {"session": 121}, _SESSION),
        (6, b"/log/mine", {}, _PROTECTED),
        (8, b"/log/2026-01-01/00_00_02.ulg", {}, _PROTECTED),
        (99, b"", {}, _UNKNOWN),
    ],
)
def test_what_cannot_be_is_refused_with_its_reason(
    opcode: int, data: bytes, fields: dict[str, int], reason: int
) -> None:
    assert _refusal(_files().ask(opcode, data, **fields)) == reason


def test_reading_past_the_end_or_nothing_is_refused() -> None:
    files = _files()
    (opened,) = files.ask(_OPEN, b"/log/2026-01-01/00_00_02.ulg")
    read = {"session": opened.session}
    assert _refusal(files.ask(_READ, size=10, offset=10_000_000, **read)) == _EOF
    assert _refusal(files.ask(_READ, size=0, offset=0, **read)) == _SIZE


def test_sessions_are_few_and_a_reset_ends_them() -> None:
    files = _files()
    path = b"/log/2026-01-01/00_00_02.ulg"
    sessions = [files.ask(_OPEN, path)[0].session for _ in range(4)]
    assert len(set(sessions)) == 4
    assert _refusal(files.ask(_OPEN, path)) == _NO_SESSIONS
    (done,) = files.ask(_RESET)
    assert done.opcode == _ACK
    assert files.ask(_OPEN, path)[0].opcode == _ACK


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_files_of_clients_that_went_away_are_closed_and_others_are_not(autopilot: str) -> None:
    files = _files(autopilot)
    path = b"/log/2026-01-01/00_00_02.ulg" if autopilot == "px4" else b"@PARAM/param.pck"
    for session in range(4):
        assert files.ask(_OPEN, path, session=session)[0].opcode == _ACK
    for _ in range(3):
        assert files.ask(_READ, session=1, size=10)[0].opcode == _ACK
        assert _refusal(files.ask(_OPEN, path, session=4)) == _NO_SESSIONS
        files.client.run(4.0)
    assert _refusal(files.ask(_READ, session=0, size=10)) == _SESSION
    assert files.ask(_READ, session=1, size=10)[0].opcode == _ACK
    assert files.ask(_OPEN, path, session=4)[0].opcode == _ACK


def test_on_ardupilot_the_client_numbers_its_open_files() -> None:
    files = _files("ardupilot")
    (opened,) = files.ask(_OPEN, b"@PARAM/param.pck", session=106)
    assert (opened.opcode, opened.session) == (_ACK, 106)
    assert files.ask(_READ, session=106, size=10)[0].opcode == _ACK
    assert files.ask(_OPEN, b"@PARAM/param.pck", session=106)[0].session == 106
    assert _files("px4").ask(_OPEN, b"/log/2026-01-01/00_00_02.ulg", session=106)[0].session == 0


def test_a_request_that_comes_again_is_answered_again_without_being_carried_out() -> None:
    files = _files()
    (first,) = files.ask(_OPEN, b"/log/2026-01-01/00_00_02.ulg")
    files.client.forget()
    files.send(_OPEN, b"/log/2026-01-01/00_00_02.ulg")
    assert files.replies() == [first]


# --- the parameter file ---


def _unpacked(content: bytes) -> tuple[tuple[int, int, int], dict[str, tuple[float, ...]]]:
    """Header, and value (and default, where it differs) by name."""
    header = struct.unpack_from("<HHH", content)
    at, name, found = 6, b"", {}
    formats = {1: "b", 2: "h", 3: "i", 4: "f"}
    while at < len(content):
        kind, lengths = content[at], content[at + 1]
        more = (lengths >> 4) + 1
        name = name[: lengths & 15] + content[at + 2 : at + 2 + more]
        code = "<" + formats[kind & 15] * (2 if kind >> 4 & 1 else 1)
        found[name.decode()] = struct.unpack_from(code, content, at + 2 + more)
        at += 2 + more + struct.calcsize(code)
    return header, found


def _store() -> ParameterStore:
    shim = ShimClient(ShimOptions(autopilot="ardupilot"))
    store: ParameterStore = shim.simulation.autopilot.parameters
    return store


def test_ardupilots_parameter_file_holds_all_parameters() -> None:
    files = _files("ardupilot")
    store = files.client.simulation.autopilot.parameters
    header, found = _unpacked(files.read("@PARAM/param.pck"))
    assert header == (0x671B, len(store), len(store))
    assert list(found) == list(store.names)
    assert {name: pair[0] for name, pair in found.items()} == pytest.approx(
        {name: store[name] for name in store.names}
    )


def test_defaults_stand_beside_what_differs_from_them() -> None:
    store = _store()
    store.set("GUID_TIMEOUT", 0.5)
    header, found = _unpacked(packed_parameters(store, "withdefaults=1"))
    assert header[0] == 0x671C
    assert found["GUID_TIMEOUT"] == pytest.approx((0.5, 3.0))
    assert found["FS_GCS_ENABLE"] == (0,)


@pytest.mark.parametrize(
    "query", ["start=3&count=2", "count=2&start=3&junk", "start=3&count=2&x=y"]
)
def test_a_part_of_the_parameters_can_be_asked_for(query: str) -> None:
    store = _store()
    header, found = _unpacked(packed_parameters(store, query))
    assert header == (0x671B, 2, len(store))
    assert list(found) == list(store.names[3:5])
