"""A process that sleeps to deadlines and does nothing else, until its standard input closes.

    python -m benchmarks.real_time.timer_noise

It then says how late each wake-up was, ms, as one JSON list.
"""

import json
import select
import sys
import time

_PERIOD_S = 0.01
_LOOKS_EVERY = 50
"""Periods between looks at the standard input, which take a few µs."""


def main() -> None:
    """Sleep to deadlines 10 ms apart."""
    late_ms: list[float] = []
    begin = time.monotonic()
    for k in range(1, sys.maxsize):
        due = begin + k * _PERIOD_S
        time.sleep(max(0.0, due - time.monotonic()))
        late_ms.append(round(1e3 * (time.monotonic() - due), 4))
        if k % _LOOKS_EVERY == 0 and select.select([sys.stdin], [], [], 0.0)[0]:
            break
    sys.stdout.write(json.dumps(late_ms) + "\n")


if __name__ == "__main__":
    main()
