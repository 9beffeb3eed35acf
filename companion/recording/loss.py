"""What is missing from a log, as its recovery tells it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Loss:
    """A stretch of a file that holds nothing whole."""

    start: int
    """First byte."""
    end: int
    """First byte behind it."""
    after_us: int | None
    """Time of the last whole record before it, microseconds since 1970; None: there is none."""
    before_us: int | None
    """Time of the first whole record behind it; None: there is none, the file ends in it."""
    zeros: bool = False
    """It holds nothing but zeros, as a power cut leaves them."""

    @property
    def at_end(self) -> bool:
        """True if nothing whole comes behind it."""
        return self.before_us is None

    @property
    def duration_s(self) -> float | None:
        """Between the whole records around it; None where one of them is missing."""
        if self.after_us is None or self.before_us is None:
            return None
        return max(0.0, (self.before_us - self.after_us) * 1e-6)


def only_zeros(data: bytes) -> bool:
    """True for a stretch without anything in it."""
    return not data.strip(b"\0")
