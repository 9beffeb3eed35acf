"""Cuts recordings of real autopilots down to what the replay to the shim needs.

``python tools/trim_captures.py FOLDER`` reads ``FOLDER/*.tlog`` and writes, into
``tests/data/captures``, for each

* ``NAME.tlog.gz``: every packet of the clients; of the vehicle's packets all that are no telemetry
  stream, and of the streams a few a second.  The time of each is that of the autopilot's boot
  clock, which drifts against the computer's;
* ``NAME.json``: how many messages of each id came in each window of five seconds.
"""

import gzip
import json
import struct
import sys
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from companion.mavlink.codec import decode
from companion.mavlink.framing import Frame, Framer
from companion.recording.tlog import read_tlog

TARGET = Path(__file__).parents[1] / "tests" / "data" / "captures"
VEHICLE = (1, 1)
WINDOW_S = 5.0
_ALL_OF = frozenset(
    {0, 1, 22, 39, 40, 42, 44, 45, 46, 47, 49, 51, 73, 77, 110, 148, 244, 245, 253, 300, 345}
    | {395, 396, 397, 410, 411, 412, 413, 435, 436}
)
_PING, _TIMESYNC = 4, 111
_FIVE_A_SECOND = frozenset({30, 31, 32, 83})
_ONE_A_SECOND_S = 1.0


def frames_of(path: Path) -> list[tuple[float, Frame]]:
    """Frames with the computer's time, s from the first one on."""
    framer = Framer()
    records = list(read_tlog(path))
    return [
        ((record.time_us - records[0].time_us) * 1e-6, frame)
        for record in records
        for frame in framer.feed(record.raw)
    ]


def boot_clock(frames: list[tuple[float, Frame]]) -> list[tuple[float, float]]:
    """(computer's time, boot time) of about one packet a second, both growing."""
    pairs: dict[int, list[tuple[float, float]]] = {}
    for time_s, frame in frames:
        if (frame.system_id, frame.component_id) == VEHICLE and frame.message_id in (30, 31, 32):
            pairs.setdefault(int(time_s), []).append((time_s, decode(frame).time_boot_ms * 1e-3))
    # The least late of each second.
    return [max(group, key=lambda pair: pair[1] - pair[0]) for group in pairs.values()]


def boot_time(clock: list[tuple[float, float]], time_s: float) -> float:
    """Boot time at a time of the computer's."""
    index = min(max(bisect_right(clock, (time_s, 0.0)), 1), len(clock) - 1)
    (t0, b0), (t1, b1) = clock[index - 1], clock[index]
    if time_s < clock[0][0]:
        return b0 - (t0 - time_s)
    return b0 + (b1 - b0) / (t1 - t0) * (time_s - t0)


def trimmed(frames: list[tuple[float, Frame]]) -> Iterator[tuple[float, Frame]]:
    """What is kept."""
    next_s: dict[int, float] = {}
    for time_s, frame in frames:
        message_id = frame.message_id
        kept = (frame.system_id, frame.component_id) != VEHICLE
        kept = kept or message_id in _ALL_OF or _is_answer(frame)
        if not kept and time_s >= next_s.get(message_id, 0.0):
            kept = True
            period_s = 0.2 if message_id in _FIVE_A_SECOND else _ONE_A_SECOND_S
            next_s[message_id] = time_s + period_s
        if kept:
            yield time_s, frame


def _is_answer(frame: Frame) -> bool:
    """Of the two messages that are streams and answers, too."""
    if frame.message_id == _PING:
        return bool(decode(frame).target_system)
    return frame.message_id == _TIMESYNC and bool(decode(frame).tc1)


def main() -> None:
    """Trim every recording of a folder."""
    for path in sorted(Path(sys.argv[1]).glob("*.tlog")):
        frames = frames_of(path)
        clock = boot_clock(frames)
        timed = [(boot_time(clock, time_s), frame) for time_s, frame in frames]
        counts: dict[int, Counter[int]] = {}
        for time_s, frame in timed:
            if (frame.system_id, frame.component_id) == VEHICLE:
                counts.setdefault(frame.message_id, Counter())[int(time_s / WINDOW_S)] += 1
        rates = {
            "window_s": WINDOW_S,
            "begins_s": round(timed[0][0], 3),
            "ends_s": round(timed[-1][0], 3),
            "counts": {
                str(message_id): {str(window): n for window, n in sorted(windows.items())}
                for message_id, windows in sorted(counts.items())
            },
        }
        log = b"".join(
            struct.pack(">Q", round(max(0.0, time_s) * 1e6)) + frame.raw
            for time_s, frame in trimmed(timed)
        )
        # No time stamp and no name: the same bytes for the same recording.
        packed = gzip.compress(log, 9, mtime=0)
        (TARGET / f"{path.stem}.tlog.gz").write_bytes(packed)
        (TARGET / f"{path.stem}.json").write_text(json.dumps(rates, separators=(",", ":")) + "\n")
        print(f"{path.stem}: {timed[0][0]:.2f} … {timed[-1][0]:.2f} s, {len(packed)} bytes")


if __name__ == "__main__":
    main()
