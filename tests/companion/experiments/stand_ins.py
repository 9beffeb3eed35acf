"""What workers do in tests in place of flying: cheap, and dying where it is asked of them."""

import math
import os
import signal
import time

import numpy as np

from companion.experiments.campaign import Job
from companion.experiments.flight_store import flight_path, summarise, write_flight
from companion.experiments.flight_table import FlightTable

THREADS = "OPENBLAS_NUM_THREADS"


def table_of(task, **changes):
    rows = 5
    columns = {
        "time_s": np.arange(rows) * 0.01 + 1000.0,
        "phase": np.array(["hover", "hover", "track", "track", "settle"]),
        "position_x_m": np.linspace(0.0, 1.0, rows),
        "projecting": np.array([False, True, False, False, True]),
        "plan_status": np.array(["closed_form", "", "", "solved", ""]),
    }
    fields = {"outcome": "tracked", "note": "", "mean_error_m": 0.001 * task.seed}
    fields |= {"rms_error_m": 0.002, "max_error_m": 0.003}
    return FlightTable(task=task, columns=columns, **(fields | changes))


def _begin(job):
    """Leave a mark for each attempt; give its number."""
    attempt = 1
    while True:
        try:
            (job.folder / f"attempt-{job.task.seed}-{attempt}").touch(exist_ok=False)
        except FileExistsError:
            attempt += 1
        else:
            return attempt


def attempts(folder, seed):
    return len(list(folder.glob(f"attempt-{seed}-*")))


def _keep(job):
    table = table_of(job.task)
    write_flight(flight_path(job.folder, job.key), job.key, table)
    return summarise(job.key, table)


def keep(job: Job):
    _begin(job)
    return _keep(job)


def keep_made_up(job: Job):
    """An error of 10 mm times the seed, thrice of any perturbed one; the fan loses pid-l1."""
    attempt = job.folder / "flown"
    attempt.mkdir(exist_ok=True)
    (attempt / job.key).touch(exist_ok=False)
    task = job.task
    lost = task.wind == "fan" and task.controller == "pid-l1"
    perturbed = task.shim_vehicle is not None or task.faults is not None
    error = math.inf if lost else 0.01 * task.seed * (3.0 if perturbed else 1.0)
    table = table_of(
        task,
        outcome="aborted" if lost else "tracked",
        note="It flew away." if lost else "",
        mean_error_m=error,
        reported_mean_error_m=2.0 * error,
        peak_height_error_m=0.004,
        reported_peak_height_error_m=0.007,
        tilt_slew_rms_g_s=0.5 if task.controller == "pid-l1" else 0.25,
    )
    write_flight(flight_path(job.folder, job.key), job.key, table)
    return summarise(job.key, table)


def refuse(job: Job):
    """What becomes of a flight that the simulator, or the flight itself, refuses."""
    if job.task.seed == 2:
        raise ValueError("the shim can't simulate it")
    return summarise(job.key, table_of(job.task, outcome="refused", note="It is too fast."))


def keep_slowest_first(job: Job):
    """The first seeds take longest, so that the order of completion is not the order of tasks."""
    _begin(job)
    time.sleep(0.3 if job.task.seed == 1 else 0.0)
    return _keep(job)


def die_once(job: Job):
    if _begin(job) == 1 and job.task.seed == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return _keep(job)


def die_always(job: Job):
    _begin(job)
    if job.task.seed == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return _keep(job)


def raise_at_two(job: Job):
    _begin(job)
    if job.task.seed == 2:
        raise ValueError("no such\nthing")
    return _keep(job)


def sleep_from_three_on(job: Job):
    _begin(job)
    if job.task.seed >= 3:
        (job.folder / f"pid-{os.getpid()}").touch()
        time.sleep(600.0)
    return _keep(job)


def describe_process(_: int):
    return os.getpid(), os.getpgid(0), os.environ.get(THREADS)


def give_none(_: int):
    return None


def hang(folder):
    (folder / f"pid-{os.getpid()}").touch()
    time.sleep(600.0)
