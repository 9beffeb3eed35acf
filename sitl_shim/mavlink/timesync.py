"""A client's clock against the boot clock, as PX4 keeps it from its own TIMESYNC questions.

By PX4's source (lib/timesync): an answer with a round trip of 10 ms or more is dropped; the offset
is smoothed together with its rate of change; only after 500 answers, 50 s, are time stamps
believed.  Until then what comes is taken to be of the moment at which it comes.
"""

from math import exp

_LONGEST_ROUND_TRIP_US = 10_000
_LARGEST_DEVIATION_US = 100_000
_DEVIATIONS_TO_BELIEVE = 5
_CONVERGED_AFTER = 500
_ALPHA = (0.05, 0.003)
_BETA = (0.05, 0.003)


class Timesync:
    """Offset of one client's clock."""

    __slots__ = ("_answers", "_deviations", "_offset_us", "_skew_us")

    def __init__(self) -> None:
        self._reset()

    def _reset(self) -> None:
        self._answers = 0
        self._deviations = 0
        self._offset_us = 0.0
        self._skew_us = 0.0

    @property
    def converged(self) -> bool:
        """Whether time stamps of the client's are believed."""
        return self._answers >= _CONVERGED_AFTER

    def answer(self, sent_us: int, remote_us: float, now_us: int) -> None:
        """Take the client's answer to a question.

        Args:
            sent_us: boot time at which the question left.
            remote_us: the client's time at which it answered.
            now_us: boot time now.
        """
        if now_us - sent_us >= _LONGEST_ROUND_TRIP_US:
            return
        offset_us = 0.5 * (sent_us + now_us) - remote_us
        if self.converged and abs(offset_us - self._offset_us) > _LARGEST_DEVIATION_US:
            self._deviations += 1
            if self._deviations > _DEVIATIONS_TO_BELIEVE:
                self._reset()
            return
        self._deviations = 0
        if self._answers == 0:
            self._offset_us = offset_us
        else:
            alpha, beta = self._gain(_ALPHA), self._gain(_BETA)
            before = self._offset_us
            self._offset_us = alpha * offset_us + (1.0 - alpha) * (before + self._skew_us)
            self._skew_us = beta * (self._offset_us - before) + (1.0 - beta) * self._skew_us
        self._answers += 1

    def boot_time_us(self, stamp_us: float, now_us: int) -> float:
        """What a time stamp of the client's is by the boot clock."""
        return stamp_us + self._offset_us if self.converged else float(now_us)

    def _gain(self, ends: tuple[float, float]) -> float:
        """From the first gain to the last as the answers come in."""
        progress = min(1.0, self._answers / _CONVERGED_AFTER)
        share = 1.0 - exp(0.5 * (1.0 - 1.0 / max(1e-3, 1.0 - progress))) if progress < 1.0 else 1.0
        return share * ends[1] + (1.0 - share) * ends[0]
