"""Whether the estimator may be trusted: ten looks, a tenth of a second apart, decide.

From ArduCopter's documentation (https://ardupilot.org/copter/docs/ekf-inav-failsafe.html) and
source.  Of what it looks at, only whether there is a position can fail here.
"""

from enum import Enum

PERIOD_US = 100_000
_FAILURES = 10


class EkfVerdict(Enum):
    """What a look brought."""

    NOTHING_NEW = "nothing new"
    FAILED = "failed"
    CLEARED = "cleared"


class EkfCheck:
    """Counts looks that failed; as many good ones undo them."""

    __slots__ = ("_count", "_has_passed", "failed")

    def __init__(self) -> None:
        self._count = 0
        self._has_passed = False
        self.failed = False

    def look(self, *, position_known: bool) -> EkfVerdict:
        """One look, every `PERIOD_US`; before the first position nothing can fail."""
        self._has_passed = self._has_passed or position_known
        if not self._has_passed:
            return EkfVerdict.NOTHING_NEW
        if not position_known:
            if not self.failed:
                self._count += 1
                self.failed = self._count >= _FAILURES
                return EkfVerdict.FAILED if self.failed else EkfVerdict.NOTHING_NEW
        elif self._count > 0:
            self._count -= 1
            if self.failed and self._count == 0:
                self.failed = False
                return EkfVerdict.CLEARED
        return EkfVerdict.NOTHING_NEW
