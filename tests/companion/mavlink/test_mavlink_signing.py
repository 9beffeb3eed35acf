"""Signatures: made and checked by the rules, with pymavlink's own as the oracle."""

import hashlib

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink

from companion.mavlink.codec import Packer, decode, signed_anew
from companion.mavlink.dialect import CRC_EXTRA, CRC_EXTRA_UNDECODABLE
from companion.mavlink.framing import Framer
from companion.mavlink.messages import (
    Outgoing,
    Severity,
    VehicleStateOfHealth,
    heartbeat,
    status_texts,
)
from companion.mavlink.signing import (
    EPOCH_UNIX_S,
    Rejection,
    Signer,
    Signing,
    Stamps,
    Verifier,
)

KEY = bytes(range(32))
OTHER_KEY = bytes(range(1, 33))
NOW_UNIX_S = EPOCH_UNIX_S + 1000.0
NOW = 100_000_000
MINUTE = 6_000_000
ALIVE = heartbeat(VehicleStateOfHealth.ACTIVE)
RADIO_STATUS = Outgoing(109, bytes(9))

laws = settings(deadline=None, derandomize=True, max_examples=200)


class Clock:
    def __init__(self, unix_s=NOW_UNIX_S):
        self.unix_s = unix_s

    def __call__(self):
        return self.unix_s


def sender(key=KEY, clock=None, *, system=1, component=1, link_id=0):
    signer = Signer(key, Stamps(clock or Clock()), link_id)
    return Packer(system, component, signer)


def verifier(key=KEY, clock=None):
    return Verifier(key, Stamps(clock or Clock()))


def one_frame(raw):
    (frame,) = Framer().feed(raw)
    return frame


def stamp_of(raw):
    return int.from_bytes(raw[-12:-6], "little")


def oracle(key=KEY, *, system=1, component=1, stamp=NOW, link_id=0):
    mav = pymavlink.MAVLink(None, srcSystem=system, srcComponent=component)
    mav.robust_parsing = True
    mav.signing.secret_key = key
    mav.signing.timestamp = stamp
    mav.signing.link_id = link_id
    mav.signing.sign_outgoing = True
    return mav


def is_accepted_by(mav, raw):
    return [m.get_type() for m in mav.parse_buffer(raw)] != ["BAD_DATA"]


# --- against pymavlink ---


@laws
@given(
    key=st.binary(min_size=32, max_size=32),
    link_id=st.integers(0, 255),
    stamp=st.integers(1, 2**48 - 1),
    text=st.text("abc ", max_size=50),
)
def test_a_packet_is_signed_as_pymavlink_signs_it(key, link_id, stamp, text):
    stamps = Stamps(Clock(0.0))
    stamps.note(stamp - 1)  # the last packet's
    ours = Packer(7, 191, Signer(key, stamps, link_id))
    theirs = oracle(key, system=7, component=191, stamp=stamp, link_id=link_id)

    (outgoing,) = status_texts(Severity.INFO, text)
    message = pymavlink.MAVLink_statustext_message(6, text.encode(), 0, 0)

    raw = ours.pack(outgoing)
    assert raw == bytes(message.pack(theirs))
    assert stamp_of(raw) == stamp


def test_pymavlink_accepts_what_we_sign_and_only_once():
    raw = sender().pack(ALIVE)
    theirs = oracle()

    assert is_accepted_by(theirs, raw)
    assert not is_accepted_by(theirs, raw)
    assert not is_accepted_by(oracle(OTHER_KEY), raw)


@laws
@given(
    start=st.integers(NOW - 2 * MINUTE, NOW + 2 * MINUTE),
    steps=st.lists(st.integers(-3, 3), max_size=8),
    wrong_key=st.booleans(),
)
def test_a_stream_is_judged_as_pymavlink_judges_it(start, steps, wrong_key):
    """All with one key: what pymavlink remembers of a forged packet is its own matter."""
    theirs, ours = oracle(), verifier()
    stamp = max(0, start)
    maker = oracle(OTHER_KEY if wrong_key else KEY, system=3, component=4)
    for step in [0, *steps]:
        stamp = max(0, stamp + step)
        maker.signing.timestamp = stamp
        raw = bytes(pymavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3).pack(maker))
        assert (ours.check(one_frame(raw)) is None) == is_accepted_by(theirs, raw)


# --- the rules ---


def test_the_layout_of_a_signature_is_that_of_the_guide():
    raw = sender(link_id=9).pack(ALIVE)

    assert raw[2] == 0x01
    assert raw[-13] == 9
    assert stamp_of(raw) == NOW
    assert raw[-6:] == hashlib.sha256(KEY + raw[:-6]).digest()[:6]


