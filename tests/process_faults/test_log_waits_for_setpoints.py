"""The log is written when the setpoint is on its way, never before, however slow the disk is."""

import asyncio
import io

import pytest
from mcap.reader import make_reader

from companion.link.memory import MemoryLink
from companion.recording import append_file
from companion.recording.flight_log import FlightLog
from tests.flights.bench import Bench

pytestmark = pytest.mark.faults

SLOW_S = 0.03


class SlowFile(io.FileIO):
    """A file on a disk that takes its time for each write; the flight's clock goes on."""

    writes = 0

    def write(self, data):
        loop = asyncio._get_running_loop()
        if loop is not None and data:
            SlowFile.writes += 1
            loop.stall(SLOW_S)
        return super().write(data)


class Bundles:
    """Packs several messages into a datagram, as autopilots do; the state comes last."""

    def __init__(self, state_message):
        self._state_message = state_message
        self._waiting = b""

    def __call__(self, packet):
        self._waiting += packet.raw
        if packet.message_id != self._state_message or packet.component_id != 1:
            return b""
        bundle, self._waiting = self._waiting, b""
        return bundle


def noting(function, word, notes):
    """The same method, which notes the packet that it is given: the first bytes argument."""

    def call(self, *arguments, **more):
        notes.append((word, next(a for a in arguments if isinstance(a, bytes))))
        return function(self, *arguments, **more)

    return call


def test_no_setpoint_waits_for_a_slow_disk(tmp_path, monkeypatch):
    monkeypatch.setattr(append_file.io, "FileIO", SlowFile)
    SlowFile.writes = 0
    notes = []
    for owner, name, word in (
        (MemoryLink, "send", "on the link"),
        (FlightLog, "frame_out", "logged"),
    ):
        monkeypatch.setattr(owner, name, noting(getattr(owner, name), word, notes))
    bench = Bench(tmp_path)
    bench.after("track", 0.0, lambda: setattr(bench.wire, "from_shim", bundles))
    bundles = Bundles(bench.wire.state_message)

    flown = bench.fly()

    assert flown.outcome.completed
    assert flown.outcome.missed_deadlines > 0, "what the disk takes is told"
    tracked = [r for r in flown.records("control") if r.values["phase"] == "track"]
    assert len(tracked) > 300
    assert SlowFile.writes > 2 * flown.outcome.flight_s
    # A write between a sample's arrival and its setpoint's departure would be seen here.
    assert max(r.values["latency_s"] for r in tracked) == 0.0
    # Each packet is on the link before the log sees it.
    assert notes[::2] == [("on the link", raw) for _, raw in notes[::2]]
    assert notes[1::2] == [("logged", raw) for _, raw in notes[::2]]
    # No chunk of the log holds more than half a second.
    with (flown.folder / "flight.mcap").open("rb") as file:
        chunks = make_reader(file).get_summary().chunk_indexes
    assert len(chunks) > 2 * flown.outcome.flight_s
    assert max(c.message_end_time - c.message_start_time for c in chunks) <= 0.5e9
