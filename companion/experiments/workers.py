"""Work spread over processes that may die, without the parent or the other work dying with them.

A worker begins in a process group of its own, so that Ctrl-C in a terminal reaches the parent
alone: a flight takes the signal for "land".  It ends when its parent does, however that ends.
"""

import concurrent.futures
import gc
import multiprocessing
import os
import threading
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
_PRELOADED = "companion.experiments.fly_task"


@dataclass(frozen=True, slots=True)
class Failure:
    """Work that came to nothing."""

    reason: str
    """One line: the exception's, or that the worker died."""


def default_jobs() -> int:
    """As many processes as this one may use processors."""
    try:
        return max(1, len(os.sched_getaffinity(0)))
    except AttributeError:  # not on every system
        return max(1, os.cpu_count() or 1)


class Workers(Generic[Item, Result]):
    """Processes that all do the same kind of work; to be used in a `with` statement."""

    def __init__(self, work: Callable[[Item], Result], jobs: int) -> None:
        """Prepare; the processes start with the first work.

        Args:
            work: a function of a module, since it goes to another process by its name.
            jobs: how many processes.
        """
        self._work = work
        self._jobs = max(1, jobs)
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> "Workers[Item, Result]":
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()

    def run(
        self, items: Sequence[Item], on_done: Callable[[int, Result | Failure], None]
    ) -> list[Result | Failure]:
        """Do all the work.

        When a worker dies, what was in work at that moment is done once more, each alone, so that
        a second death names its cause.

        Args:
            items: what to work on.
            on_done: told the item's index and its result, in the order of completion.

        Returns:
            Results in the order of the items.

        Raises:
            BaseException: what `on_done` or a signal raises; the workers are stopped then.
        """
        results: dict[int, Result | Failure] = {}

        def done(index: int, result: Result | Failure) -> None:
            results[index] = result
            on_done(index, result)

        try:
            suspects = self._together(items, done)
            for index in suspects:
                self._alone(items[index], index, done)
        except BaseException:
            self._stop()
            raise
        return [results[index] for index in range(len(items))]

    def _together(
        self, items: Sequence[Item], done: Callable[[int, Result | Failure], None]
    ) -> list[int]:
        """Work on several at once; give the indices of those during which a worker died.

        No more than one item a process is handed out: what waits is not touched by a death.
        """
        suspects: list[int] = []
        waiting = list(range(len(items)))[::-1]
        running: dict[Future[Result], int] = {}
        while running or waiting:
            broken = False
            while waiting and len(running) < self._jobs and not broken:
                index = waiting.pop()
                try:
                    running[self._submit(items[index])] = index
                except BrokenProcessPool:  # a worker died since the last look
                    waiting.append(index)
                    broken = True
            finished, _ = concurrent.futures.wait(
                running, return_when=concurrent.futures.FIRST_COMPLETED
            )
            for future in sorted(finished, key=running.__getitem__):
                index = running.pop(future)
                result = _result(future)
                if result is None:
                    broken = True
                    suspects.append(index)
                else:
                    done(index, result)
            if broken:
                suspects += running.values()
                running.clear()
                self._stop()
        return sorted(suspects)

    def _alone(self, item: Item, index: int, done: Callable[[int, Result | Failure], None]) -> None:
        """The second attempt at something during which a worker died."""
        try:
            result = _result(self._submit(item))
        except BrokenProcessPool:
            result = None
        if result is None:
            self._stop()
            result = Failure("its process died twice (killed, or out of memory?)")
        done(index, result)

    def _submit(self, item: Item) -> "Future[Result]":
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self._jobs, mp_context=_context(), initializer=_begin_worker
            )
        with _single_threaded_libraries():
            return self._pool.submit(self._work, item)

    def _stop(self) -> None:
        """End the processes at once: a signal that asks would be taken for "land"."""
        pool, self._pool = self._pool, None
        if pool is None:
            return
        processes = list((pool._processes or {}).values())  # no public way before Python 3.14
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.kill()
        for process in processes:
            process.join()


def _result(future: "Future[Result]") -> Result | Failure | None:
    """What became of a piece of work; None if its process died."""
    try:
        return future.result()
    except BrokenProcessPool:
        return None
    except Exception as error:
        said = str(error).strip().splitlines()
        return Failure(f"{type(error).__name__}: {said[0] if said else ''}".rstrip(": "))


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
