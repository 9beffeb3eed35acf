"""Flights over a cluster of dask.distributed that runs already.

Only what `Parcel` names goes there, and only figures and flights' files come back: the client alone
writes.  A worker that dies is Dask's to notice, and its flights go to another.
"""

import logging
import queue
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from companion.config.yaml_source import ConfigError
from companion.experiments.campaign import Job
from companion.experiments.campaigns.parcel import Flown, Parcel, differences, fly_parcel, pack
from companion.experiments.campaigns.parcel import program as our_program
from companion.experiments.flight_store import (
    MissingExtraError,
    Summary,
    flight_path,
    write_flight_bytes,
)
from companion.experiments.workers import Failure

Client = Any
Future = Any
"""Of dask.distributed, which has no types."""
_CONNECTS_WITHIN_S = 10.0
_AT_ONCE = 1000
"""Flights that the scheduler knows of: more would fill its memory, fewer might let workers wait."""
_LOOK_EVERY_S = 5.0
_LOST = ("lost", "cancelled")


class ClusterLostError(Exception):
    """The scheduler is gone; what is kept is kept."""


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

    def __enter__(self) -> "DaskCrew":
        """Connect, and see that the workers have the same program.

        Raises:
            MissingExtraError: dask.distributed is not installed.
            ConfigError: nobody answers, or a worker's program is another one.
        """
        self._client = _connected(self._address)
        try:
            self._meet(self._client)
        except BaseException:
            self._leave()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._leave()

    def run(self, items: Sequence[Job], on_done: Callable[[int, Summary | Failure], None]) -> None:
        """Fly all.

        Args:
            items: what to fly.
            on_done: told the item's index and its result, in the order of completion.

        Raises:
            ClusterLostError: the scheduler is gone.
            OSError: a flight's file can't be written.
        """
        client = self._client
        assert client is not None
        ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        running: dict[str, tuple[Future, int]] = {}
        waiting = iter(range(len(items)))
        try:
            while True:
                while len(running) < _AT_ONCE and (index := next(waiting, None)) is not None:
                    future = client.submit(
                        self._fly, pack(items[index]), pure=False, priority=-index
                    )
                    running[future.key] = future, index
                    future.add_done_callback(ended.put)
                if not running:
                    return
                future = self._next(client, ended, running)
                _, index = running.pop(future.key)
                on_done(index, self._result(future, items[index]))
        finally:
            if running and client.status == "running":
                client.cancel([future for future, _ in running.values()], force=True)

    def _next(
        self,
        client: Client,
        ended: queue.SimpleQueue[Future],
        running: Mapping[str, tuple[Future, int]],
    ) -> Future:
        """The next flight that ended; says so once while there is nobody to fly."""
        alone = False
        while True:
            try:
                return ended.get(timeout=_LOOK_EVERY_S)
            except queue.Empty:
                lost = any(future.status in _LOST for future, _ in running.values())
                if lost or client.status not in ("running", "connecting"):
                    raise self._lost() from None
                nobody = client.status == "running" and not client.nthreads()
                if nobody and not alone:
                    self._say(
                        f"the cluster at {self._address} has no worker any more; waiting for one "
                        f"(dask worker {self._address} --nthreads 1)"
                    )
                alone = nobody

    def _result(self, future: Future, job: Job) -> Summary | Failure:
        if future.status in _LOST:
            raise self._lost()
        error = future.exception()
        if error is not None:
            return _failure(error)
        flown: Flown = future.result()
        summary, content = flown
        if content is not None:
            write_flight_bytes(flight_path(job.folder, job.key), content)
        return summary

    def _lost(self) -> ClusterLostError:
        return ClusterLostError(f"the scheduler at {self._address} is gone")

    def _meet(self, client: Client) -> None:
        """See who is there.

        Raises:
            ConfigError: nobody, or a worker whose program is another one.
        """
        threads: dict[str, int] = client.nthreads()
        if not threads:
            raise ConfigError(
                f"--scheduler {self._address}: the cluster has no workers. Start some: "
                f"dask worker {self._address} --nworkers auto --nthreads 1"
            )
        found: dict[str, Any] = client.run(our_program, on_error="return")
        for worker, theirs in sorted(found.items()):
            differing = (
                [f"it has no companion ({theirs})"]
                if isinstance(theirs, BaseException)
                else differences(our_program(), theirs)
            )
            if differing:
                raise ConfigError(
                    f"--scheduler {self._address}: the worker {worker} has another program: "
                    f"{'; '.join(differing)}. The same flight must give the same figures "
                    "everywhere: install this very version, with the same libraries, on all "
                    "workers."
                )
        crowded = sum(count > 1 for count in threads.values())
        if crowded:
            self._say(
                f"{crowded} of {len(threads)} workers have several threads, which take turns in "
                "Python: give each worker one (dask worker --nworkers auto --nthreads 1)"
            )

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
            "pip install 'companion[cluster]'"
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


def _failure(error: BaseException) -> Failure:
    from distributed.scheduler import KilledWorker

    if isinstance(error, KilledWorker):
        return Failure("each worker that flew it died (killed, or out of memory?)")
    return Failure.of(error)


def _said(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
