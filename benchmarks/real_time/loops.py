"""What the event loop itself takes of a datagram: asyncio's own against uvloop's.

Each loop in turn runs in a process of its own, with a socket's reader and a few timers, as a flight
has them; every sixth datagram is answered.  This process sends at the flight's rates and takes the
system's stamps of the answers.

    python -m benchmarks.real_time.loops asyncio|uvloop      # the process that answers
"""

import asyncio
import importlib.util
import json
import socket
import subprocess
import sys
import time
from collections.abc import Callable

from benchmarks.harness import ROOT, quantiles
from benchmarks.real_time.stamps import receive_stamped, stamped

LOOPS = ("asyncio", "uvloop")
_ROUNDS = 5
_ANSWERED = 300
"""Of each round."""
_UNANSWERED = 5
"""Between two of them."""
_PAUSE_S = 0.0015
_ASKS, _TELLS, _ENDS = b"\1" * 250, b"\2" * 60, b"\3"
_LARGEST = 65_536


def compare() -> dict[str, dict[str, float]] | None:
    """Time to an answer, µs, and processor time for a datagram, µs; None without uvloop."""
    if importlib.util.find_spec("uvloop") is None:
        return None
    took_us: dict[str, list[float]] = {name: [] for name in LOOPS}
    spent_us: dict[str, list[float]] = {name: [] for name in LOOPS}
    for _ in range(_ROUNDS):
        for name in LOOPS:
            took, spent = _round(name)
            took_us[name] += took
            spent_us[name].append(spent)
    return {
        name: {
            **{f"answer_{key}_us": round(us, 1) for key, us in quantiles(took_us[name]).items()},
            "processor_us_a_datagram": round(quantiles(spent_us[name])["p50"], 1),
        }
        for name in LOOPS
    }


def _round(name: str) -> tuple[list[float], float]:
    took_us: list[float] = []
    with (
        subprocess.Popen(
            [sys.executable, "-m", "benchmarks.real_time.loops", name],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            text=True,
        ) as process,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asker,
    ):
        assert process.stdout is not None
        there = ("127.0.0.1", int(process.stdout.readline()))
        stamped(asker)
        asker.settimeout(5.0)
        for _ in range(_ANSWERED):
            sent_ns = time.time_ns()
            asker.sendto(_ASKS, there)
            _, _, stamp_ns = receive_stamped(asker)
            took_us.append((stamp_ns - sent_ns) / 1e3)
            for _ in range(_UNANSWERED):
                time.sleep(_PAUSE_S)
                asker.sendto(_TELLS, there)
        asker.sendto(_ENDS, there)
        spent_s = float(process.stdout.readline())
    return took_us, 1e6 * spent_s / (_ANSWERED * (1 + _UNANSWERED))


async def _answer() -> float:
    """Answer until told to end; the processor time that it took, s."""
    loop = asyncio.get_running_loop()
    ended = loop.create_future()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as answering:
        answering.bind(("127.0.0.1", 0))
        answering.setblocking(False)

        def read() -> None:
            while True:
                try:
                    data, sender = answering.recvfrom(_LARGEST)
                except BlockingIOError:
                    return
                if data == _ASKS:
                    answering.sendto(data, sender)
                elif data == _ENDS and not ended.done():
                    ended.set_result(None)

        def chore() -> None:
            loop.call_later(0.01, chore)

        loop.add_reader(answering.fileno(), read)
        for _ in range(3):
            chore()
        sys.stdout.write(json.dumps(answering.getsockname()[1]) + "\n")
        sys.stdout.flush()
        begin_s = time.process_time()
        await ended
        spent_s = time.process_time() - begin_s
        loop.remove_reader(answering.fileno())
    return spent_s


def _loop_of(name: str) -> Callable[[], asyncio.AbstractEventLoop]:
    if name == "asyncio":
        return asyncio.new_event_loop
    import uvloop

    class PreciseLoop(uvloop.Loop):
        """uvloop's own time has steps of 1 ms, and stands still while callbacks run."""

        def time(self) -> float:
            """Of the monotonic clock, s."""
            return time.monotonic()

    return PreciseLoop


if __name__ == "__main__":
    with asyncio.Runner(loop_factory=_loop_of(sys.argv[1])) as runner:
        sys.stdout.write(f"{runner.run(_answer())}\n")
