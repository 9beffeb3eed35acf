"""Signatures of MAVLink 2 packets: made for what leaves, checked on what comes.

https://mavlink.io/en/guide/message_signing.html.  A signature is 13 bytes behind the CRC: the id of
the sender's link, a time stamp of 48 bits in units of 10 µs since 2015, and the first 48 bits of
the SHA-256 of key, packet, link id and stamp.

Stamps grow by at least one with every packet of a link, so a packet that was recorded and is sent
again is known by its old stamp.  A sender that has not been heard yet has no last stamp to compare
with; its first one may lie a minute behind ours at most.
"""

import hashlib
import hmac
from collections.abc import Callable
from enum import StrEnum

from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId

KEY_BYTES = 32
SIGNATURE_BYTES = 13
EPOCH_UNIX_S = 1_420_070_400
"""2015-01-01, from which stamps count, in seconds since 1970."""

_STAMPS_PER_S = 100_000
_LARGEST_STAMP = 2**48 - 1
_NEW_STREAM_BEHIND = 60 * _STAMPS_PER_S
_DIGEST_BYTES = 6

_ACCEPTED_UNSIGNED = frozenset({MessageId.RADIO_STATUS})
"""Radios put their own reports into the stream, and have no key."""


class Rejection(StrEnum):
    """Why a packet is not read."""

    UNSIGNED = "unsigned"
    BADLY_SIGNED = "badly signed"
    REPLAYED = "replayed"
    """Its stamp is no newer than that of a packet which its sender's link has sent before."""
    OUTDATED = "outdated"
    """The first one of its sender's link, and more than a minute behind our clock."""


class Stamps:
    """The time stamps of one link: never earlier than the clock, never one twice.

    The clock's time at the start is what makes stamps grow over restarts, too: a run begins later
    than the last packet of the run before, and no link carries 100,000 packets a second that could
    have outrun the clock.  Where the clock itself was set back (a computer without a battery for
    it), the stamps of the first authentic packet that comes in raise ours: the vehicle has heard
    our last ones and counts on from them.
    """

    __slots__ = ("_newest", "_unix_s")

    def __init__(self, unix_s: Callable[[], float]) -> None:
        """Make stamps.

        Args:
            unix_s: gives the seconds since 1970 now; it may stand still.
        """
        self._unix_s = unix_s
        self._newest = 0

    @property
    def now(self) -> int:
        """The stamp that is due now."""
        return max(int((self._unix_s() - EPOCH_UNIX_S) * _STAMPS_PER_S), self._newest)

    def take(self) -> int:
        """The next packet's stamp."""
        # At the end of the 48 bits stamps stop, and with them what is believed; nothing breaks.
        self._newest = min(max(self.now, self._newest + 1), _LARGEST_STAMP)
        return self._newest

    def note(self, stamp: int) -> None:
        """An authentic packet carried this stamp: ours must not lie before it."""
        self._newest = max(self._newest, stamp)


class Signer:
    """Signs packets with a key, as one link.

    Args:
        key: 32 bytes.
        stamps: shared with whoever checks what comes in on the same link.
        link_id: 0..255, of this link among ours.

    Raises:
        ValueError: the key has another length, or there is no such link id.
    """

    __slots__ = ("_keyed", "_link_id", "_stamps")

    def __init__(self, key: bytes, stamps: Stamps, link_id: int = 0) -> None:
        _check_key(key)
        self._keyed = hashlib.sha256(key)
        self._stamps = stamps
        self._link_id = link_id.to_bytes(1) if 0 <= link_id <= 255 else _no_link(link_id)

    def sign(self, packet: bytes) -> bytes:
        """Add the signature to a packet from magic byte to CRC, whose header announces it."""
        covered = packet + self._link_id + self._stamps.take().to_bytes(6, "little")
        hashed = self._keyed.copy()
        hashed.update(covered)
        return covered + hashed.digest()[:_DIGEST_BYTES]


class Verifier:
    """Judges packets by a key, and remembers the newest stamp of each sender's link.

    Args:
        key: 32 bytes.
        stamps: shared with whoever signs what leaves on the same link.

    Raises:
        ValueError: the key has another length.
    """

    __slots__ = ("_keyed", "_newest", "_stamps", "on_turned_away")

    def __init__(self, key: bytes, stamps: Stamps) -> None:
        _check_key(key)
        self.on_turned_away: Callable[[Frame, Rejection], None] | None = None
        """Told of a vehicle's heartbeat for which its sender was not taken for the link's peer."""
        self._keyed = hashlib.sha256(key)
        self._stamps = stamps
        self._newest: dict[tuple[int, int, int], int] = {}

    def check(self, frame: Frame) -> Rejection | None:
        """Why a packet must not be read, or None: it may, and counts as the newest of its stream.

        The signature is looked at first: nobody without the key may move a stream's stamp.
        """
        reason = self.preview(frame)
        if reason is None and frame.signed:
            stream, stamp = _stream_and_stamp(frame)
            self._newest[stream] = stamp
            self._stamps.note(stamp)
        return reason

    def preview(self, frame: Frame) -> Rejection | None:
        """What `check` would say, without remembering anything."""
        if not frame.signed:
            return None if frame.message_id in _ACCEPTED_UNSIGNED else Rejection.UNSIGNED
        raw = frame.raw
        hashed = self._keyed.copy()
        hashed.update(raw[:-_DIGEST_BYTES])
        if not hmac.compare_digest(hashed.digest()[:_DIGEST_BYTES], raw[-_DIGEST_BYTES:]):
            return Rejection.BADLY_SIGNED
        stream, stamp = _stream_and_stamp(frame)
        newest = self._newest.get(stream)
        if newest is None:
            outdated = stamp + _NEW_STREAM_BEHIND < self._stamps.now
            return Rejection.OUTDATED if outdated else None
        return Rejection.REPLAYED if stamp <= newest else None


class Signing:
    """Both directions of one link under one key.

    Args:
        key: 32 bytes.
        unix_s: gives the seconds since 1970 now.
        link_id: 0..255, of this link among ours.

    Raises:
        ValueError: the key has another length, or there is no such link id.
    """

    __slots__ = ("signer", "verifier")

    def __init__(self, key: bytes, unix_s: Callable[[], float], link_id: int = 0) -> None:
        stamps = Stamps(unix_s)
        self.signer = Signer(key, stamps, link_id)
        self.verifier = Verifier(key, stamps)


def _stream_and_stamp(frame: Frame) -> tuple[tuple[int, int, int], int]:
    raw = frame.raw
    stream = (frame.system_id, frame.component_id, raw[-SIGNATURE_BYTES])
    return stream, int.from_bytes(raw[-SIGNATURE_BYTES + 1 : -_DIGEST_BYTES], "little")


def _check_key(key: bytes) -> None:
    if len(key) != KEY_BYTES:
        raise ValueError(f"a signing key has {KEY_BYTES} bytes, not {len(key)}")


def _no_link(link_id: int) -> bytes:
    raise ValueError(f"link ids are 0..255, not {link_id}")
