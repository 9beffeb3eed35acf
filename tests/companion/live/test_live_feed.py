"""The flight's end of the live view waits for nobody and never fails the flight."""

import base64
import math
import socket
import threading

import numpy as np
import orjson
import pytest

from companion.live.feed import END, INTERVAL_S, PACKET, RECORD, LiveFeed, datagram_pair
from companion.recording.flight_log import FlightLog

HEARTBEAT = bytes.fromhex("fd 09 00 00 01 01 01 00 00 00".replace(" ", "")) + bytes(9) + b"xx"
ACTUATORS = bytes.fromhex("fd 09 00 00 01 01 01 24 00 00".replace(" ", "")) + bytes(9) + b"xx"


@pytest.fixture
def ends():
    ours, theirs = datagram_pair()
    theirs.setblocking(False)
    yield LiveFeed(ours), theirs
    ours.close()
    theirs.close()


def received(theirs):
    """All items, in the order in which they came."""
    items = []
    while True:
        try:
            data = theirs.recv(1 << 21)
        except BlockingIOError:
            return items
        if not data:
            return items
        items += orjson.loads(data)


def test_what_is_recorded_within_an_interval_comes_at_its_end(ends) -> None:
    feed, theirs = ends
    feed.on_record("control", 1.0, {"n": 0})
    for k in range(1, 5):
        feed.on_record("control", 1.0 + 0.01 * k, {"n": k})
    assert [item[3]["n"] for item in received(theirs)] == [0]
    feed.on_record("control", 1.0 + INTERVAL_S, {"n": 5})
    assert [item[3]["n"] for item in received(theirs)] == [1, 2, 3, 4, 5]


def test_of_other_topics_the_newest_comes_and_of_what_is_told_everything(ends) -> None:
    feed, theirs = ends
    feed.on_record("plan", 0.0, {"n": 0})
    received(theirs)
    for k in range(3):
        feed.on_record("plan", 0.01, {"n": k})
        feed.on_record("event", 0.01, {"text": str(k)})
    feed.on_record("plan", INTERVAL_S, {"n": 9})
    items = received(theirs)
    assert [i[3]["n"] for i in items if i[2] == "plan"] == [9]
    assert [i[3]["text"] for i in items if i[2] == "event"] == ["0", "1", "2"]


def test_numbers_that_are_none_and_arrays_go_over(ends) -> None:
    feed, theirs = ends
    feed.on_record("control", 0.0, {"a": math.nan, "b": np.arange(2.0), "c": (1.0, math.inf)})
    assert received(theirs) == [
        [RECORD, 0.0, "control", {"a": None, "b": [0.0, 1.0], "c": [1.0, None]}]
    ]


def test_of_packets_only_what_is_shown_goes_over_the_newest_of_each(ends) -> None:
    feed, theirs = ends
    feed.on_frame_in(0.0, HEARTBEAT)
    received(theirs)
    feed.on_frame_in(0.01, HEARTBEAT)
    feed.on_frame_in(0.02, ACTUATORS)
    feed.on_frame_in(0.03, b"\xfe\x01")
    feed.on_frame_in(0.06, HEARTBEAT)
    [(kind, time_s, data)] = received(theirs)
    assert (kind, time_s, base64.b64decode(data)) == (PACKET, 0.06, HEARTBEAT)


def test_a_page_that_takes_nothing_costs_frames_and_no_message(ends) -> None:
    feed, theirs = ends
    big = {"text": "x" * 4000}
    for k in range(2000):
        feed.on_record("control", k * INTERVAL_S, big)
    feed.on_record("event", 2000 * INTERVAL_S, {"text": "engaged"})
    taken = len(received(theirs))
    assert 0 < taken < 2000
    feed.on_record("control", 2001 * INTERVAL_S, big)
    assert [i[3]["text"] for i in received(theirs) if i[2] == "event"] == ["engaged"]


def test_a_page_that_has_died_is_forgotten(ends) -> None:
    feed, theirs = ends
    theirs.close()
    feed.on_record("control", 0.0, {})
    assert feed.gone
    feed.on_record("control", 1.0, {})
    feed.end(2.0, {"outcome": "landed"})


def test_the_end_is_told_and_closes(ends) -> None:
    feed, theirs = ends
    feed.on_record("control", 0.0, {})
    feed.end(0.01, {"outcome": "landed"})
    assert received(theirs)[-1] == [END, 0.01, {"outcome": "landed"}]
    assert theirs.recv(10) == b""


class Raising:
    def __init__(self) -> None:
        self.asked = 0

    def on_record(self, topic, time_s, values) -> None:
        self.asked += 1
        raise OSError("gone")

    def on_frame_in(self, time_s, raw) -> None:
        self.asked += 1
        raise OSError("gone")


def test_a_listener_that_raises_is_asked_no_more_and_the_log_goes_on(tmp_path) -> None:
    log = FlightLog(tmp_path / "flight")
    log.listener = listener = Raising()
    log.frame_in(0.0, HEARTBEAT)
    log.record("event", 0.1, {"text": "still here"})
    log.close()
    assert listener.asked == 1
    assert log.lost == 0
    assert log.trouble is None


def test_datagrams_are_kept_apart() -> None:
    ours, theirs = datagram_pair()
    with ours, theirs:
        assert ours.family == socket.AF_UNIX
        ours.send(b"one")
        ours.send(b"two")
        assert theirs.recv(100) == b"one"


def test_the_end_comes_through_a_full_socket_once_the_page_reads_again(ends) -> None:
    feed, theirs = ends
    for k in range(2000):
        feed.on_record("control", k * INTERVAL_S, {"text": "x" * 4000})
    items = []

    def read_to_the_end() -> None:
        theirs.setblocking(True)
        while data := theirs.recv(1 << 21):
            items.extend(orjson.loads(data))

    reader = threading.Thread(target=read_to_the_end)
    reader.start()
    feed.end(101.0, {"outcome": "landed"})
    reader.join()
    assert items[-1] == [END, 101.0, {"outcome": "landed"}]
    assert feed.gone


def test_what_json_has_no_word_for_is_not_shown_and_nothing_else_is_lost(ends) -> None:
    feed, theirs = ends
    feed.on_record("event", 0.0, {"text": "\ud800"})
    feed.on_record("event", 1.0, {"text": "fine"})
    assert [item[3]["text"] for item in received(theirs)] == ["fine"]
    feed.end(2.0, {"outcome": "landed"})
    assert received(theirs)[-1][0] == END
