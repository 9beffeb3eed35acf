"""What ``companion recover`` does: save what is whole of a log that was not finished."""

import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO

from rich.console import Console

from companion.mavlink.crc import CRC_TABLE, crc16
from companion.mavlink.dialect import CRC_EXTRA, CRC_EXTRA_UNDECODABLE
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME, recovered_path
from companion.recording.loss import Loss
from companion.recording.mcap_recovery import (
    McapFindings,
    NotOursError,
    examine_mcap,
    write_recovered_mcap,
)
from companion.recording.tlog_recovery import TlogFindings, examine_tlog, write_recovered_tlog

_DONE = 0
_NOTHING_LEFT = 1
_BAD_INPUT = 2
_MOST_LOSSES_TOLD = 10
_NOT_ON_A_TERMINAL = 1000
_CRC_SEED = CRC_EXTRA | CRC_EXTRA_UNDECODABLE


class _RefusedError(Exception):
    """Nothing was written; the text says what, where and the remedy."""


@dataclass(frozen=True, slots=True)
class RecoverRequest:
    """The options of the command line."""

    path: Path
    """A log, or a flight's folder."""
    out: Path | None = None
    """The file to write; None: beside the log, with `.recovered` before its ending."""


def run_recover(request: RecoverRequest) -> int:
    """Save what is whole, and tell what was found; the original stays as it is.

    Returns:
        The exit status: 0 recovered, or whole already; 1 nothing in it is whole; 2 bad input.
        Of a folder's logs the worst.
    """
    try:
        logs = _logs(request)
    except _RefusedError as error:
        return _refused(error)
    return max(_status(log, request.out) for log in logs)


def _status(log: Path, asked: Path | None) -> int:
    """Recover one log; what stands in its way is told, and leaves the others alone."""
    try:
        return _recover(log, asked)
    except _RefusedError as error:
        return _refused(error)


def _refused(error: _RefusedError) -> int:
    _console(sys.stderr).print(f"error: {error}", markup=False)
    return _BAD_INPUT


def _logs(request: RecoverRequest) -> list[Path]:
    path = request.path
    if not path.is_dir():
        if path.suffix not in (".mcap", ".tlog"):
            raise _RefusedError(f"{path}: a log ends in .mcap or .tlog. Name one, or a folder.")
        return [path]
    logs = [path / name for name in (MCAP_NAME, TLOG_NAME) if (path / name).is_file()]
    if not logs:
        raise _RefusedError(
            f"{path} holds neither {MCAP_NAME} nor {TLOG_NAME}. Name a flight's folder, or a log."
        )
    if request.out is not None and len(logs) > 1:
        raise _RefusedError(
            f"--out names one file, and {path} holds {MCAP_NAME} and {TLOG_NAME}. Name one of them."
        )
    return logs


def _recover(log: Path, asked: Path | None) -> int:
    """Save what is whole of one log."""
    console = _console(sys.stdout)
    out = asked or recovered_path(log)
    found: McapFindings | TlogFindings
    try:
        found = examine_mcap(log) if log.suffix == ".mcap" else examine_tlog(log, _crc_fits)
    except OSError as error:
        raise _RefusedError(f"{log} cannot be read: {error.strerror or error}.") from error
    except NotOursError as error:
        raise _RefusedError(f"{log} is no flight's log: {error}.") from error
    count, things = (
        (found.records, "records")
        if isinstance(found, McapFindings)
        else (found.packets, "packets")
    )
    said = f"{log}: {count:,} {things}{_between(found.first_us, found.last_us)}"
    if found.whole and count:
        console.print(f"{said}; it is whole, nothing is to be done", markup=False)
        return _DONE
    console.print(said, markup=False)
    for text in _told_losses(found):
        console.print(f"  {text}", markup=False)
    if not count:
        console.print("  nothing in it is whole: nothing was written", markup=False)
        return _NOTHING_LEFT
    _write(log, found, out)
    if isinstance(found, McapFindings) and not found.indexed:
        console.print("  it has no index that fits: one was made", markup=False)
    console.print(f"  written: {out}", markup=False)
    return _DONE


def _write(log: Path, found: McapFindings | TlogFindings, out: Path) -> None:
    try:
        if isinstance(found, McapFindings):
            write_recovered_mcap(log, found, out)
        else:
            write_recovered_tlog(log, found, out)
    except FileExistsError as error:
        raise _RefusedError(
            f"{out} exists already and is not written over. Choose another file with --out."
        ) from error
    except OSError as error:
        raise _RefusedError(
            f"{out} cannot be written: {error.strerror or error}. Choose another place with --out."
        ) from error


def _told_losses(found: McapFindings | TlogFindings) -> list[str]:
    """What is missing, in a line each."""
    losses = found.losses
    texts = [_told_loss(loss, found.first_us) for loss in losses[:_MOST_LOSSES_TOLD]]
    if len(losses) > _MOST_LOSSES_TOLD:
        further = losses[_MOST_LOSSES_TOLD:]
        size = sum(loss.end - loss.start for loss in further)
        texts.append(f"lost: {size:,} bytes in {len(further)} further places")
    return texts


def _told_loss(loss: Loss, first_us: int | None) -> str:
    size = loss.end - loss.start
    what = f"{size:,} bytes at byte {loss.start:,}{', all zeros' if loss.zeros else ''}"
    if loss.at_end:
        return f"cut off at the end: {what}"
    if loss.duration_s is None or first_us is None or loss.after_us is None:
        return f"lost: {what}, before the first that is whole"
    at_s = (loss.after_us - first_us) * 1e-6
    return f"lost: {what}: up to {loss.duration_s:.2f} s, {at_s:.2f} s after the first"


def _between(first_us: int | None, last_us: int | None) -> str:
    if first_us is None or last_us is None:
        return ""
    begin, end = (_told_time(time_us) for time_us in (first_us, last_us))
    return f" from {begin} to {end} ({(last_us - first_us) * 1e-6:.2f} s)"


def _told_time(time_us: int) -> str:
    try:
        moment = datetime.fromtimestamp(time_us * 1e-6, UTC)
    except (OverflowError, OSError, ValueError):
        return f"{time_us} µs"
    return moment.isoformat(" ", "milliseconds").removesuffix("+00:00") + "Z"


def _crc_fits(packet: bytes) -> bool | None:
    """Check a packet by its CRC, where the message's seed is known."""
    if packet[0] == 0xFD:
        end = 10 + packet[1]
        message_id = int.from_bytes(packet[7:10], "little")
    else:
        end = 6 + packet[1]
        message_id = packet[5]
    seed = _CRC_SEED.get(message_id)
    if seed is None:
        return None
    if len(packet) < end + 2:
        return False
    crc = crc16(packet[1:end])
    crc = CRC_TABLE[(crc ^ seed) & 0xFF] ^ (crc >> 8)
    return int.from_bytes(packet[end : end + 2], "little") == crc


def _console(stream: TextIO) -> Console:
    """What is not for a terminal is not wrapped."""
    width = None if stream.isatty() else _NOT_ON_A_TERMINAL
    return Console(file=stream, highlight=False, width=width)
