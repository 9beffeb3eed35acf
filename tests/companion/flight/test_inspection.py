"""Listening to a vehicle: what comes, when, and how a version is told."""

import math

import pytest

from companion.flight.check.inspection import version_text
from companion.flight.vehicle.connection import Connection
from companion.flight.vehicle.ears import Ears
from companion.link.memory import MemoryLink
from companion.mavlink.codec import Packer, encode
from companion.mavlink.framing import Framer
from companion.mavlink.messages import MessageId
from tests.companion.flight.test_connection import NoLog, vehicle_heartbeat


@pytest.mark.parametrize(
    ("flight_sw_version", "text"),
    [
        (17891392, "1.17.0 alpha"),  # as a PX4 sent it
        (67567616, "4.7.0 dev"),  # as an ArduCopter sent it
        (0x040602C1, "4.6.2 rc"),
        (0x040602FF, "4.6.2"),
        (0x01100080, "1.16.0 beta"),
    ],
)
def test_versions_are_told_as_their_makers_do(flight_sw_version, text):
    assert version_text(flight_sw_version) == text


async def listening(*message_ids):
    link = MemoryLink(lambda data: None)
    connection = Connection(link, NoLog())
    await link.open()
    packer = Packer(1, 1)
    link.receive(vehicle_heartbeat(packer))
    return link, connection, packer, Ears(connection, message_ids, 0.0)


def status(packer, remaining):
    fields = dict.fromkeys(
        (
            "onboard_control_sensors_present",
            "onboard_control_sensors_enabled",
            "onboard_control_sensors_health",
            "load",
            "voltage_battery",
            "current_battery",
            "drop_rate_comm",
            "errors_comm",
            "errors_count1",
            "errors_count2",
            "errors_count3",
            "errors_count4",
        ),
        0,
    )
    return packer.pack(encode("SYS_STATUS", battery_remaining=remaining, **fields))


async def test_ears_count_the_vehicles_messages_and_keep_the_newest():
    link, _, packer, ears = await listening(MessageId.SYS_STATUS)
    for remaining in (90, 80):
        link.receive(status(packer, remaining))
    link.receive(status(Packer(2, 1), 10))  # somebody else's
    assert ears.count(MessageId.SYS_STATUS) == 2
    assert ears.newest(MessageId.SYS_STATUS).battery_remaining == 80


async def test_what_never_came_has_no_rate_and_one_long_gap():
    *_, ears = await listening(MessageId.SYS_STATUS)
    assert ears.newest(MessageId.SYS_STATUS) is None
    assert ears.rate_hz(MessageId.SYS_STATUS, 3.0) == 0.0
    assert ears.longest_gap_s(MessageId.SYS_STATUS, 3.0) == 3.0
    assert math.isnan(ears.jitter_s(MessageId.SYS_STATUS))


@pytest.mark.parametrize(
    ("times_s", "rate_hz"),
    [
        pytest.param([1.0, 1.5, 2.0], 2.0, id="by the time between two"),
        pytest.param([2.0], 0.25, id="one alone: in all the time"),
        pytest.param([3.0, 3.0], 0.5, id="all at once: in all the time"),
    ],
)
async def test_how_often_a_message_comes(times_s, rate_hz):
    _, connection, packer, ears = await listening(MessageId.SYS_STATUS)
    framer = Framer()
    for time_s in times_s:
        for frame in framer.feed(status(packer, 90)):
            for listener in connection.listeners[MessageId.SYS_STATUS]:
                listener(frame, time_s)
    assert ears.rate_hz(MessageId.SYS_STATUS, 4.0) == pytest.approx(rate_hz)


async def test_closed_ears_hear_nothing():
    link, _, packer, ears = await listening(MessageId.SYS_STATUS)
    ears.close()
    link.receive(status(packer, 90))
    assert ears.count(MessageId.SYS_STATUS) == 0


async def test_two_pairs_of_ears_hear_each_for_themselves():
    link, connection, packer, first = await listening(MessageId.SYS_STATUS)
    second = Ears(connection, (MessageId.SYS_STATUS,), 0.0)
    first.close()
    link.receive(status(packer, 90))
    assert (first.count(MessageId.SYS_STATUS), second.count(MessageId.SYS_STATUS)) == (0, 1)
