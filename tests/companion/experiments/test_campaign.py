import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from companion.config.resolve import controller_path
from companion.experiments import flight_store
from companion.experiments.campaign import run_campaign
from companion.experiments.flight_store import MissingExtraError, flight_path, read_flight_table
from companion.experiments.flight_task import FlightTask
from tests.companion.experiments import stand_ins
from tests.companion.experiments.stand_ins import attempts

TASKS = [FlightTask("mpc-l1", 4, seed=seed) for seed in (1, 2, 3, 4)]


def test_results_are_in_the_order_of_the_tasks_whatever_ends_first(tmp_path):
    told = []

    results = run_campaign(
        TASKS, tmp_path, 2, lambda *what: told.append(what), stand_ins.keep_slowest_first
    )

    assert [summary.task.seed for summary in results.values()] == [1, 2, 3, 4]
    assert list(results) == [task.key for task in TASKS]
    assert [done for done, _, _ in told] == [0, 1, 2, 3, 4]
    assert told[0][2] is None
    assert told[-1] == (4, 4, 0.0)
    assert all(flight_path(tmp_path, key).is_file() for key in results)


def test_what_was_flown_before_is_not_flown_again(tmp_path):
    first = run_campaign(TASKS[:2], tmp_path, 1, fly=stand_ins.keep)

    again = run_campaign([*TASKS, TASKS[0]], tmp_path, 1, fly=stand_ins.keep)

    assert [attempts(tmp_path, seed) for seed in (1, 2, 3, 4)] == [1, 1, 1, 1]
    assert repr({key: again[key] for key in first}) == repr(first)  # NaN is not equal to itself
    assert len(again) == 4


def test_a_flight_is_known_again_when_its_files_have_moved(tmp_path):
    shipped = controller_path("mpc-l1", "bebop2")
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        task = FlightTask(str(shutil.copy(shipped, tmp_path / folder / "mine.yaml")), 4)
        (summary,) = run_campaign([task], tmp_path, 1, fly=stand_ins.keep).values()
        assert summary.task == task

    assert attempts(tmp_path, 1) == 1


