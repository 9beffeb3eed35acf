"""A flight on its page: seen, and landed from there, over real sockets."""

import contextlib
import json
import os
import signal
import urllib.error
import urllib.request
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from websockets.sync.client import connect

pytestmark = pytest.mark.realtime
VIEWERS = 5


def address(flight) -> tuple[str, str]:
    """Where the page is, and the token, from what the command says."""
    for line in flight.process.stderr:
        if line.startswith("live page: "):
            url = urlsplit(line.split()[-1])
            return url.netloc, url.fragment.removeprefix("token=")
    raise AssertionError("no page was told")


def command(netloc: str, token: str, name: str) -> tuple[int, dict]:
    request = urllib.request.Request(
        f"http://{netloc}/api/command",
        json.dumps({"command": name}).encode(),
        {"Content-Type": "application/json", "X-Companion-Token": token},
    )
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)


def items(viewer, kind: str):
    """What comes of one kind, until the flight is over."""
    for text in viewer:
        item = json.loads(text)
        if item["type"] == kind:
            yield item
        if item["type"] == "end":
            return


def test_a_flight_is_seen_by_many_and_landed_by_who_has_the_token(start) -> None:
    flight = start("--live")
    netloc, token = address(flight)
    with contextlib.ExitStack() as stack:
        viewers = [
            stack.enter_context(connect(f"ws://{netloc}/ws", close_timeout=0.2))
            for _ in range(VIEWERS)
        ]  # all but the first never read
        seen = []
        for frame in items(viewers[0], "frame"):
            seen.append(frame)
            if frame["phase"] == "track":
                break
        assert command(netloc, "another", "land")[0] == 403
        assert command(netloc, token, "land") == (200, {"answer": "land: taken"})
        end = list(items(viewers[0], "end"))[-1]
        result, _ = flight.end()
        with urllib.request.urlopen(f"http://{netloc}/api/history") as answer:
            told = [message["text"] for message in json.load(answer)["messages"]]
    assert result["outcome"] == end["outcome"] == "landed"
    assert not result["completed"]
    positions = {tuple(frame["position"]) for frame in seen if frame["position"]}
    assert len(positions) > 20
    assert max(p[2] for p in positions) > 0.5
    assert {"arm", "take off", "approach"} <= {frame["phase"] for frame in seen}
    assert any("landing" in text or "land" in text for text in told)


def test_a_page_that_is_killed_costs_the_flight_nothing(start) -> None:
    flight = start("--live")
    netloc, _ = address(flight)
    with connect(f"ws://{netloc}/ws") as viewer:
        next(items(viewer, "frame"))
        [page] = [
            pid
            for pid in flight.children()
            if b"companion.live" in Path(f"/proc/{pid}/cmdline").read_bytes()
        ]
        os.kill(page, signal.SIGKILL)
    result, _ = flight.end()
    assert result["outcome"] == "landed"
    assert result["completed"]


def test_a_port_that_is_taken_is_told_before_anything_begins(start) -> None:
    flight = start("--live")
    netloc, _ = address(flight)
    port = netloc.rpartition(":")[2]
    other = start("--live", f"--live-port={port}", f"--out={flight.folder}-2")
    _, said = other.end()
    assert other.process.returncode == 2
    assert port in said
    assert "--live-port" in said
    assert not (flight.folder.parent / f"{flight.folder.name}-2").exists()
