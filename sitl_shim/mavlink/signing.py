"""Signed packets: one key for all links, and the memory against packets that are sent again.

https://mavlink.io/en/guide/message_signing.html, https://docs.px4.io/main/en/mavlink/message_signing

As with PX4, having a key is what turns signing on, on every link: all that leaves is signed, and
what comes in unsigned or with another signature is not read, but for a few messages from senders
that have no key.  The newest stamps are remembered for all links together, so a packet recorded on
one link is of no use on another.
"""

import hashlib
import hmac
from collections.abc import Callable, Mapping, Set

from sitl_shim.mavlink.wire import Message

KEY_BYTES = 32
UNSIGNED, BADLY_SIGNED, REPLAYED, OUTDATED = "unsigned", "badly signed", "replayed", "outdated"
"""Why a packet was not read."""

ACCEPTED_UNSIGNED: Mapping[str, frozenset[int]] = {
    "px4": frozenset({0, 109, 246, 247}),
    "ardupilot": frozenset({109, 166}),
}
"""Ids of the messages that each flavour reads without a signature, since their senders may have no
key: HEARTBEAT, RADIO_STATUS, ADSB_VEHICLE, COLLISION; RADIO_STATUS, RADIO."""

_EPOCH_UNIX_S = 1_420_070_400
_STAMPS_PER_S = 100_000
_LARGEST_STAMP = 2**48 - 1
_NEW_STREAM_BEHIND = 60 * _STAMPS_PER_S
_SIGNATURE_BYTES, _DIGEST_BYTES = 13, 6
_MAGIC_V2, _FLAG_SIGNED = 0xFD, 0x01


class Signing:
    """Key, clock and memory of one vehicle.

    Args:
        key: 32 bytes; None for a vehicle that has none (yet).
        unix_s: gives the seconds since 1970 now.
        accepted_unsigned: ids of the messages that are read without a signature.

    Raises:
        ValueError: the key has another length.
    """

    __slots__ = (
        "_accepted_unsigned",
        "_key",
        "_last_key",
        "_newest",
        "_newest_of",
        "_unix_s",
        "rejected",
    )

    def __init__(
        self, key: bytes | None, unix_s: Callable[[], float], accepted_unsigned: Set[int]
    ) -> None:
        if key is not None and len(key) != KEY_BYTES:
            raise ValueError(f"a signing key has {KEY_BYTES} bytes, not {len(key)}")
        self._key = self._last_key = key
        self._unix_s = unix_s
        self._accepted_unsigned = accepted_unsigned
        self._newest = 0
        self._newest_of: dict[tuple[int, int, int], int] = {}
        self.rejected: dict[str, int] = {}
        """Packets that were not read, by the reason."""

    @property
    def key(self) -> bytes | None:
        """The key; None while packets are not signed."""
        return self._key

    def set_up(self, key: bytes | None, stamp: int) -> None:
        """Take another key, or None to sign no more; stamps go on from this one.

        What was signed with another key cannot be sent again, so nothing need be remembered of it.
        """
        if key is not None and key != self._last_key:
            self._newest_of.clear()
            self._last_key = key
        self._key = key
        self._newest = min(stamp, _LARGEST_STAMP)

    def take_stamp(self) -> int:
        """The next packet's time stamp: the clock's, or one more than the newest there was."""
        self._newest = min(max(self._now, self._newest + 1), _LARGEST_STAMP)
        return self._newest

    def admits(self, message: Message) -> bool:
        """Whether a message may be read; what may not is counted."""
        if self._key is None:
            return True
        reason = self._why_not(self._key, message)
        if reason is None:
            return True
        self.rejected[reason] = self.rejected.get(reason, 0) + 1
        return False

    @property
    def _now(self) -> int:
        return int((self._unix_s() - _EPOCH_UNIX_S) * _STAMPS_PER_S)

    def _why_not(self, key: bytes, message: Message) -> str | None:
        packet = bytes(message.get_msgbuf())
        if packet[0] != _MAGIC_V2 or not packet[2] & _FLAG_SIGNED:
            return None if message.get_msgId() in self._accepted_unsigned else UNSIGNED
        digest = hashlib.sha256(key + packet[:-_DIGEST_BYTES]).digest()[:_DIGEST_BYTES]
        if not hmac.compare_digest(digest, packet[-_DIGEST_BYTES:]):
            return BADLY_SIGNED
        stamp = int.from_bytes(packet[-_SIGNATURE_BYTES + 1 : -_DIGEST_BYTES], "little")
        stream = (message.get_srcSystem(), message.get_srcComponent(), packet[-_SIGNATURE_BYTES])
        newest = self._newest_of.get(stream)
        if newest is None and stamp + _NEW_STREAM_BEHIND < max(self._now, self._newest):
            return OUTDATED
        if newest is not None and stamp <= newest:
            return REPLAYED
        self._newest_of[stream] = stamp
        self._newest = max(self._newest, stamp)
        return None