@pytest.mark.parametrize("damage", ["truncated", "empty", "text", "foreign"])
def test_a_file_that_can_not_be_read_is_flown_again(tmp_path, damage):
    (key,) = run_campaign(TASKS[:1], tmp_path, 1, fly=stand_ins.keep)
    path = flight_path(tmp_path, key)
    if damage == "truncated":
        os.truncate(path, path.stat().st_size // 2)
    elif damage == "foreign":
        import pyarrow
        import pyarrow.parquet

        pyarrow.parquet.write_table(pyarrow.table({"a": [1]}), path)
    else:
        path.write_bytes(b"" if damage == "empty" else b"not a table at all\n" * 40)

    run_campaign(TASKS[:1], tmp_path, 1, fly=stand_ins.keep)

    assert attempts(tmp_path, 1) == 2
    assert read_flight_table(path).task == TASKS[0]


def test_the_flight_of_a_worker_that_was_killed_is_flown_once_more_and_no_other(tmp_path):
    results = run_campaign(TASKS, tmp_path, 2, fly=stand_ins.die_once)

    assert [summary.outcome for summary in results.values()] == ["tracked"] * 4
    assert [attempts(tmp_path, seed) for seed in (1, 2, 3, 4)] == [1, 2, 1, 1]


def test_a_flight_that_kills_its_worker_each_time_failed_and_the_others_did_not(tmp_path):
    results = list(run_campaign(TASKS, tmp_path, 2, fly=stand_ins.die_always).values())

    assert [summary.outcome for summary in results] == ["tracked", "failed", "tracked", "tracked"]
    assert "died 3 times" in results[1].note
    assert results[1].mean_error_m == float("inf")
    assert [attempts(tmp_path, seed) for seed in (1, 2, 3, 4)] == [1, 3, 1, 1]
    assert not flight_path(tmp_path, results[1].key).exists()


def test_an_exception_in_a_flight_is_a_failed_result_that_says_why_and_is_flown_again(tmp_path):
    results = list(run_campaign(TASKS[:3], tmp_path, 1, fly=stand_ins.raise_at_two).values())
    assert [summary.outcome for summary in results] == ["tracked", "failed", "tracked"]
    assert results[1].note == "ValueError: no such"

    results = list(run_campaign(TASKS[:3], tmp_path, 1, fly=stand_ins.keep).values())
    assert [summary.outcome for summary in results] == ["tracked"] * 3
    assert [attempts(tmp_path, seed) for seed in (1, 2, 3)] == [1, 2, 1]


INTERRUPTED = """
import sys
from pathlib import Path
from companion.experiments.campaign import CampaignInterruptedError, run_campaign
from tests.companion.experiments import stand_ins
from tests.companion.experiments.test_campaign import TASKS

if __name__ == "__main__":
    try:
        run_campaign(TASKS, Path(sys.argv[1]), 2, fly=stand_ins.sleep_from_three_on)
    except CampaignInterruptedError as error:
        print(error)
"""


def test_an_interrupt_stops_the_workers_keeps_what_is_done_and_says_how_to_go_on(tmp_path):
    script = tmp_path / "campaign.py"
    script.write_text(INTERRUPTED)
    running = subprocess.Popen(
        [sys.executable, script, tmp_path],
        env=os.environ | {"PYTHONPATH": os.getcwd()},
        stdout=subprocess.PIPE,
        text=True,
    )
    workers = _workers_of(tmp_path, 2)
    running.send_signal(signal.SIGINT)
    said, _ = running.communicate(timeout=60)

    assert said.startswith("interrupted: 2 of 4 flights are kept")
    assert all(_gone(pid) for pid in workers)
    results = run_campaign(TASKS, tmp_path, 1, fly=stand_ins.keep)
    assert len(results) == 4
    assert [attempts(tmp_path, seed) for seed in (1, 2, 3, 4)] == [1, 1, 2, 2]
    assert list((tmp_path / "flights").glob(".*")) == []


def _workers_of(folder: Path, count: int) -> list[int]:
    """Process ids that the workers left as marks, once there are so many."""
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        marks = list(folder.glob("pid-*"))
        if len(marks) == count:
            return [int(mark.name.removeprefix("pid-")) for mark in marks]
        time.sleep(0.02)
    pytest.fail("the workers did not begin")


def _gone(pid: int) -> bool:
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.02)
    return False


ORPHANED = """
import sys
from pathlib import Path
from companion.experiments.workers import Workers
from tests.companion.experiments import stand_ins

if __name__ == "__main__":
    with Workers(stand_ins.hang, 2) as workers:
        workers.run([Path(sys.argv[1])] * 2, lambda *_: None)
"""


def test_workers_end_with_a_parent_that_is_killed(tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(ORPHANED)
    parent = subprocess.Popen(
        [sys.executable, script, tmp_path], env=os.environ | {"PYTHONPATH": os.getcwd()}
    )
    workers = _workers_of(tmp_path, 2)
    parent.kill()
    parent.wait()

    assert all(_gone(pid) for pid in workers)


def test_without_pyarrow_nothing_is_flown_and_the_remedy_is_told(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)

    with pytest.raises(MissingExtraError, match=r"pip install 'companion\[study\]'"):
        run_campaign(TASKS, tmp_path, 1, fly=stand_ins.keep)

    assert list(tmp_path.iterdir()) == []


def test_a_flight_that_can_not_be_written_leaves_nothing_behind(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    path = flight_path(tmp_path, "a")
    with pytest.raises(OSError, match="No space"):
        flight_store.write_flight(path, "a", stand_ins.table_of(TASKS[0]))

    assert list(path.parent.iterdir()) == []
