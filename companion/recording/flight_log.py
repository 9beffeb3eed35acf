"""The log of one flight: a folder with the packets and the controller's records."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from companion.recording.mcap_log import McapLog
from companion.recording.schema import ChannelSpec
from companion.recording.tlog import TlogWriter

TLOG_NAME = "flight.tlog"
MCAP_NAME = "flight.mcap"
RECOVERED = ".recovered"
"""Before the ending of what was recovered of a log."""

_LATEST_S = 1.0e9
"""Times beyond this do not fit the files' time stamps everywhere, and no clock gives them."""


def recovered_path(log: Path) -> Path:
    """Where what is recovered of a log goes, unless another file is named."""
    return log.with_name(f"{log.stem}{RECOVERED}{log.suffix}")


def recovered_first(log: Path) -> Path:
    """What was recovered of a log (`companion recover`) after it had ended; else the log itself.

    What was recovered while the flight went on is less than the log.
    """
    recovered = recovered_path(log)
    if not recovered.is_file():
        return log
    ended = not log.is_file() or recovered.stat().st_mtime_ns >= log.stat().st_mtime_ns
    return recovered if ended else log


class LogListener(Protocol):
    """Looks on while a flight is recorded; must return quickly."""

    def on_record(self, topic: str, time_s: float, values: Mapping[str, Any]) -> None:
        """A record was kept; its values are changed by nobody."""

    def on_frame_in(self, time_s: float, raw: bytes) -> None:
        """A packet that was received was kept."""


class FlightLogError(Exception):
    """The log cannot be begun; the text says what, where and the remedy, in one paragraph."""


class FlightLog:
    """Owns the files of a flight's folder.

    Nothing here raises once the flight has begun: when a file cannot be written any more, it is
    given up, `trouble` says so, and the flight goes on.  What has an impossible time (not finite,
    negative, beyond 30 years) or cannot be encoded is counted as `lost`.

    The system is asked to write once each `flush_interval_s` of the caller's time, and never
    before a setpoint that is due: not when something is sent or decided, but when a received
    packet is recorded, which the connection does after all that came with it has been answered.
    While nothing comes in, `flush_if_due` has to be called.
    """

    def __init__(
        self,
        folder: Path,
        channels: Sequence[ChannelSpec] = (),
        base_us: int = 0,
        flush_interval_s: float = 0.2,
    ) -> None:
        """Begin a log.

        Args:
            folder: made if it is not there; it must hold no log yet.
            channels: the channels of records that are known from the start.
            base_us: microseconds since 1970 at the caller's time 0.  The caller's clock and this
                are all that time stamps are made of: the same flight gives the same bytes.
            flush_interval_s: longest time that anything stays in this process.

        Raises:
            FlightLogError: the folder or a file in it cannot be made.
        """
        self.folder = folder
        self.trouble: str | None = None
        """What cannot be recorded any more and why, in one sentence; None while all is well."""
        self.lost = 0
        """Packets and records that were given and not recorded."""
        self.listener: LogListener | None = None
        """Told of what comes in and of the records; one that raises is told no more."""
        self._interval_s = flush_interval_s
        self._flush_at_s = -float("inf")
        self._receiving = False
        self._tlog: TlogWriter | None = None
        self._mcap: McapLog | None = None
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._tlog = TlogWriter(folder / TLOG_NAME, base_us)
            self._mcap = McapLog(folder / MCAP_NAME, channels, base_us)
            self._tlog.flush()
            self._mcap.flush()
        except OSError as error:
            self._release()
            raise FlightLogError(_why_not(folder, error)) from error

    def frame_in(self, time_s: float, raw: bytes) -> None:
        """Record a packet that was received; then hand everything to the system, if it is due."""
        self._receiving = True
        if self._tlog is None or not 0.0 <= time_s < _LATEST_S:
            self.lost += 1
        else:
            self._tlog.write(time_s, raw, sent=False)
        if self.listener is not None:
            try:
                self.listener.on_frame_in(time_s, raw)
            except Exception:
                self.listener = None
        if time_s >= self._flush_at_s:
            self.flush_if_due(time_s)

    def frame_out(self, time_s: float, raw: bytes) -> None:
        """Record a packet that was sent."""
        if self._tlog is None or not 0.0 <= time_s < _LATEST_S:
            self.lost += 1
        else:
            self._tlog.write(time_s, raw, sent=True)

    def record(self, topic: str, time_s: float, values: Mapping[str, Any]) -> None:
        """Record what a stage of the controller says about itself."""
        if self._mcap is None or not _possible(time_s):
            self.lost += 1
        else:
            try:
                self._mcap.write(topic, time_s, values)
            except OSError as error:
                self._give_up_mcap(error)
            except Exception:  # of the values, not of the file: the next record may be good
                self.lost += 1
        if self.listener is not None:
            try:
                self.listener.on_record(topic, time_s, values)
            except Exception:
                self.listener = None
        if not self._receiving:
            self.flush_if_due(time_s)

    def flush_if_due(self, time_s: float) -> None:
        """Hand everything to the system, if the interval is over."""
        if time_s >= self._flush_at_s and _possible(time_s):
            self._flush_at_s = time_s + self._interval_s
            self.flush()

    def flush(self) -> None:
        """Hand everything to the system now."""
        try:
            if self._tlog is not None:
                self._tlog.flush()
        except Exception as error:
            self._give_up_tlog(error)
        try:
            if self._mcap is not None:
                self._mcap.flush()
        except Exception as error:
            self._give_up_mcap(error)

    def close(self) -> None:
        """Finish the files; safe to call twice."""
        self.flush()
        self._release()

    def _give_up_tlog(self, error: Exception) -> None:
        if self._tlog is not None:
            self._tlog.abandon()
            self._tlog = None
        self._complain(TLOG_NAME, error)

    def _give_up_mcap(self, error: Exception) -> None:
        if self._mcap is not None:
            self._mcap.abandon()
            self._mcap = None
        self._complain(MCAP_NAME, error)

    def _complain(self, name: str, error: Exception) -> None:
        said = f"{name} in {self.folder} is no longer written: {_reason(error)}"
        self.trouble = said if self.trouble is None else f"{self.trouble}; {said}"

    def _release(self) -> None:
        try:
            if self._tlog is not None:
                self._tlog.close()
        except Exception as error:
            self._give_up_tlog(error)
        try:
            if self._mcap is not None:
                self._mcap.close()
        except Exception as error:
            self._give_up_mcap(error)
        self._tlog = self._mcap = None


def _possible(time_s: float) -> bool:
    """True for a time that the files can hold; comparisons with NaN are false."""
    return 0.0 <= time_s < _LATEST_S


def _reason(error: Exception) -> str:
    """What a person should read of an error."""
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return f"{type(error).__name__}: {error}".removesuffix(": ")


def _why_not(folder: Path, error: OSError) -> str:
    """One paragraph on what is wrong with the folder, and the remedy."""
    begin = f"The flight cannot be recorded in {folder}: "
    if isinstance(error, FileExistsError) and folder.is_dir():
        return begin + "it holds a flight's log already. Choose another folder with --out."
    if isinstance(error, (FileExistsError, NotADirectoryError)):
        return begin + "a file has that name. Choose another folder with --out."
    return begin + (
        f"{error.strerror or error}. Make the folder writable, free some space, or choose "
        "another folder with --out."
    )
