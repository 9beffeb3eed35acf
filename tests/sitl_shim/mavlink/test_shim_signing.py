"""A vehicle with a signing key obeys it alone; SETUP_SIGNING as PX4's documentation has it."""

from itertools import pairwise

import pytest

from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Packer, dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import ARM, ShimClient, airborne

KEY, OTHER_KEY = bytes(range(32)), bytes(range(1, 33))
BOOT_STAMP = 15_776_640_000_000
"""2020-01-01 in units of 10 µs since 2015."""
TICK_STAMPS = 400
BOTH = (LinkKind.GROUND_STATION, LinkKind.ONBOARD)


class Stamps:
    """A client's stamps, from the vehicle's boot on."""

    def __init__(self, client, start=BOOT_STAMP):
        self.client, self.start, self.count = client, start, 0

    def __call__(self):
        self.count += 1
        return self.start + round(self.client.time_s * 100_000) + self.count


def signing_client(key=KEY, *, vehicle_key=KEY, start=BOOT_STAMP, links=(LinkKind.ONBOARD,)):
    client = ShimClient(ShimOptions(vehicle="sih_quadx", seed=1, signing_key=vehicle_key), links)
    use_key(client, key, start=start)
    client.boot()
    return client


def use_key(client, key, *, link=0, start=BOOT_STAMP):
    client._packers[link].sign(key, 7 + link, Stamps(client, start))


def setup_signing(key=bytes(32), stamp=0, target=(1, 1)):
    return dialect.MAVLink_setup_signing_message(*target, list(key), stamp)


def version_comes(client, link=0):
    """Whether the vehicle obeys a request."""
    before = len(client.messages("AUTOPILOT_VERSION", link=link))
    client.send(
        dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0), link=link
    )
    client.run(0.2)
    return len(client.messages("AUTOPILOT_VERSION", link=link)) > before


def frames_of(client, link=0):
    return [data for _, data in client._frames[link]]


_UNKNOWN_TO_PYMAVLINK = [number.to_bytes(3, "little") for number in (410, 411)]
"""EVENT and CURRENT_EVENT_SEQUENCE."""


def test_all_that_leaves_is_signed_by_a_key_that_pymavlink_accepts():
    client = signing_client()
    client.run(1.0)
    oracle = dialect.MAVLink(None)
    oracle.signing.secret_key = KEY
    # It looks at no signature of a message that it does not know.
    frames = [frame for frame in frames_of(client) if frame[7:10] not in _UNKNOWN_TO_PYMAVLINK]

    read = [message for frame in frames for message in oracle.parse_buffer(bytearray(frame))]

    assert len(read) == len(frames) > 100
    assert oracle.signing.goodsig_count == len(frames)
    assert {message.get_srcComponent() for message in read} == {1, 240}


def test_stamps_follow_simulated_time_and_none_comes_twice():
    client = signing_client()
    client.run(1.0)

    stamps = [int.from_bytes(frame[-12:-6], "little") for frame in frames_of(client)]

    assert all(later > earlier for earlier, later in pairwise(stamps))
    now = BOOT_STAMP + round(client.time_s * 100_000)
    assert now - 10 * TICK_STAMPS < stamps[-1] < now + TICK_STAMPS


def test_without_a_key_nothing_is_signed_and_everything_is_read():
    client = signing_client(None, vehicle_key=None)

    assert version_comes(client)
    assert all(frame[2] == 0 for frame in frames_of(client))
    use_key(client, KEY)
    assert version_comes(client)


def test_the_right_key_is_obeyed():
    client = signing_client()

    assert version_comes(client)
    client.command(ARM, 1)
    client.run(0.3)
    assert client.acks(ARM) == [0]
    assert client.shim.signing.rejected == {}


@pytest.mark.parametrize(
    ("key", "start", "reason"),
    [
        (None, BOOT_STAMP, "unsigned"),
        (OTHER_KEY, BOOT_STAMP, "badly signed"),
        (KEY, BOOT_STAMP - 70 * 100_000, "outdated"),
    ],
)
def test_without_the_right_signature_nothing_is_obeyed(key, start, reason):
    client = signing_client(key, start=start)

    client.command(ARM, 1)
    client.setpoint()
    client.send(dialect.MAVLink_param_set_message(1, 1, b"COM_OF_LOSS_T", 5.0, 9))
    client.send(dialect.MAVLink_timesync_message(0, 1))
    client.run(0.5)

    assert client.messages("COMMAND_ACK") == []
    assert not client.simulation.autopilot.armed
    assert client.shim.signing.rejected == {reason: 4}


def test_mavlink_1_is_not_obeyed():
    client = signing_client()
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=191)
    message = dialect.MAVLink_command_long_message(1, 1, ARM, 0, 1, 0, 0, 0, 0, 0, 0)

    client.send_bytes(message.pack(mav, force_mavlink1=True))
    client.run(0.2)

    assert client.messages("COMMAND_ACK") == []
    assert client.shim.signing.rejected == {"unsigned": 1}


def test_heartbeats_and_the_radio_need_no_signature():
    client = signing_client(None, links=BOTH)
    use_key(client, None, link=1)

    client.heartbeat(6)
    client.send(dialect.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7))
    client.run(0.2)

    assert client.shim.signing.rejected == {}
    forwarded = [m for m in frames_of(client, 1) if m[6] == 191 and m[7:10] == b"\0\0\0"]
    assert len(forwarded) == 1


