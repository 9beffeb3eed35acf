"""Numbers as integers of a message: the nearest there is, for a message cannot hold any other."""


def int16(value: float) -> int:
    """A finite number as a signed integer of 16 bits."""
    whole = round(value)
    return whole if -32768 <= whole <= 32767 else max(-32768, min(32767, whole))


def int32(value: float) -> int:
    """A finite number as a signed integer of 32 bits."""
    whole = round(value)
    if -2147483648 <= whole <= 2147483647:
        return whole
    return max(-2147483648, min(2147483647, whole))


def uint16(value: float) -> int:
    """A finite number as an unsigned integer of 16 bits."""
    return max(0, min(65535, round(value)))