def test_a_signed_packet_reads_as_the_unsigned_one_does():
    signed, plain = one_frame(sender().pack(ALIVE)), one_frame(Packer(1, 1).pack(ALIVE))

    assert signed.signed
    assert not plain.signed
    assert signed.payload == plain.payload
    assert decode(signed).to_dict() == decode(plain).to_dict()


@laws
@given(place=st.integers(0, 2**16), bit=st.integers(0, 7))
def test_no_bit_of_a_signed_packet_can_be_changed(place, bit):
    raw = bytearray(sender().pack(status_texts(Severity.INFO, "keep off the grass")[0]))
    raw[place % len(raw)] ^= 1 << bit

    judged = verifier()
    assert [f for f in Framer().feed(bytes(raw)) if judged.check(f) is None] == []


@pytest.mark.parametrize("version", [1, 2])
def test_what_is_not_signed_is_rejected_but_for_the_radio(version):
    mav = pymavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    judged = verifier()

    def verdict(message):
        raw = message.pack(mav, force_mavlink1=version == 1)
        return judged.check(one_frame(bytes(raw)))

    assert verdict(pymavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3)) is Rejection.UNSIGNED
    assert verdict(pymavlink.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7)) is None


def test_a_radios_report_with_a_signature_must_have_the_right_one():
    assert verifier().check(one_frame(sender(OTHER_KEY).pack(RADIO_STATUS))) is (
        Rejection.BADLY_SIGNED
    )


def test_a_packet_sent_again_is_rejected_for_ever():
    clock, judged, packer = Clock(), verifier(), sender()
    first, second = (one_frame(packer.pack(ALIVE)) for _ in range(2))

    assert judged.check(first) is None
    assert judged.check(first) is Rejection.REPLAYED
    assert judged.check(second) is None
    clock.unix_s += 1e6
    assert judged.check(first) is Rejection.REPLAYED
    assert judged.check(second) is Rejection.REPLAYED


def test_an_overtaken_packet_is_rejected():
    """By the rules of the guide: it can't be told from a replayed one."""
    judged, packer = verifier(), sender()
    first, second = (one_frame(packer.pack(ALIVE)) for _ in range(2))

    assert judged.check(second) is None
    assert judged.check(first) is Rejection.REPLAYED


def test_each_link_of_each_component_has_its_own_stamps():
    judged, clock = verifier(), Clock()
    late = sender(clock=Clock(NOW_UNIX_S + 30.0))
    assert judged.check(one_frame(late.pack(ALIVE))) is None

    for address in ({"link_id": 1}, {"component": 2}, {"system": 2}):
        assert judged.check(one_frame(sender(clock=clock, **address).pack(ALIVE))) is None
    assert judged.check(one_frame(sender(clock=clock).pack(ALIVE))) is Rejection.REPLAYED


@pytest.mark.parametrize(
    ("behind_s", "verdict"),
    [(-3600.0, None), (0.0, None), (60.0, None), (60.1, Rejection.OUTDATED)],
)
def test_a_new_stream_may_lie_a_minute_behind(behind_s, verdict):
    packet = sender(clock=Clock(NOW_UNIX_S - behind_s)).pack(ALIVE)

    assert verifier().check(one_frame(packet)) is verdict


def test_a_known_stream_may_lie_any_time_behind_our_clock():
    clock, packer = Clock(), sender()
    judged = verifier(clock=clock)
    assert judged.check(one_frame(packer.pack(ALIVE))) is None
    clock.unix_s += 7200.0

    assert judged.check(one_frame(packer.pack(ALIVE))) is None


def test_a_forged_packet_moves_no_stamp():
    """Else anybody could silence a sender, by one packet from the far future."""
    judged, packer = verifier(), sender()
    assert judged.check(one_frame(packer.pack(ALIVE))) is None
    future = sender(OTHER_KEY, Clock(NOW_UNIX_S + 1e6))

    assert judged.check(one_frame(future.pack(ALIVE))) is Rejection.BADLY_SIGNED
    assert judged.check(one_frame(packer.pack(ALIVE))) is None


def test_a_preview_remembers_nothing():
    judged, frame = verifier(), one_frame(sender().pack(ALIVE))

    assert judged.preview(frame) is None
    assert judged.check(frame) is None
    assert judged.preview(frame) is Rejection.REPLAYED


# --- stamps ---