def test_a_recorded_packet_sent_again_is_rejected_on_every_link():
    client = signing_client(links=BOTH)
    use_key(client, KEY, link=1)
    arm = dialect.MAVLink_command_long_message(1, 1, ARM, 0, 1, 0, 0, 0, 0, 0, 0)
    disarm = dialect.MAVLink_command_long_message(1, 1, ARM, 0, 0, 0, 0, 0, 0, 0, 0)
    recorded = client._packers[0].pack(arm)
    client.send_bytes(recorded)
    client.run(0.3)
    client.send(disarm)
    client.run(0.3)
    assert client.acks(ARM) == [0, 0]

    client.send_bytes(recorded, link=0)
    client.send_bytes(recorded, link=1)
    client.run(0.3)

    assert not client.simulation.autopilot.armed
    assert client.shim.signing.rejected == {"replayed": 2}


def test_a_forged_packet_silences_nobody():
    client = signing_client()
    forger = Packer(1, 191)
    forger.sign(OTHER_KEY, 7, lambda: 2**47)

    client.send_bytes(forger.pack(setup_signing()))
    client.run(0.1)

    assert version_comes(client)
    assert client.shim.signing.rejected == {"badly signed": 1}


# --- SETUP_SIGNING ---


def test_the_first_key_is_taken_over_any_link():
    client = signing_client(None, vehicle_key=None, links=BOTH)
    client.send(setup_signing(KEY, BOOT_STAMP), link=1)
    client.run(0.1)
    client.forget()
    client.run(1.0)

    for link in (0, 1):
        assert all(frame[2] == 1 for frame in frames_of(client, link))
    assert not version_comes(client)
    use_key(client, KEY)
    assert version_comes(client)
    assert client.messages("SETUP_SIGNING", link=0) == []  # a key is never passed on


def test_stamps_go_on_from_the_one_that_came_with_the_key():
    ahead = BOOT_STAMP + 10**9
    client = signing_client(None, vehicle_key=None)
    client.send(setup_signing(KEY, ahead))
    client.run(0.1)
    client.forget()
    client.run(0.2)

    stamps = [int.from_bytes(frame[-12:-6], "little") for frame in frames_of(client)]
    assert stamps == list(range(stamps[0], stamps[0] + len(stamps)))
    assert 0 < stamps[0] - ahead < 100


def test_another_key_must_come_under_the_old_one():
    client = signing_client(None)
    client.send(setup_signing(OTHER_KEY, BOOT_STAMP))
    client.run(0.1)
    assert client.shim.signing.key == KEY

    use_key(client, KEY)
    client.send(setup_signing(OTHER_KEY, BOOT_STAMP))
    client.run(0.1)
    assert client.shim.signing.key == OTHER_KEY
    use_key(client, OTHER_KEY)
    assert version_comes(client)


@pytest.mark.parametrize(("key", "off"), [(None, False), (OTHER_KEY, False), (KEY, True)])
def test_zeros_turn_signing_off_when_they_are_signed(key, off):
    client = signing_client(key)

    client.send(setup_signing())
    client.run(0.1)

    assert (client.shim.signing.key is None) == off
    client.forget()
    client.run(0.5)
    assert all((frame[2] == 0) == off for frame in frames_of(client))
    use_key(client, None)
    assert version_comes(client) == off


def test_a_zero_key_with_a_stamp_is_a_key():
    client = signing_client(None, vehicle_key=None)
    client.send(setup_signing(bytes(32), BOOT_STAMP))
    client.run(0.1)

    assert client.shim.signing.key == bytes(32)


@pytest.mark.parametrize("target", [(2, 1), (1, 191), (2, 0)])
def test_a_key_for_somebody_else_is_not_taken(target):
    client = signing_client(None, vehicle_key=None)
    client.send(setup_signing(KEY, BOOT_STAMP, target))
    client.run(0.1)
    assert client.shim.signing.key is None


@pytest.mark.parametrize("target", [(1, 1), (1, 0), (0, 0)])
def test_a_key_for_the_vehicle_or_everybody_is_taken(target):
    client = signing_client(None, vehicle_key=None)
    client.send(setup_signing(KEY, BOOT_STAMP, target))
    client.run(0.1)
    assert client.shim.signing.key == KEY


def test_no_key_is_taken_in_flight():
    client = airborne("sih_quadx")
    client.send(setup_signing(KEY, BOOT_STAMP))
    client.run(0.1)
    assert client.shim.signing.key is None


def test_the_key_is_not_shown_with_the_options():
    assert repr(KEY) not in repr(ShimOptions(signing_key=KEY))


@pytest.mark.parametrize("size", [0, 31, 33])
def test_a_key_has_32_bytes(size):
    with pytest.raises(ValueError, match="32 bytes"):
        ShimClient(ShimOptions(signing_key=bytes(size)))


def test_with_a_new_key_a_client_may_begin_anew():
    client = signing_client()
    use_key(client, KEY, start=BOOT_STAMP + 30 * 100_000)  # its clock was half a minute ahead
    assert version_comes(client)
    client.send(setup_signing(OTHER_KEY, BOOT_STAMP))
    client.run(0.1)
    use_key(client, OTHER_KEY)

    assert version_comes(client)


def test_the_same_key_again_is_no_new_beginning():
    client = signing_client()
    use_key(client, KEY, start=BOOT_STAMP + 30 * 100_000)
    for key in (bytes(32), KEY):
        client.send(setup_signing(key, BOOT_STAMP if any(key) else 0))
        client.run(0.1)
    use_key(client, KEY)

    assert not version_comes(client)
    assert client.shim.signing.rejected == {"replayed": 1}
