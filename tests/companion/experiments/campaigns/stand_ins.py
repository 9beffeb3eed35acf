"""What workers do in tests in place of flying a campaign: cheap, and dying where it is asked."""

import os
import signal
import time
from pathlib import Path

from companion.experiments.campaigns.parcel import Parcel
from companion.experiments.flight_store import summarise
from tests.companion.experiments.stand_ins import _begin, _keep, attempts, table_of

__all__ = ["attempts"]
MARKS = "CAMPAIGN_TEST_MARKS"


def keep(job):
    _begin(job)
    return _keep(job)


def figures(job):
    """Keeps no file."""
    _begin(job)
    return summarise(job.key, table_of(job.task))


def hang_from_four_on(job):
    """Seed 4 once, the later ones for ever; who hangs says which process it is."""
    attempt = _begin(job)
    if job.task.seed > 4 or (job.task.seed == 4 and attempt == 1):
        (job.folder / f"pid-{job.task.seed}-{os.getpid()}").touch()
        time.sleep(600.0)
    return summarise(job.key, table_of(job.task))


def fail_at_two(job):
    _begin(job)
    if job.task.seed == 2:
        raise ValueError("out of luck")
    lost = {"outcome": "aborted", "note": "It flew away.", "mean_error_m": float("inf")}
    return summarise(job.key, table_of(job.task, **(lost if job.task.seed == 3 else {})))


def die_once_there(parcel: Parcel):
    """On a cluster: the flight of seed 2 kills its first worker."""
    mark = Path(os.environ[MARKS]) / f"seed-{parcel.task.seed}"
    first = not mark.exists()
    mark.touch()
    if parcel.task.seed == 2 and first:
        os.kill(os.getpid(), signal.SIGKILL)
    return summarise(parcel.key, table_of(parcel.task)), None
