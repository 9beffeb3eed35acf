"""Who of a cluster flies: the workers that were met and have this very program."""

from collections.abc import Callable
from typing import Any

from companion.config.yaml_source import ConfigError
from companion.experiments.campaigns.parcel import differences
from companion.experiments.campaigns.parcel import program as our_program

Client = Any
"""Of dask.distributed, which has no types."""


class Members:
    """Workers by address, each asked once for its program."""

    def __init__(self, client: Client, address: str, say: Callable[[str], None]) -> None:
        """Prepare.

        Args:
            client: connected.
            address: of the scheduler, for messages.
            say: told once of each worker that is left out.
        """
        self._client = client
        self._address = address
        self._say = say
        self._threads: dict[str, int] = {}
        self._strangers: dict[str, str] = {}
        """What each differs in."""
        self._told: set[tuple[str, str]] = set()

    @property
    def fit(self) -> tuple[str, ...]:
        """Those that fly."""
        return tuple(sorted(self._threads))

    @property
    def threads(self) -> int:
        """Of those that fly, in all."""
        return sum(self._threads.values())

    def begin(self) -> None:
        """See who is there before anything is flown.

        Raises:
            ConfigError: nobody who could fly.
        """
        self.look()
        if not self._threads and not self._strangers:
            raise ConfigError(
                f"--scheduler {self._address}: the cluster has no workers. Start some: "
                f"dask worker {self._address} --nworkers auto --nthreads 1"
            )
        if not self._threads:
            worker, differing = min(self._strangers.items())
            raise ConfigError(
                f"--scheduler {self._address}: the worker {worker} has another program: "
                f"{differing}. The same flight must give the same figures everywhere: install "
                "this very version, with the same libraries, on all workers."
            )
        self._tell()
        crowded = sum(count > 1 for count in self._threads.values())
        if crowded:
            self._say(
                f"{crowded} of {len(self._threads)} workers have several threads, which take turns "
                "in Python: give each worker one (dask worker --nworkers auto --nthreads 1)"
            )

    def look_again(self) -> None:
        """See who has come and who has gone."""
        self.look()
        self._tell()

    def forget(self) -> None:
        """Ask all again at the next look: one of them is not what it was."""
        self._threads.clear()
        self._strangers.clear()

    def look(self) -> None:
        """Ask those that have not been asked yet, in silence."""
        there: dict[str, int] = self._client.nthreads()
        self._threads = {w: there[w] for w in self._threads if w in there}
        self._strangers = {w: why for w, why in self._strangers.items() if w in there}
        new = [w for w in there if w not in self._threads and w not in self._strangers]
        if not new:
            return
        found: dict[str, Any] = self._client.run(our_program, workers=new, on_error="return")
        for worker, theirs in sorted(found.items()):
            if isinstance(theirs, OSError):
                continue  # it went while it was asked
            differing = (
                [f"it has no companion ({theirs})"]
                if isinstance(theirs, BaseException)
                else differences(our_program(), theirs)
            )
            if differing:
                self._strangers[worker] = "; ".join(differing)
            else:
                self._threads[worker] = there[worker]

    def _tell(self) -> None:
        for stranger in sorted(self._strangers.items()):
            if stranger not in self._told:
                self._told.add(stranger)
                self._say(
                    f"the worker {stranger[0]} has another program and flies nothing: "
                    f"{stranger[1]}. Install this very version there, with the same libraries."
                )
