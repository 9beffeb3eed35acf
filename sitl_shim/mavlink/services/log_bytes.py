"""The bytes of one log on the simulated card."""

import contextlib
import weakref
from tempfile import SpooledTemporaryFile

_IN_MEMORY_BYTES = 64 * 1024


class LogBytes:
    """What only grows, and is read anywhere.

    What is longer than a minute lies in a temporary file: a vehicle that flies for hours takes
    no more and more memory.
    """

    __slots__ = ("__weakref__", "_file", "_length")

    def __init__(self) -> None:
        self._file = SpooledTemporaryFile(max_size=_IN_MEMORY_BYTES)  # noqa: SIM115 - kept open
        self._length = 0
        weakref.finalize(self, self._file.close)

    def __len__(self) -> int:
        return self._length

    def append(self, data: bytes) -> None:
        """Add at the end, all or nothing; nothing when this computer's disk is full."""
        with contextlib.suppress(OSError):
            self._file.seek(self._length)
            self._file.write(data)
            self._length += len(data)

    def read(self, start: int, stop: int) -> bytes:
        """From one place to before another; fewer where the log ends."""
        with contextlib.suppress(OSError):
            self._file.seek(start)
            return self._file.read(max(0, min(stop, self._length) - start))
        return b""
