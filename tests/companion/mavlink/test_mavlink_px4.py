import pytest

from companion.mavlink.codec import Packer, decode
from companion.mavlink.dialects.base import AutopilotDialect, ReadinessFacts
from companion.mavlink.dialects.px4 import Px4, decode_mode, encode_mode
from companion.mavlink.framing import Framer
from companion.mavlink.messages import Target

PX4: AutopilotDialect = Px4()


@pytest.mark.parametrize(
    ("name", "custom_mode"),
    [
        ("manual", 0x00010000),
        ("altctl", 0x00020000),
        ("posctl", 0x00030000),
        ("takeoff", 0x02040000),
        ("loiter", 0x03040000),
        ("mission", 0x04040000),
        ("rtl", 0x05040000),
        ("land", 0x06040000),
        ("acro", 0x00050000),
        ("offboard", 0x00060000),
        ("stabilized", 0x00070000),
    ],
)
def test_modes_have_the_numbers_of_a_real_px4(name, custom_mode):
    assert PX4.custom_mode(name) == custom_mode
    assert PX4.mode_name(custom_mode) == name
    assert encode_mode(*decode_mode(custom_mode)) == custom_mode


def test_an_unknown_mode_is_described_or_refused():
    assert PX4.mode_name(0x09040000) == "PX4 mode 4.9"
    with pytest.raises(KeyError, match="loiter"):
        PX4.custom_mode("guided")


def test_a_mode_is_asked_for_by_main_and_sub_mode():
    (frame,) = Framer().feed(Packer(1).pack(PX4.set_mode(Target(1), "land").as_long()))
    message = decode(frame)

    assert (message.command, message.param1, message.param2, message.param3) == (176, 1, 4, 6)


def readiness_of(*sensors):
    return PX4.readiness(ReadinessFacts(0x03040000, sensors, True, None, True))


def test_readiness_is_the_prearm_bit():
    # As a real PX4 reports itself when it can be armed.
    assert readiness_of(0x0300402F, 0x0301402F, 0x1320C83F).ready


def test_what_is_missing_is_named():
    readiness = readiness_of(0x0300402F, 0x0301402F, 0x0320C83F & ~0x20 & ~0x2000000)

    assert not readiness.ready
    assert set(readiness.missing) == {"GPS", "battery"}


def test_something_is_named_even_if_every_sensor_is_well():
    readiness = readiness_of(0x0300402F, 0x0300402F, 0x0300402F)

    assert not readiness.ready
    assert readiness.missing


def test_the_streams_that_the_flight_needs_are_asked_for():
    wanted = {stream.message_id: stream.interval_s for stream in PX4.streams}

    assert wanted[331] == 0.010
    assert wanted[436] == 0.100
    assert PX4.setpoint_mode == "offboard"
    assert PX4.stream_before_mode_s >= 1.0
    assert PX4.hand_over.modes == ()
