"""One stretch of work: so many inputs from one seed, in a process that is bounded."""

import gc
import random
import resource
import signal
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tools.fuzz.findings import signature, write_finding
from tools.fuzz.target import FindingError, Target
from tools.fuzz.targets import TARGETS

HANGS_AFTER_S = 30
"""Of processor time in one input: a thousand times what any takes."""
_MEMORY_BYTES = 6 << 30
"""Of address space."""
_CORPUS_SHARE = 0.3
"""Of the inputs, if there is a corpus, are variations of its members."""


@dataclass(frozen=True, slots=True)
class Task:
    """What a process is asked for."""

    target: str
    seed: int
    units: int
    out: Path
    corpus: Path | None = None


@dataclass(slots=True)
class Done:
    """What came of it."""

    units: int = 0
    inputs: int = 0
    slowest_s: float = 0.0
    cpu_s: float = 0.0
    findings: dict[str, str] = field(default_factory=dict)
    """Files by what went wrong."""


class HangError(FindingError):
    """An input that takes too long."""


def begin(target: str) -> Target:
    """Bound this process, and make the target."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, _MEMORY_BYTES))
    signal.signal(signal.SIGPROF, _on_hang)
    warnings.simplefilter("error", RuntimeWarning)
    made = TARGETS[target]()
    gc.freeze()
    return made


def run_one(target: Target, data: bytes) -> int:
    """Run an input, within bounds of time.

    Raises:
        Exception: any is a finding.
    """
    with _limited():
        return target.run(data)


def work(task: Task, target: Target, enough: Callable[[], bool] = lambda: False) -> Done:
    """Run inputs until the units are reached."""
    done = Done()
    members = _members(task.corpus)
    began_s = time.process_time()
    for number in range(1 << 62):
        if done.units >= task.units or enough():
            break
        rng = random.Random(f"{task.target}/{task.seed}/{number}")
        if members and rng.random() < _CORPUS_SHARE:
            data = target.mutate(rng.choice(members), rng)
        else:
            data = target.generate(rng)
        before_s = time.process_time()
        try:
            done.units += run_one(target, data)
        except (Exception, MemoryError) as error:
            done.units += 1
            sign = signature(error)
            if sign not in done.findings:
                path = write_finding(task.out, task.target, target, data, error)
                done.findings[sign] = str(path)
        done.inputs += 1
        done.slowest_s = max(done.slowest_s, time.process_time() - before_s)
    done.cpu_s = time.process_time() - began_s
    return done


def _members(corpus: Path | None) -> list[bytes]:
    if corpus is None or not corpus.is_dir():
        return []
    return [path.read_bytes() for path in sorted(corpus.iterdir()) if path.is_file()]


@contextmanager
def _limited() -> Iterator[None]:
    signal.setitimer(signal.ITIMER_PROF, HANGS_AFTER_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def _on_hang(number: int, frame: object) -> None:
    raise HangError(f"an input takes longer than {HANGS_AFTER_S} s of processor time")
