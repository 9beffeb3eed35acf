"""Numbers as integers of a message: the nearest there is, for a message cannot hold any other."""


def int16(value: float) -> int:
    """A finite number as a signed integer of 16 bits."""
    return max(-32768, min(32767, round(value)))


def int32(value: float) -> int:
    """A finite number as a signed integer of 32 bits."""
    return max(-2147483648, min(2147483647, round(value)))


def uint16(value: float) -> int:
    """A finite number as an unsigned integer of 16 bits."""
    return max(0, min(65535, round(value)))
