"""One segment: a shim, a relay, a client, and the machine's own timer noise beside them."""

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmarks.harness import ROOT

_PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20
_LOOKS_EVERY_S = 0.5
_ENDS_WITHIN_S = 15.0
_BUSY = "while True: pass"


class SegmentError(Exception):
    """A process of the segment has failed; the text has what it said."""


@dataclass(frozen=True, slots=True)
class Client:
    """What answers the states."""

    name: str
    command: Sequence[str]
    """`{url}` in it becomes where the relay speaks to."""
    tagged: bool = False
    """Its setpoints tell their states by their thrusts, not by their times."""


@dataclass(slots=True)
class Segment:
    """What was seen of one."""

    client: str
    loaded: bool
    pairs_ns: list[tuple[int, int]]
    """Moment of each answered state, and how long its setpoint took."""
    samples_ns: list[int]
    repeated: int
    noise_ms: list[float]
    rss_mib: list[tuple[int, float]]
    """Moment, ns, and the client's resident memory then."""
    processor_share: float
    """Of one processor, by the client."""
    said: str
    """The client's standard output."""


def fly_segment(client: Client, vehicle: Path, *, loaded: bool) -> Segment:
    """Let a client answer a shim's states until it ends by itself.

    Args:
        client: started, and waited for.
        vehicle: the shim's.
        loaded: keep the last processor busy meanwhile.

    Raises:
        SegmentError: something did not run.
    """
    with ExitStack() as stack:
        port = _free_port()
        keys = "tags" if client.tagged else "times"
        relay = stack.enter_context(_beside("relay", keys, str(port)))
        shim = stack.enter_context(_process(_shim(vehicle, int(_line(relay)))))
        _line(shim)
        if loaded:
            busy = stack.enter_context(_process([sys.executable, "-c", _BUSY]))
            os.sched_setaffinity(busy.pid, [max(os.sched_getaffinity(0))])
        noise = stack.enter_context(_beside("timer_noise"))
        url = f"udpin://127.0.0.1:{port}"
        command = [word.replace("{url}", url) for word in client.command]
        said, memory, share = _watched(command)
        late_ms = json.loads(_rest(noise))
        seen = json.loads(_rest(relay))
    return Segment(
        client.name,
        loaded,
        [(moment, took) for moment, took in seen["pairs_ns"]],
        seen["samples_ns"],
        seen["repeated"],
        late_ms,
        memory,
        share,
        said,
    )


def _shim(vehicle: Path, remote: int) -> list[str]:
    return [
        *(sys.executable, "-m", "sitl_shim", "run", f"--vehicle={vehicle}", "--seed=1"),
        *("--onboard-port=0", f"--onboard-remote={remote}", "--gcs-port=0", "--exit-with-parent"),
    ]


def _free_port() -> int:
    """One that was free a moment ago."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def _beside(module: str, *words: str) -> "AbstractContextManager[subprocess.Popen[str]]":
    return _process([sys.executable, "-m", f"benchmarks.real_time.{module}", *words])


@contextmanager
def _process(command: Sequence[str]) -> Iterator["subprocess.Popen[str]"]:
    """A process that ends with the block, at the latest."""
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def _line(process: "subprocess.Popen[str]") -> str:
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        raise SegmentError(f"{process.args!r} does not start")
    return line


def _rest(process: "subprocess.Popen[str]") -> str:
    """Close its standard input, and read what it says to that."""
    return process.communicate(timeout=_ENDS_WITHIN_S)[0]


def _watched(command: Sequence[str]) -> tuple[str, list[tuple[int, float]], float]:
    """Run a client: what it said, its memory over its time, and its share of a processor."""
    memory: list[tuple[int, float]] = []
    ticks = 0
    begin = time.monotonic()
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    ) as process:
        try:
            while process.poll() is None:
                looked = _look(process.pid)
                if looked is not None:
                    memory.append((time.time_ns(), looked[0]))
                    ticks = looked[1]
                time.sleep(_LOOKS_EVERY_S)
        finally:
            process.kill()
        took_s = time.monotonic() - begin
        said, complaints = process.communicate()
    if process.returncode != 0:
        raise SegmentError(f"{' '.join(command)}: {(complaints or said).strip()[-2000:]}")
    return said, memory, ticks / os.sysconf("SC_CLK_TCK") / took_s


def _look(pid: int) -> tuple[float, int] | None:
    """Resident memory, MiB, and clock ticks of a process (proc_pid_stat(5)); None: it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    pages = int(fields[21])
    return (pages * _PAGE_MIB, int(fields[11]) + int(fields[12])) if pages else None
