"""Which workers of a cluster fly, with a cluster that is made up: no process, no clock."""

from pathlib import Path

import pytest

from companion.config.yaml_source import ConfigError
from companion.experiments.campaign import Job
from companion.experiments.campaigns import cluster
from companion.experiments.campaigns.parcel import StrangerError, program
from companion.experiments.flight_store import summarise
from companion.experiments.flight_task import FlightTask
from tests.companion.experiments.stand_ins import table_of

OURS = program()
OTHER = (("companion", "0.0"), *OURS[1:])


class Future:
    def __init__(self, key, parcel, workers):
        self.key, self.parcel, self.workers = key, parcel, workers
        self.status, self.error = "pending", None
        self.callbacks = []

    def add_done_callback(self, call):
        self.callbacks.append(call)

    def end(self, status="finished", error=None):
        self.status, self.error = status, error
        for call in self.callbacks:
            call(self)

    def exception(self):
        return self.error

    def result(self):
        return summarise(self.parcel.key, table_of(self.parcel.task)), None


class MadeUp:
    """A cluster that ends a flight at each look; `script` changes it when that many were sent."""

    status = "running"

    def __init__(self, workers, script=None):
        self.workers = dict(workers)
        self.script = script or {}
        self.asked, self.sent, self.cancelled = [], [], []

    def nthreads(self):
        self._work()
        return dict.fromkeys(self.workers, 1)

    def run(self, function, *, workers, on_error):
        assert on_error == "return"
        self.asked += workers
        return {worker: self.workers[worker] for worker in workers}

    def submit(self, function, parcel, *, pure, priority, workers):
        future = Future(f"f{len(self.sent)}", parcel, workers)
        self.sent.append(future)
        return future

    def _work(self):
        """The first flight that somebody may fly."""
        change = self.script.pop(len(self.sent), None)
        if change is not None:
            change(self)
        for future in self.sent:
            if future.status != "pending" or not set(future.workers) & self.workers.keys():
                continue
            by = min(set(future.workers) & self.workers.keys())
            if self.workers[by] == OURS:
                future.end()
            else:
                future.end("error", StrangerError("another one"))
            return

    def cancel(self, futures, *, force):
        self.cancelled += futures
        for future in futures:
            future.end("cancelled")

    def close(self, **_):
        pass


@pytest.fixture
def flown(monkeypatch, tmp_path):
    """Flies ten flights on a made-up cluster; the indices done, and what was said."""
    monkeypatch.setattr(cluster, "_LOOK_EVERY_S", 0.0)

    def fly(made_up):
        monkeypatch.setattr(cluster, "_connected", lambda _: made_up)
        said, done = [], []
        tasks = [FlightTask("mpc-l1", 4, seed=seed) for seed in range(1, 11)]
        jobs = [Job(task, f"k{task.seed}", Path(tmp_path), keep=False) for task in tasks]
        with cluster.DaskCrew("tcp://made-up:1", said.append) as crew:
            crew.run(jobs, lambda index, result: done.append((index, result.outcome)))
        return sorted(done), said

    return fly


ALL = [(index, "tracked") for index in range(10)]


def test_a_stranger_that_joins_late_flies_nothing_and_is_told_once(flown):
    made_up = MadeUp({"a": OURS}, {5: lambda c: c.workers.update(b=OTHER)})

    done, said = flown(made_up)

    assert done == ALL
    assert all(future.workers == ["a"] for future in made_up.sent)
    assert len(said) == 1
    assert "worker b has another program and flies nothing: companion 0.0 there" in said[0]
    assert made_up.asked == ["a", "b"]


def test_a_stranger_that_is_there_from_the_start_is_left_out_unless_there_is_nobody_else(flown):
    done, said = flown(MadeUp({"a": OTHER, "b": OURS}))
    assert done == ALL
    assert len(said) == 1

    with pytest.raises(ConfigError, match="worker a has another program: companion"):
        flown(MadeUp({"a": OTHER}))
    with pytest.raises(ConfigError, match="the cluster has no workers"):
        flown(MadeUp({}))


def test_a_worker_that_joins_late_and_is_the_same_flies_too(flown):
    made_up = MadeUp({"a": OURS}, {5: lambda c: c.workers.update(b=OURS)})

    assert flown(made_up) == (ALL, [])
    assert made_up.sent[0].workers == ["a"]
    assert made_up.sent[-1].workers == ["a", "b"]


def test_a_worker_that_comes_back_as_another_program_has_no_result(flown):
    def exchange(made_up):
        made_up.workers.update(a=OTHER, b=OURS)

    done, said = flown(MadeUp({"a": OURS}, {5: exchange}))

    assert done == ALL
    assert len(said) == 1


def test_flights_of_workers_that_are_all_gone_wait_for_others(flown):
    def go(made_up):
        made_up.workers.clear()
        made_up.script[6] = made_up.script[5] = lambda c: c.workers.update(b=OURS)

    made_up = MadeUp({"a": OURS}, {5: go})

    done, said = flown(made_up)

    assert done == ALL
    assert "has no worker any more; waiting for one" in said[0]
    assert made_up.cancelled
