import os

from companion.experiments.workers import Workers, default_jobs
from tests.companion.experiments import stand_ins


def test_there_is_a_job_for_each_processor_that_this_process_may_use(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3, 5, 7}, raising=False)
    assert default_jobs() == 3
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set())
    assert default_jobs() == 1


def test_workers_have_one_thread_for_numbers_and_do_not_hear_the_terminals_interrupt():
    before = dict(os.environ)
    with Workers(stand_ins.describe_process, 1) as workers:
        ((pid, group, threads),) = workers.run([1], lambda *_: None)

    assert pid not in (os.getpid(), 0)
    assert group == pid
    assert threads == "1"
    assert dict(os.environ) == before


def test_workers_live_on_from_one_run_to_the_next():
    with Workers(stand_ins.describe_process, 1) as workers:
        first = workers.run([1, 2], lambda *_: None)
        second = workers.run([3], lambda *_: None)

    assert {process[0] for process in (*first, *second)} == {first[0][0]}


def test_no_work_is_no_trouble():
    with Workers(stand_ins.describe_process, 2) as workers:
        assert workers.run([], lambda *_: None) == []


def test_a_result_of_none_is_a_result():
    with Workers(stand_ins.give_none, 1) as workers:
        assert workers.run([1, 2], lambda *_: None) == [None, None]
