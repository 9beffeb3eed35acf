"""The words for what has happened to a simulated vehicle."""

import pytest

from companion.mavlink.truth_events import TruthEvent


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("payload", 0.25, "payload 0.25 kg"),
        ("payload", 0.0, "payload dropped"),
        ("motor3", 0.85, "motor 3 at 85% thrust"),
        ("front", 6.0, "gust front, 6 m/s"),
        ("reset", 0.3, "estimate reset by 0.3 m"),
        ("reset", 0.0, "estimate reset"),
        ("jump", 3.0, "estimate jumps by 3 m, unannounced"),
        ("jump", 0.0, "estimate jumps, unannounced"),
        ("velocity", 0.5, "estimated velocity steps by 0.5 m/s"),
        ("heading", -10.0, "estimated heading steps by -10°"),
        ("pos lost", 1.0, "position lost"),
        ("pos lost", 0.0, "position back"),
        ("frozen", 1.0, "telemetry frozen"),
        ("frozen", 0.0, "telemetry goes on"),
        ("clock", -2.0, "autopilot's clock jumps by -2 s"),
        ("clock", 5.0, "autopilot's clock jumps by +5 s"),
        ("reboot", 1.0, "autopilot reboots"),
        ("mode", 0.0, "mode chosen by somebody else"),
        ("disarm", 1.0, "disarmed by somebody else"),
        ("battery", 0.0, "battery reports 0%"),
        ("battery", 0.05, "battery reports 5%"),
        ("link", 2.0, "link fault 2 begins"),
        ("something", 1.5, "something 1.5"),
    ],
)
def test_an_event_is_told_in_words(name, value, text):
    assert TruthEvent(1.0, name, value).text == text
