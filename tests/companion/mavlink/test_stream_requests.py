import math

import pytest

from companion.mavlink.client_command import ClientCommand, read_command
from companion.mavlink.codec import Packer, encode
from companion.mavlink.commands import Result, message_interval
from companion.mavlink.framing import Framer
from companion.mavlink.messages import MessageId, Target
from companion.mavlink.stream_requests import StreamRequests

VEHICLE = Target(1, 1)


def frame(outgoing, system=255, component=190):
    (made,) = Framer().feed(Packer(system, component).pack(outgoing))
    return made


def asks(message_id, interval_s):
    return read_command(frame(message_interval(VEHICLE, message_id, interval_s).as_long()))


@pytest.fixture
def requests():
    made = StreamRequests()
    for message_id, interval_s in ((MessageId.ODOMETRY, 0.01), (MessageId.SYS_STATUS, 0.2)):
        outgoing = message_interval(VEHICLE, message_id, interval_s).as_long()
        made.on_sent(outgoing.message_id, Packer(1, 191).pack(outgoing))
    return made


@pytest.mark.parametrize(
    ("message_id", "interval_s", "answer"),
    [
        (MessageId.ODOMETRY, 0.25, Result.ACCEPTED),
        (MessageId.ODOMETRY, 0.01, Result.ACCEPTED),
        (MessageId.SYS_STATUS, 0.02, Result.DENIED),
        (MessageId.ODOMETRY, None, Result.DENIED),
        (MessageId.ODOMETRY, 0.0, Result.DENIED),
        (MessageId.ATTITUDE, 0.1, None),
    ],
)
def test_a_client_has_what_comes_anyway_and_changes_none_of_it(
    requests, message_id, interval_s, answer
):
    assert requests.answer(asks(message_id, interval_s)) is answer


@pytest.mark.parametrize("message_id", [0, 22, 77, 111, 253])
@pytest.mark.parametrize("interval_s", [None, 0.0, 0.5, 1.0, 10.0])
def test_no_client_touches_what_comes_by_itself(requests, message_id, interval_s):
    """-1 for HEARTBEAT would leave the companion without a word of armed or not."""
    assert requests.answer(asks(message_id, interval_s)) is Result.DENIED
    assert StreamRequests().answer(asks(message_id, interval_s)) is Result.DENIED


@pytest.mark.parametrize("message_id", [1, 31, 32, 193, 245, 331, 436])
def test_what_a_flight_will_ask_for_is_not_stopped_before_it_does(message_id):
    assert StreamRequests().answer(asks(message_id, None)) is Result.DENIED
    assert StreamRequests().answer(asks(message_id, 0.1)) is None


@pytest.mark.parametrize("wanted", [0.4, -0.4, 30.6, math.nan, math.inf])
def test_a_message_that_is_not_named_by_a_whole_number_is_nobodys(requests, wanted):
    command = ClientCommand(511, VEHICLE, (wanted, -1.0, 0.0, 0.0), has_place=False)

    assert requests.answer(command) is Result.DENIED


def test_other_commands_are_not_answered(requests):
    said = encode(
        "COMMAND_LONG",
        target_system=1, target_component=1, command=512, confirmation=0, param1=331, param2=0,
        param3=0, param4=0, param5=0, param6=0, param7=0,
    )  # fmt: skip
    assert requests.answer(read_command(frame(said))) is None


def data_stream(group, rate, on=1):
    return frame(
        encode(
            "REQUEST_DATA_STREAM",
            target_system=1, target_component=1, req_stream_id=group, req_message_rate=rate,
            start_stop=on,
        )
    )  # fmt: skip


def wanted(outgoings):
    return {
        int(command.params[0]): command.params[1]
        for command in (read_command(frame(o)) for o in outgoings)
    }


def test_a_legacy_request_gives_all_but_what_the_flight_needs(requests):
    asked = wanted(requests.translate(data_stream(0, 4), VEHICLE))

    assert asked[MessageId.ATTITUDE] == asked[74] == 250_000
    assert MessageId.SYS_STATUS not in asked
    assert MessageId.ODOMETRY not in asked


def test_a_legacy_request_that_is_repeated_asks_for_nothing(requests):
    assert requests.translate(data_stream(10, 4), VEHICLE)
    assert not requests.translate(data_stream(10, 4), VEHICLE)

    assert wanted(requests.translate(data_stream(10, 10), VEHICLE))[30] == 100_000
    assert wanted(requests.translate(data_stream(10, 10, on=0), VEHICLE))[30] == -1
