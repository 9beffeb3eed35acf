"""What a person is told reaches the display, the log and the wire, and never hurts the flight."""

import pytest

from companion.flight.clock import run_in_virtual_time
from companion.flight.vehicle.reports import Reports
from companion.flight.voice import Voice
from companion.mavlink.codec import Packer, encode
from companion.mavlink.framing import Framer
from companion.mavlink.messages import Severity, status_texts


class Display:
    def __init__(self, error=None):
        self.said = []
        self.error = error

    def phase(self, name, detail):
        self.message("phase", f"{name} {detail}".strip())

    def tick(self, view):
        self.message("tick", view)

    def message(self, severity, text):
        if self.error is not None:
            raise self.error
        self.said.append((severity, text))


class Log:
    def __init__(self):
        self.events = []

    def record(self, topic, time_s, values):
        assert topic == "event"
        self.events.append((values["severity"], values["text"]))


def speak(what, display=None):
    display = display or Display()
    log, wire = Log(), []

    async def main():
        what(Voice(display, log, lambda severity, text: wire.append((severity, text))))

    run_in_virtual_time(main())
    return display.said, log.events, wire


@pytest.mark.parametrize(
    ("severity", "level"),
    [("info", Severity.INFO), ("warning", Severity.WARNING), ("error", Severity.ERROR)],
)
def test_a_message_goes_three_ways(severity, level):
    shown, logged, wire = speak(lambda voice: voice.tell(severity, "hello"))
    assert shown == logged == [(severity, "hello")]
    assert wire == [(level, "companion: hello")]


def test_what_the_autopilot_says_is_not_sent_back():
    shown, logged, wire = speak(lambda voice: voice.heard(Severity.CRITICAL, "help"))
    assert shown == logged == [("error", "the autopilot says: help")]
    assert wire == []


def test_phases_are_shown_and_logged():
    shown, logged, wire = speak(lambda voice: voice.phase("arm"))
    assert (shown, logged, wire) == ([("phase", "arm")], [("info", "phase arm")], [])


def test_a_display_that_fails_is_given_up_and_the_rest_goes_on():
    def say_twice(voice):
        voice.tell("info", "one")
        voice.tell("info", "two")

    shown, logged, wire = speak(say_twice, Display(OSError("closed")))
    assert shown == []
    texts = ["one", "the display failed (OSError: closed)", "two"]
    assert [text for _, text in logged] == texts
    assert [text for _, text in wire] == [f"companion: {text}" for text in texts]


def heard_from(outgoings):
    heard = []
    reports = Reports(on_text=lambda severity, text: heard.append((severity, text)))
    packer = Packer(1, 1)
    for outgoing in outgoings:
        (frame,) = Framer().feed(packer.pack(outgoing))
        reports.take(frame)
    return heard


@pytest.mark.parametrize("length", [1, 49, 50, 51, 99, 100, 101, 180])
def test_texts_of_any_length_are_put_together(length):
    text = "abcdefghij"[:1] + "x" * (length - 1)
    chunks = status_texts(Severity.WARNING, text, 7)
    assert heard_from(chunks) == [(4, text)]


def test_a_text_whose_end_was_lost_does_not_spoil_the_next():
    broken = status_texts(Severity.WARNING, "a" * 80, 7)[:1]
    whole = status_texts(Severity.WARNING, "b" * 80, 8)
    assert heard_from([*broken, *whole]) == [(4, "b" * 80)]


def test_endless_chunks_do_not_fill_the_memory():
    endless = [
        encode("STATUSTEXT", severity=4, text=b"x" * 50, id=3, chunk_seq=k % 256)
        for k in range(1000)
    ]
    end = encode("STATUSTEXT", severity=4, text=b"", id=3, chunk_seq=1)
    ((_, text),) = heard_from([*endless, end])
    assert len(text) <= 1000