@laws
@given(
    steps=st.lists(
        st.one_of(
            st.just("take"),
            st.floats(-100.0, 100.0, allow_nan=False),
            st.integers(0, 2**48 - 1),
        ),
        max_size=30,
    )
)
def test_stamps_grow_whatever_the_clock_does(steps):
    clock = Clock()
    stamps = Stamps(clock)
    last = -1
    for step in [*steps, "take"]:
        if isinstance(step, float):
            clock.unix_s += step
        elif step == "take":
            stamp = stamps.take()
            assert last < stamp or stamp == 2**48 - 1
            assert stamp >= int((clock.unix_s - EPOCH_UNIX_S) * 100_000)
            last = stamp
        else:
            stamps.note(step)
            last = max(last, step)


def test_packets_at_500_a_second_do_not_outrun_the_clock():
    clock = Clock()
    packer = sender(clock=clock)
    for _ in range(100):
        clock.unix_s += 0.002
        raw = packer.pack(ALIVE)

    assert stamp_of(raw) == int((clock.unix_s - EPOCH_UNIX_S) * 100_000)


def test_stamps_at_their_end_break_nothing():
    stamps = Stamps(Clock(EPOCH_UNIX_S + 1e12))
    packer = Packer(1, 1, Signer(KEY, stamps))
    judged = verifier(clock=Clock(EPOCH_UNIX_S + 1e12))

    assert stamp_of(packer.pack(ALIVE)) == 2**48 - 1
    packer.pack(ALIVE)
    assert judged.check(one_frame(sender().pack(ALIVE))) is Rejection.OUTDATED


def test_after_a_restart_with_a_clock_set_back_the_vehicle_brings_the_stamps_forward():
    vehicle = Signing(KEY, Clock(NOW_UNIX_S))
    at_vehicle, of_vehicle = vehicle.verifier, Packer(1, 1, vehicle.signer)
    before = Packer(1, 191, Signing(KEY, Clock(NOW_UNIX_S + 5000.0)).signer)
    assert at_vehicle.check(one_frame(before.pack(ALIVE))) is None

    restarted = Signing(KEY, Clock(NOW_UNIX_S - 1e6))
    ours = Packer(1, 191, restarted.signer)
    too_early = ours.pack(ALIVE)
    heard = one_frame(of_vehicle.pack(ALIVE))

    assert restarted.verifier.check(heard) is None
    assert at_vehicle.check(one_frame(too_early)) is Rejection.REPLAYED
    assert at_vehicle.check(one_frame(ours.pack(ALIVE))) is None


# --- packets of others ---


@laws
@given(
    message_id=st.sampled_from([0, 8, 77, 300, 410, 12_345, 0xFFFFFF]),
    payload=st.binary(min_size=1, max_size=255),
    extra=st.integers(0, 255),
)
@example(message_id=0xFFFFFF, payload=b"Tim\x05US,\x00\x05\x01ag\x05", extra=1)
def test_anybodys_packet_can_be_put_under_our_signature(message_id, payload, extra):
    extra = (CRC_EXTRA | CRC_EXTRA_UNDECODABLE).get(message_id, extra)
    header = bytes([len(payload), 0, 0, 200, 255, 190]) + message_id.to_bytes(3, "little")
    crc = pymavlink.x25crc(bytearray(header + payload + bytes([extra]))).crc
    raw = b"\xfd" + header + payload + crc.to_bytes(2, "little")
    framer = Framer()
    framer.feed(raw)
    # Where its last bytes look like the begin of another packet, it is known once no more come.
    (frame, *_) = framer.feed(raw) + framer.finish()

    again = signed_anew(frame, Signer(KEY, Stamps(Clock())))

    (signed,) = framer.feed(again)
    assert verifier().check(signed) is None
    assert signed.payload == frame.payload
    assert signed[2:6] == frame[2:6]


def test_a_foreign_signature_is_replaced():
    frame = one_frame(sender(OTHER_KEY, system=255).pack(ALIVE))

    again = signed_anew(frame, Signer(KEY, Stamps(Clock()), 3))

    assert verifier().check(one_frame(again)) is None
    assert len(again) == len(frame.raw)


def test_mavlink_1_cannot_be_signed():
    mav = pymavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    raw = pymavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3).pack(mav, force_mavlink1=True)

    assert signed_anew(one_frame(bytes(raw)), Signer(KEY, Stamps(Clock()))) is None


@pytest.mark.parametrize("size", [0, 31, 33])
def test_a_key_has_32_bytes(size):
    for make in (lambda: Signer(bytes(size), Stamps(Clock())), lambda: verifier(bytes(size))):
        with pytest.raises(ValueError, match="32 bytes"):
            make()


@pytest.mark.parametrize("link_id", [-1, 256])
def test_link_ids_are_bytes(link_id):
    with pytest.raises(ValueError, match=r"0\.\.255"):
        sender(link_id=link_id)
