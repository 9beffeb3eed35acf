"""Flights over a cluster of dask.distributed that runs already.

Only what `Parcel` names goes there, and only figures and flights' files come back: the client alone
writes.  A worker that dies is Dask's to notice, and its flights go to another.
"""

import logging
import queue
import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from companion.config.yaml_source import ConfigError
from companion.experiments.campaign import Job
from companion.experiments.campaigns.members import Client, Members
from companion.experiments.campaigns.parcel import Flown, Parcel, StrangerError, fly_parcel, pack
from companion.experiments.flight_store import (
    MissingExtraError,
    Summary,
    flight_path,
    write_flight_bytes,
)
from companion.experiments.workers import Failure
from companion.extras import install_extra

Future = Any
"""Of dask.distributed, which has no types."""
_CONNECTS_WITHIN_S = 10.0
_AT_ONCE = 1000
_AHEAD = 4
"""Flights that the scheduler knows of, at most, and for each thread: more would fill its memory and
be out of reach of workers that come later, fewer might let workers wait."""
_ATTEMPTS = 3
_LOOK_EVERY_S = 5.0
_LOST = ("lost", "cancelled")


class ClusterLostError(Exception):
    """The scheduler is gone; what is kept is kept."""


@dataclass(frozen=True, slots=True)
class _Sent:
    """A flight that the scheduler knows of."""

    future: Future
    index: int
    fit: tuple[str, ...]
    """Whom it may be given to."""


class DaskCrew:
    """Flies on a cluster; to be used in a `with` statement."""

    def __init__(
        self,
        address: str,
        say: Callable[[str], None],
        fly: Callable[[Parcel], Flown] | None = None,
    ) -> None:
        """Prepare.

        Args:
            address: of the scheduler, ``tcp://HOST:PORT`` or ``tls://HOST:PORT``.
            say: told what a person should know of the cluster.
            fly: what a worker does, in place of flying; a function of a module that is there too.
        """
        self._address = address
        self._say = say
        self._fly = fly or fly_parcel
        self._client: Client = None
        self._members: Members | None = None
        self._alone = False

    def __enter__(self) -> "DaskCrew":
        """Connect, and see which workers have the same program.

        Raises:
            MissingExtraError: dask.distributed is not installed.
            ConfigError: nobody answers, or no worker has this program.
        """
        self._client = _connected(self._address)
        try:
            self._members = Members(self._client, self._address, self._say)
            self._members.begin()
        except BaseException:
            self._leave()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._leave()

    def run(self, items: Sequence[Job], on_done: Callable[[int, Summary | Failure], None]) -> None:
        """Fly all.

        Each flight is for the workers that were met and have this program, and for no others: one
        that refuses at once would be given flight after flight.

        Args:
            items: what to fly.
            on_done: told the item's index and its result, in the order of completion.

        Raises:
            ClusterLostError: the scheduler is gone.
            OSError: a flight's file can't be written.
        """
        client, members = self._client, self._members
        assert client is not None
        assert members is not None
        ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        running: dict[str, _Sent] = {}
        waiting = deque(range(len(items)))
        strange = Counter[int]()
        look_s = time.monotonic() + _LOOK_EVERY_S
        try:
            while waiting or running:
                while waiting and len(running) < min(_AT_ONCE, _AHEAD * members.threads):
                    index = waiting.popleft()
                    sent = self._send(client, items[index], index, members.fit)
                    running[sent.future.key] = sent
                    sent.future.add_done_callback(ended.put)
                future = _next(ended, look_s - time.monotonic())
                ready = None if future is None else running.pop(future.key, None)
                if future is None or time.monotonic() >= look_s:
                    waiting.extendleft(self._look(client, members, running))
                    look_s = time.monotonic() + _LOOK_EVERY_S
                if ready is None:
                    continue
                index = ready.index
                result = self._result(ready.future, items[index])
                if result is None:
                    strange[index] += 1
                    members.forget()
                    look_s = time.monotonic()
                    if strange[index] < _ATTEMPTS:
                        waiting.appendleft(index)
                        waiting.extendleft(self._look(client, members, running))
                        continue
                    result = Failure(f"{_ATTEMPTS} times its worker had another program")
                on_done(index, result)
        finally:
            if running and client.status == "running":
                client.cancel([sent.future for sent in running.values()], force=True)

    def _send(self, client: Client, job: Job, index: int, fit: tuple[str, ...]) -> "_Sent":
        future = client.submit(self._fly, pack(job), pure=False, priority=-index, workers=list(fit))
        return _Sent(future, index, fit)

    def _look(self, client: Client, members: Members, running: dict[str, "_Sent"]) -> list[int]:
        """See who is there.

        Returns:
            Flights that are taken back, since all those whom they were given to are gone.

        Raises:
            ClusterLostError: the scheduler is gone.
        """
        lost = any(sent.future.status in _LOST for sent in running.values())
        if lost or client.status not in ("running", "connecting"):
            raise self._lost()
        if client.status != "running":
            return []
        try:
            members.look_again()
        except OSError:
            return []  # the connection breaks: the next look tells
        if not members.fit and not self._alone:
            self._say(
                f"the cluster at {self._address} has no worker any more; waiting for one "
                f"(dask worker {self._address} --nthreads 1)"
            )
        self._alone = not members.fit
        there = set(members.fit)
        orphans = [key for key, sent in running.items() if there.isdisjoint(sent.fit)]
        taken = [running.pop(key) for key in orphans]
        if taken:
            client.cancel([sent.future for sent in taken], force=True)
        return sorted((sent.index for sent in taken), reverse=True)

    def _result(self, future: Future, job: Job) -> Summary | Failure | None:
        """What became of a flight; None: nothing, the worker's program was another one."""
        if future.status in _LOST:
            raise self._lost()
        error = future.exception()
        if isinstance(error, StrangerError):
            return None
        if error is not None:
            return _failure(error)
        flown: Flown = future.result()
        summary, content = flown
        if content is not None:
            write_flight_bytes(flight_path(job.folder, job.key), content)
        return summary

    def _lost(self) -> ClusterLostError:
        return ClusterLostError(f"the scheduler at {self._address} is gone")

    def _leave(self) -> None:
        client, self._client = self._client, None
        if client is not None:
            client.close(timeout=2)


def _connected(address: str) -> Client:
    try:
        import distributed
    except ImportError as error:
        raise MissingExtraError(
            "--scheduler flies on a Dask cluster, for which dask.distributed is missing: "
            f"{install_extra('cluster')}"
        ) from error
    # What happens to the connection is told here, in one sentence, and not with Dask's tracebacks.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    try:
        connect: Callable[..., Client] = distributed.Client
        return connect(
            address, timeout=_CONNECTS_WITHIN_S, set_as_default=False, direct_to_workers=False
        )
    except (OSError, TimeoutError, ValueError) as error:
        raise ConfigError(
            f"--scheduler {address}: no Dask scheduler answers there ({_said(error)}). Start one "
            "with `dask scheduler`, and give the address that it says, tcp://HOST:PORT."
        ) from error


def _next(ended: "queue.SimpleQueue[Future]", within_s: float) -> Future | None:
    """The next flight that ended; None: none did."""
    try:
        return ended.get(timeout=max(0.0, within_s))
    except queue.Empty:
        return None


def _failure(error: BaseException) -> Failure:
    from distributed.scheduler import KilledWorker

    if isinstance(error, KilledWorker):
        return Failure("each worker that flew it died (killed, or out of memory?)")
    return Failure.of(error)


def _said(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
