"""Work spread over processes that may die, without the parent or the other work dying with them.

A worker begins in a process group of its own, so that Ctrl-C in a terminal reaches the parent
alone: a flight takes the signal for "land".  It ends when its parent does, however that ends.
"""

import concurrent.futures
import gc
import multiprocessing
import multiprocessing.forkserver
import os
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

_THREAD_LIMITS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)
_PRELOADED = "companion.experiments.preloaded"
_ATTEMPTS = 3
_DIED = f"its process died {_ATTEMPTS} times (killed, or out of memory?)"


@dataclass(frozen=True, slots=True)
class Failure:
    """Work that came to nothing."""

    reason: str
    """One line: the exception's, or that the worker died."""

    @classmethod
    def of(cls, error: BaseException) -> "Failure":
        """What an exception says, in one line."""
        said = str(error).strip().splitlines()
        return cls(f"{type(error).__name__}: {said[0] if said else ''}".rstrip(": "))


class _Died:
    """In the place of a result: the process is gone."""


def default_jobs() -> int:
    """As many processes as this one may use processors."""
    try:
        return max(1, len(os.sched_getaffinity(0)))
    except AttributeError:  # not on every system
        return max(1, os.cpu_count() or 1)


def prepare_workers() -> None:
    """Begin to load what workers need, while this process does something else."""
    if _context().get_start_method() == "forkserver":
        with _single_threaded_libraries():
            multiprocessing.forkserver.ensure_running()


class Workers(Generic[Item, Result]):
    """Processes that all do the same kind of work; to be used in a `with` statement.

    Each has a pool of its own: a process that dies takes along what it was at, and nothing else.
    """

    def __init__(self, work: Callable[[Item], Result], jobs: int) -> None:
        """Prepare; the processes start with the first work.

        Args:
            work: a function of a module, since it goes to another process by its name.
            jobs: how many processes.
        """
        self._work = work
        self._pools: list[ProcessPoolExecutor | None] = [None] * max(1, jobs)

    def __enter__(self) -> "Workers[Item, Result]":
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()

    def run(
        self, items: Sequence[Item], on_done: Callable[[int, Result | Failure], None]
    ) -> list[Result | Failure]:
        """Do all the work.

        What a worker was at when it died is done again, twice at most, after all the rest: what
        killed it may be over by then.

        Args:
            items: what to work on.
            on_done: told the item's index and its result, in the order of completion.

        Returns:
            Results in the order of the items.

        Raises:
            BaseException: what `on_done` or a signal raises; the workers are stopped then.
        """
        results: dict[int, Result | Failure] = {}
        try:
            for index, result in self._completed(items):
                results[index] = result
                on_done(index, result)
        except BaseException:
            self._stop()
            raise
        return [results[index] for index in range(len(items))]

    def _completed(self, items: Sequence[Item]) -> Iterator[tuple[int, Result | Failure]]:
        """Indices and results as they come.

        A process is given its next item before its last result is told: it waits for nobody.
        """
        waiting = deque(range(len(items)))
        idle = list(range(len(self._pools)))[::-1]
        running: dict[Future[Result], tuple[int, int]] = {}
        deaths = [0] * len(items)
        ended: list[tuple[int, Result | Failure]] = []
        while True:
            while waiting and idle:
                slot, index = idle.pop(), waiting.popleft()
                running[self._submit(slot, items[index])] = slot, index
            yield from ended
            if not running:
                return
            finished, _ = concurrent.futures.wait(
                running, return_when=concurrent.futures.FIRST_COMPLETED
            )
            ended = []
            for future in sorted(finished, key=lambda one: running[one][1]):
                slot, index = running.pop(future)
                idle.append(slot)
                result = _result(future)
                if not isinstance(result, _Died):
                    ended.append((index, result))
                    continue
                self._stop_one(slot)
                deaths[index] += 1
                if deaths[index] < _ATTEMPTS:
                    waiting.append(index)
                else:
                    ended.append((index, Failure(_DIED)))

    def _submit(self, slot: int, item: Item) -> "Future[Result]":
        """Hand an item to a process, which is started if there is none, or it died while idle."""
        with _single_threaded_libraries():
            try:
                return self._pool(slot).submit(self._work, item)
            except BrokenProcessPool:
                self._stop_one(slot)
                return self._pool(slot).submit(self._work, item)

    def _pool(self, slot: int) -> ProcessPoolExecutor:
        pool = self._pools[slot]
        if pool is None:
            pool = ProcessPoolExecutor(1, mp_context=_context(), initializer=_begin_worker)
            self._pools[slot] = pool
        return pool

    def _stop(self) -> None:
        """End the processes at once: a signal that asks would be taken for "land"."""
        for slot in range(len(self._pools)):
            self._stop_one(slot)

    def _stop_one(self, slot: int) -> None:
        pool, self._pools[slot] = self._pools[slot], None
        if pool is None:
            return
        processes = list((pool._processes or {}).values())  # no public way before Python 3.14
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.kill()
        for process in processes:
            process.join()


def _result(future: "Future[Result]") -> "Result | Failure | _Died":
    """What became of a piece of work."""
    try:
        return future.result()
    except BrokenProcessPool:
        return _Died()
    except Exception as error:
        return Failure.of(error)


def _context() -> Any:  # noqa: ANN401 - the contexts have no common public type
    """How processes start: forked from a clean server that has imported the libraries once."""
    if "forkserver" in multiprocessing.get_all_start_methods():
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload([_PRELOADED])
        return context
    return multiprocessing.get_context("spawn")


def _begin_worker() -> None:
    """Of a worker's process, before its first work."""
    if hasattr(os, "setpgid"):
        os.setpgid(0, 0)
    gc.freeze()  # what was imported stays: the collector need not look at it again
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Any) -> None:  # noqa: ANN401 - a class without a public name
    parent.join()
    os._exit(1)


@contextmanager
def _single_threaded_libraries() -> Iterator[None]:
    """Let processes that start in here have numerical libraries of one thread.

    The libraries read it once, when they are loaded; the workers' arrays have three elements, and
    threads that wait for such work only take the processors from the other workers.
    """
    before = {name: os.environ.get(name) for name in _THREAD_LIMITS}
    os.environ.update(dict.fromkeys(_THREAD_LIMITS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
