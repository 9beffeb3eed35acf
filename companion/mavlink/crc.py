"""CRC-16/MCRF4XX, the checksum of MAVLink packets.

pymavlink brings `fastcrc` (compiled, 0.15 µs for a packet); where a platform has no wheel of
it, a table does (about 0.06 µs per byte).
"""

from collections.abc import Callable

_POLYNOMIAL_REVERSED = 0x8408


def _entry(index: int) -> int:
    value = index
    for _ in range(8):
        value = (value >> 1) ^ (_POLYNOMIAL_REVERSED if value & 1 else 0)
    return value


CRC_TABLE: tuple[int, ...] = tuple(_entry(index) for index in range(256))
"""Effect of one byte: ``crc' = CRC_TABLE[(crc ^ byte) & 255] ^ (crc >> 8)``."""

CRC_INDEX: dict[int, int] = {entry: index for index, entry in enumerate(CRC_TABLE)}
"""The way back: which byte, combined with the CRC's low one, had an effect."""


def crc16_by_table(data: bytes, crc: int = 0xFFFF) -> int:
    """CRC of `data`, carried on from `crc`."""
    table = CRC_TABLE
    for byte in data:
        crc = table[(crc ^ byte) & 0xFF] ^ (crc >> 8)
    return crc


try:
    from fastcrc.crc16 import mcrf4xx
except ImportError:  # pragma: no cover - only where fastcrc has no wheel
    crc16: Callable[[bytes], int] = crc16_by_table
else:
    crc16 = mcrf4xx
