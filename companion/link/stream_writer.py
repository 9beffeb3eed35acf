"""What may wait to be sent over a byte stream: little, or setpoints would arrive late.

A stream keeps what it cannot send at once, in the process and in the system.  For a setpoint it
is better to be lost than late, so a packet is dropped, whole, while too much waits already.
"""

import array
import fcntl
import termios


def waiting_in_system(descriptor: int) -> int:
    """Bytes that the system holds for a socket or a serial port and has not got rid of.

    Of a TCP socket these are all that the peer has not acknowledged (SIOCOUTQ has the number of
    TIOCOUTQ).  Where the system does not say: 0.
    """
    count = array.array("i", [0])
    try:
        fcntl.ioctl(descriptor, termios.TIOCOUTQ, count)
    except OSError:
        return 0
    return count[0]


class Congestion:
    """Decides on each packet whether it may be sent, and when nothing moves any more."""

    __slots__ = ("_full_since_s", "limit_bytes")

    def __init__(self, limit_bytes: int) -> None:
        """Let at most `limit_bytes` wait."""
        self.limit_bytes = limit_bytes
        self._full_since_s: float | None = None

    def admits(self, size: int, waiting: int, now_s: float) -> bool:
        """True if a packet of that size may join what is waiting; one that is alone always may."""
        if waiting and waiting + size > self.limit_bytes:
            if self._full_since_s is None:
                self._full_since_s = now_s
            return False
        self._full_since_s = None
        return True

    def full_for_s(self, waiting: int, now_s: float) -> float:
        """How long it has been full, without a packet getting through; 0 once it has drained."""
        if 2 * waiting < self.limit_bytes:
            self._full_since_s = None
        return 0.0 if self._full_since_s is None else now_s - self._full_since_s
