"""What the page's server gives to whom."""

import orjson
import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from companion.live.access import Access
from companion.live.server import CommandError, Pages, Viewer
from companion.live.serving import bound_socket, page_access, page_url
from companion.live.watching import Watched

ACCESS = Access("127.0.0.1", 8000, "secret")
STREAM = "ws://127.0.0.1:8000/ws"
TOKEN = {"X-Companion-Token": "secret"}


def call(client, function, *arguments) -> None:
    """Where the server runs: in the client's loop."""
    client.portal.call(function, *arguments)


class Pilot:
    def __init__(self) -> None:
        self.asked: list[str] = []
        self.fails = ""

    async def command(self, name: str) -> str:
        if self.fails:
            raise CommandError(self.fails)
        self.asked.append(name)
        return f"{name}: taken"


@pytest.fixture
def pilot() -> Pilot:
    return Pilot()


@pytest.fixture
def pages(pilot) -> Pages:
    return Pages(Watched(None, "live"), ACCESS, pilot.command)


@pytest.fixture
def client(pages):
    with TestClient(pages.app(), base_url="http://127.0.0.1:8000") as client:
        yield client


def test_the_page_and_its_parts_come_under_a_strict_policy(client) -> None:
    page = client.get("/")
    assert page.status_code == 200
    assert "<html" in page.text
    assert page.headers["content-security-policy"].startswith("default-src 'self'")
    assert client.get("/static/main.js").status_code == 200
    assert client.get("/static/../server.py").status_code == 404


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example:8000"},
        {"Host": "127.0.0.1:9000"},
        {"Host": ""},
        {"Host": "[::1"},
        {"Host": "203.0.113.5:8000"},
        {"Origin": "http://[::1"},
        {"Origin": "http://203.0.113.5:8000"},
        {"Origin": "https://127.0.0.1:8000"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:9000"},
    ],
)
def test_other_names_and_other_sites_are_turned_away(client, headers) -> None:
    assert client.get("/api/flight", headers=headers).status_code == 403
    asked = client.post("/api/command", headers=headers | TOKEN, json={"command": "land"})
    assert asked.status_code == 403
    with pytest.raises(WebSocketDisconnect), client.websocket_connect(STREAM, headers=headers):
        pass


@pytest.mark.parametrize("host", ["localhost:8000", "127.0.0.1:8000", "[::1]:8000"])
def test_this_computers_own_names_are_welcome(client, host) -> None:
    assert client.get("/api/flight", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize("name", ["land", "abort"])
def test_who_has_the_token_commands(client, pilot, name) -> None:
    asked = client.post("/api/command", headers=TOKEN, json={"command": name})
    assert (asked.status_code, asked.json()) == (200, {"answer": f"{name}: taken"})
    assert pilot.asked == [name]


@pytest.mark.parametrize("token", [{}, {"X-Companion-Token": ""}, {"X-Companion-Token": "secreT"}])
def test_without_the_token_nothing_is_commanded(client, pilot, token) -> None:
    assert client.post("/api/command", headers=token, json={"command": "land"}).status_code == 403
    assert pilot.asked == []


@pytest.mark.parametrize(
    "body", [b'{"command": "arm"}', b'{"command": "resume"}', b"[]", b"", b"{", b" " * 5000]
)
def test_what_is_no_command_is_refused(client, pilot, body) -> None:
    headers = TOKEN | {"Content-Type": "application/json"}
    assert client.post("/api/command", headers=headers, content=body).status_code == 422
    assert pilot.asked == []


def test_a_form_of_another_site_is_no_command(client, pilot) -> None:
    headers = TOKEN | {"Content-Type": "text/plain"}
    asked = client.post("/api/command", headers=headers, content=b'{"command": "land"}')
    assert asked.status_code == 422
    assert pilot.asked == []


def test_a_flight_that_does_not_answer_is_told(client, pilot) -> None:
    pilot.fails = "The flight does not answer."
    asked = client.post("/api/command", headers=TOKEN, json={"command": "land"})
    assert (asked.status_code, asked.json()) == (409, {"error": pilot.fails})


def test_a_flight_that_is_over_takes_no_command(client, pages, pilot) -> None:
    pages.end({"outcome": "landed"})
    asked = client.post("/api/command", headers=TOKEN, json={"command": "abort"})
    assert asked.status_code == 409
    assert pilot.asked == []


def test_a_recorded_flight_takes_no_command_and_has_no_stream() -> None:
    client = TestClient(
        Pages(Watched(None, "recorded"), ACCESS, None).app(), base_url="http://127.0.0.1:8000"
    )
    assert client.post("/api/command", headers=TOKEN, json={"command": "land"}).status_code == 409
    with pytest.raises(WebSocketDisconnect), client.websocket_connect(STREAM):
        pass


def test_a_page_gets_the_flight_then_frames_messages_and_the_end(client, pages) -> None:
    with client.websocket_connect(STREAM) as socket:
        assert socket.receive_json()["type"] == "flight"
        [viewer] = pages.viewers
        for k in range(3):
            call(client, pages.show, {"t": float(k)})
            assert socket.receive_json() == {"type": "frame", "t": float(k)}
        call(client, pages.say, {"t": 3.0, "severity": "info", "text": "hello"})
        assert socket.receive_json()["text"] == "hello"
        call(client, pages.end, {"outcome": "landed"})
        assert socket.receive_json()["type"] == "flight"
        assert socket.receive_json() == {"type": "end", "outcome": "landed"}
    assert viewer not in pages.viewers


async def test_a_slow_page_gets_the_newest_frame_and_every_message() -> None:
    viewer = Viewer()
    for k in range(100):
        viewer.show(orjson.dumps({"frame": k}))
        if k % 25 == 0:
            viewer.tell(orjson.dumps({"message": k}))
    due = [orjson.loads(data) for data in await viewer.next()]
    assert due == [{"message": 0}, {"message": 25}, {"message": 50}, {"message": 75}, {"frame": 99}]


def test_history_holds_what_was_shown(client, pages) -> None:
    watched = pages.watched
    watched.take(("record", 10.0, "event", {"severity": "warning", "text": "phase arm: now"}))
    watched.look(10.5)
    history = client.get("/api/history").json()
    assert history["messages"] == [{"t": 0.0, "severity": "warning", "text": "phase arm: now"}]
    assert (history["frames"][0]["t"], history["frames"][0]["phase"]) == (0.5, "arm")


def test_on_a_network_this_computers_addresses_and_names_are_welcome_and_others_not() -> None:
    access = Access("0.0.0.0", 8000, "secret", ("drone", "drone.local"))
    welcome = ("192.168.1.5:8000", "drone.local:8000", "localhost:8000")
    assert all(access.host_allowed({"host": host}) for host in welcome)
    assert not access.host_allowed({"host": "evil.example:8000"})


def test_the_page_s_own_requests_are_welcome(client) -> None:
    own = {"Origin": "http://127.0.0.1:8000"}
    assert client.get("/api/flight", headers=own).status_code == 200
    asked = client.post("/api/command", headers=own | TOKEN, json={"command": "land"})
    assert asked.status_code == 200


def test_a_computer_whose_name_has_capitals_is_found_by_its_own_address(monkeypatch) -> None:
    monkeypatch.setattr("socket.gethostname", lambda: "MyPi")
    with bound_socket("127.0.0.1", 0) as listening:
        access = page_access(listening, "0.0.0.0", "secret")
    netloc = page_url(access, commands=True).split("/")[2]
    assert access.host_allowed({"host": netloc})
    assert netloc == netloc.lower()
