"""A file that only grows, by whole records, and survives `kill -9` and full disks."""

import contextlib
import io
import os
from pathlib import Path


class AppendFile:
    """Collects bytes and hands them to the system in one write.

    Nothing stays half written: when the system takes only a part, that part is cut off again.
    """

    __slots__ = ("_buffer", "_file", "_flushed_bytes", "_size")

    def __init__(self, path: Path) -> None:
        """Create the file.

        Raises:
            OSError: it exists already or cannot be made.
        """
        self._file = io.FileIO(path, "x+")
        self._buffer: list[bytes] = []
        self._flushed_bytes = 0
        self._size = 0

    def write(self, data: bytes) -> int:
        """Add bytes; they stay in this process until `flush`."""
        self._buffer.append(data)
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """Size of the file, with what is not flushed yet."""
        return self._size

    def read_at(self, position: int, size: int) -> bytes:
        """Read what has been flushed, at most `size` bytes.

        Raises:
            OSError: it cannot be read.
        """
        return os.pread(self._file.fileno(), size, position)

    def flush(self) -> None:
        """Hand everything to the system.

        Raises:
            OSError: it refuses; the file ends where it did before, and the bytes are lost.
            MemoryError: there is none left; the same.
        """
        try:
            rest = memoryview(b"".join(self._buffer))
            self._buffer.clear()
            while rest:
                # One call may take only a part, when the disk fills up.
                rest = rest[self._file.write(rest) or 0 :]
        except (OSError, MemoryError):
            self._buffer.clear()
            self._size = self._flushed_bytes
            self._file.seek(self._flushed_bytes)
            self._file.truncate()
            raise
        self._flushed_bytes = self._size

    @property
    def closed(self) -> bool:
        """True once it is closed."""
        return self._file.closed

    def abandon(self) -> None:
        """Close without writing what is left; never raises."""
        self._buffer.clear()
        with contextlib.suppress(OSError):
            self._file.close()

    def close(self) -> None:
        """Flush and close; safe to call twice.

        Raises:
            OSError: the last bytes cannot be written; the file is closed all the same.
        """
        if self._file.closed:
            return
        try:
            self.flush()
        finally:
            self._file.close()
