import errno
import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet as parquet
import pytest

from companion.commands.campaign import CampaignRequest, run_campaign_file
from companion.config.yaml_source import ConfigError
from companion.experiments import campaign
from companion.experiments.campaign import CampaignInterruptedError
from companion.experiments.campaigns import batches, cluster, flying
from companion.experiments.campaigns.folder import owned
from companion.experiments.campaigns.manifest import MANIFEST
from companion.experiments.campaigns.results import JOURNAL, RESULTS, Journal, read_journal
from tests.companion.experiments.campaigns import stand_ins
from tests.companion.experiments.campaigns.stand_ins import attempts

SEEDS = """\
name: seeds
keep: figures
sample: {method: grid}
parameters:
  seed: [1, 2, 3, 4, 5, 6]
  wind: [calm]
"""
COLUMNS = [
    *("point", "key", "engine", "param.seed", "param.wind", "outcome", "note"),
    *("mean_error_m", "rms_error_m", "max_error_m", "reported_mean_error_m", "flown_s"),
    *("scored_s", "fallbacks", "r_max_share", "wind_peak_m_s2", "tilt_slew_rms_g_s", "wall_s"),
]


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "seeds.yaml"
    path.write_text(SEEDS)
    return str(path)


@pytest.fixture
def request_of(file, tmp_path):
    def request(**options):
        return CampaignRequest(**{"file": file, "jobs": 1, "out": tmp_path / "out"} | options)

    return request


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def rows_of(folder):
    return parquet.read_table(folder / RESULTS).to_pylist()


def test_a_row_for_each_flight_in_the_order_of_the_plan(request_of, out, capsys):
    assert run_campaign_file(request_of(json_output=True), stand_ins.figures)

    rows = rows_of(out)
    assert list(rows[0]) == COLUMNS
    assert [(row["point"], row["param.seed"]) for row in rows] == [(k, k + 1.0) for k in range(6)]
    assert rows[2]["mean_error_m"] == 0.003
    assert math.isnan(rows[2]["reported_mean_error_m"])
    said = json.loads(capsys.readouterr().out)
    assert said["outcomes"] == {"tracked": 6}
    manifest = json.loads((out / "campaign.json").read_text())
    assert manifest["yaml"] == SEEDS
    assert manifest["flights"] == 6
    assert manifest["parameters"][1] == {
        "name": "wind",
        "kind": "choice",
        "values": ["calm"],
        "nominal": "calm",
    }
    assert not list(out.glob("flights/*"))


def test_a_folder_with_results_is_left_alone_unless_it_is_to_be_gone_on_with(
    request_of, out, file, capsys
):
    run_campaign_file(request_of(), stand_ins.figures)
    before = (out / RESULTS).read_bytes()

    with pytest.raises(ConfigError, match=r"holds 6 of 6 flights .* Go on with --resume"):
        run_campaign_file(request_of(), stand_ins.figures)
    run_campaign_file(request_of(resume=True), stand_ins.figures)
    assert (out / RESULTS).read_bytes() == before

    Path(file).write_text(SEEDS.replace("5, 6]", "5]"))
    with pytest.raises(ConfigError, match="holds the flights of another plan"):
        run_campaign_file(request_of(resume=True), stand_ins.figures)
    assert [attempts(out, seed) for seed in range(1, 7)] == [1] * 6


def test_a_crash_is_a_result_and_a_failure_is_flown_again(request_of, out, capsys):
    assert not run_campaign_file(request_of(), stand_ins.fail_at_two)

    rows = rows_of(out)
    assert [row["outcome"] for row in rows[:4]] == ["tracked", "failed", "aborted", "tracked"]
    assert rows[1]["note"] == "ValueError: out of luck"
    assert math.isnan(rows[2]["mean_error_m"])
    assert "--resume flies them again" in capsys.readouterr().out
    assert run_campaign_file(request_of(resume=True), stand_ins.figures)
    assert [attempts(out, seed) for seed in range(1, 7)] == [1, 2, 1, 1, 1, 1]
    assert [row["outcome"] for row in rows_of(out)[:3]] == ["tracked", "tracked", "aborted"]


@pytest.mark.parametrize("torn", ["", '{"point": 5, "key": "mpc-', "\x00\x00\x00", "[]\n"])
def test_what_the_journal_has_whole_is_kept_and_what_is_torn_is_flown(request_of, out, torn):
    run_campaign_file(request_of(), stand_ins.figures)
    lines = (out / JOURNAL).read_text().splitlines(keepends=True)
    (out / JOURNAL).write_text("".join(lines[:4]) + torn)
    (out / RESULTS).unlink()
    assert len(read_journal(out)) == 4

    run_campaign_file(request_of(resume=True), stand_ins.figures)

    assert sorted(attempts(out, seed) for seed in range(1, 7)) == [1, 1, 1, 1, 2, 2]
    assert len(rows_of(out)) == len(read_journal(out)) == 6


def test_a_flights_file_is_enough_to_know_it_again(request_of, out, file):
    Path(file).write_text(SEEDS.replace("keep: figures", "keep: flights"))
    run_campaign_file(request_of(), stand_ins.keep)
    before = rows_of(out)
    (out / JOURNAL).unlink()

    run_campaign_file(request_of(resume=True), stand_ins.keep)

    assert len(list((out / "flights").glob("*.parquet"))) == 6
    assert [attempts(out, seed) for seed in range(1, 7)] == [1] * 6
    assert str(rows_of(out)) == str(before)  # NaN is not equal to itself


def test_flights_of_other_code_stay_until_they_are_to_be_flown_anew(request_of, out, capsys):
    run_campaign_file(request_of(), stand_ins.figures)
    journal = (out / JOURNAL).read_text().replace("-s3-", "-s3-other")
    (out / JOURNAL).write_text(journal)

    with pytest.raises(ConfigError, match=r"1 flights were flown by other code .*--resume --anew"):
        run_campaign_file(request_of(resume=True), stand_ins.figures)
    assert (out / JOURNAL).read_text() == journal
    with pytest.raises(ConfigError, match="--anew goes with --resume"):
        run_campaign_file(request_of(anew=True), stand_ins.figures)

    run_campaign_file(request_of(resume=True, anew=True), stand_ins.figures)

    assert "1 flights in" in capsys.readouterr().err
    assert [attempts(out, seed) for seed in range(1, 7)] == [1, 1, 2, 1, 1, 1]
    assert "other" not in (out / JOURNAL).read_text()
    assert (out / "before-1" / JOURNAL).read_text() == journal
    assert len(rows_of(out / "before-1")) == 6
    assert (out / "before-1" / MANIFEST).is_file()


def test_a_scheduler_that_is_not_there_costs_no_row(request_of, out, monkeypatch):
    monkeypatch.setattr(cluster, "_CONNECTS_WITHIN_S", 0.2)
    run_campaign_file(request_of(), stand_ins.figures)
    lines = (out / JOURNAL).read_text().splitlines(keepends=True)
    journal = "".join(lines[:5]).replace("-s3-", "-s3-other")
    (out / JOURNAL).write_text(journal)
    before = {path.name: path.read_bytes() for path in out.iterdir() if path.is_file()}
    nobody = {"scheduler": "tcp://127.0.0.1:1", "jobs": None}

    with pytest.raises(ConfigError, match="no Dask scheduler answers there"):
        run_campaign_file(request_of(resume=True, anew=True, **nobody))

    assert {path.name: path.read_bytes() for path in out.iterdir() if path.is_file()} == before


def test_a_first_attempt_that_flew_nothing_leaves_nothing_and_is_no_obstacle(
    request_of, out, monkeypatch
):
    monkeypatch.setattr(cluster, "_CONNECTS_WITHIN_S", 0.2)
    nobody = {"scheduler": "tcp://127.0.0.1:1", "jobs": None, "out": out / "deep"}
    with pytest.raises(ConfigError, match="no Dask scheduler answers there"):
        run_campaign_file(request_of(**nobody))
    assert not out.exists()

    run_campaign_file(request_of(), stand_ins.figures)
    (out / RESULTS).unlink()
    (out / JOURNAL).write_text("")
    assert run_campaign_file(request_of(), stand_ins.figures)
    assert len(rows_of(out)) == 6


def test_a_folder_that_is_not_there_or_says_nothing_is_not_gone_on_with(request_of, out):
    with pytest.raises(ConfigError, match="holds no campaign that --resume could go on with"):
        run_campaign_file(request_of(resume=True), stand_ins.figures)
    assert not out.exists()


@pytest.mark.parametrize("left", [JOURNAL, RESULTS])
@pytest.mark.parametrize("resume", [False, True])
def test_results_without_the_manifest_are_left_alone(request_of, out, left, resume):
    run_campaign_file(request_of(), stand_ins.figures)
    for name in {MANIFEST, JOURNAL, RESULTS} - {left}:
        (out / name).unlink()
    before = (out / left).read_bytes()

    with pytest.raises(ConfigError, match=f"holds {left} and no campaign.json"):
        run_campaign_file(request_of(resume=resume), stand_ins.figures)

    assert (out / left).read_bytes() == before


def test_flights_without_data_are_not_gone_on_with_where_data_are_wanted(request_of, out, file):
    run_campaign_file(request_of(), stand_ins.figures)
    Path(file).write_text(SEEDS.replace("keep: figures", "keep: flights"))

    with pytest.raises(
        ConfigError, match=r"says keep: flights, and the 6 flights .* keep: figures"
    ):
        run_campaign_file(request_of(resume=True), stand_ins.keep)

    assert json.loads((out / MANIFEST).read_text())["keep"] == "figures"


def test_a_full_disk_is_told_with_what_is_kept_and_how_to_go_on(request_of, out, file, monkeypatch):
    add = Journal.add

    def full(self, row):
        if row["point"] == 3:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        add(self, row)

    monkeypatch.setattr(Journal, "add", full)
    with pytest.raises(CampaignInterruptedError) as said:
        run_campaign_file(request_of(), stand_ins.figures)

    assert str(said.value) == (
        f"{out} can't be written (No space left on device): 3 of 6 flights are kept in {out}. "
        f"Make room, and go on with: companion campaign {file} --jobs 1 --out {out} --resume"
    )


def test_a_table_that_can_not_be_written_now_stops_no_campaign(
    request_of, out, monkeypatch, capsys
):
    tries = []
    write = flying.write_results

    def late(folder, rows, parameters):
        tries.append(folder)
        if len(tries) < 3:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(folder, rows, parameters)

    monkeypatch.setattr(flying, "_WRITE_EVERY_S", 0.0)
    monkeypatch.setattr(flying, "_WRITING_SHARE", 1e9)
    monkeypatch.setattr(flying, "write_results", late)

    assert run_campaign_file(request_of(), stand_ins.figures)

    assert len(rows_of(out)) == 6
    assert capsys.readouterr().err.count("can't be written (No space left on device)") == 1


def test_a_disk_that_is_full_from_the_start_is_told_with_the_folder(request_of, out, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(flying, "write_manifest", full)
    with pytest.raises(OSError, match=f"No space left on device: '{out}'"):
        run_campaign_file(request_of(), stand_ins.figures)


def test_a_flight_of_two_points_has_two_rows_in_the_journal_though_one_was_torn(
    request_of, out, file
):
    Path(file).write_text(SEEDS.replace("[1, 2, 3, 4, 5, 6]", "[1, 1]"))
    run_campaign_file(request_of(), stand_ins.figures)
    (out / JOURNAL).write_text((out / JOURNAL).read_text().splitlines(keepends=True)[0])

    run_campaign_file(request_of(resume=True), stand_ins.figures)

    assert [row["point"] for row in read_journal(out)] == [0, 1]
    assert attempts(out, 1) == 1


@pytest.mark.parametrize("is_file", [False, True])
def test_a_refusal_leaves_no_folder_behind(request_of, out, file, is_file):
    if is_file:
        out.write_text("mine")
        with pytest.raises(ConfigError, match=r"not a folder\. Give another one with --out"):
            run_campaign_file(request_of(), stand_ins.figures)
        assert out.read_text() == "mine"
        return
    Path(file).write_text(
        SEEDS.replace("wind: [calm]", "plant.mass: [1.1]\n  controller.mpc.horizon: [30, 1]")
    )
    with pytest.raises(ConfigError, match="can't be flown"):
        run_campaign_file(request_of(), stand_ins.figures)
    assert not out.exists()


def test_two_campaigns_do_not_write_to_one_folder(request_of, out):
    with owned(out), pytest.raises(ConfigError, match="another campaign is writing to it"):
        run_campaign_file(request_of(), stand_ins.figures)


@pytest.mark.parametrize("signal_of", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupt_says_what_is_done_and_how_to_go_on(
    request_of, out, file, monkeypatch, signal_of
):
    class Interrupted(campaign.Workers):
        def run(self, items, on_done):
            super().run(items[:2], on_done)
            assert signal.getsignal(signal_of) is not signal.SIG_DFL  # or it would end the tests
            signal.raise_signal(signal_of)

    before = signal.getsignal(signal_of)
    monkeypatch.setattr(campaign, "Workers", Interrupted)

    with pytest.raises(CampaignInterruptedError) as said:
        run_campaign_file(request_of(), stand_ins.figures)

    assert str(said.value) == (
        f"interrupted: 2 of 6 flights are kept in {out}. "
        f"Go on with: companion campaign {file} --jobs 1 --out {out} --resume"
    )
    assert len(rows_of(out)) == 2
    assert signal.getsignal(signal_of) is before


def test_an_interrupt_before_the_first_flight_leaves_nothing(request_of, out, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(flying, "checked_tasks", interrupted)
    with pytest.raises(CampaignInterruptedError, match="interrupted before anything was flown"):
        run_campaign_file(request_of(), stand_ins.figures)
    assert not out.exists()


KILLED = """
import sys
from pathlib import Path
from companion.commands.campaign import CampaignRequest, run_campaign_file
from tests.companion.experiments.campaigns import stand_ins

if __name__ == "__main__":
    request = CampaignRequest(sys.argv[1], jobs=2, out=Path(sys.argv[2]))
    run_campaign_file(request, stand_ins.hang_from_four_on)
"""


def test_killed_in_the_middle_a_worker_first_and_then_all_nothing_is_lost_or_flown_twice(
    request_of, out, file, tmp_path
):
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    campaign = subprocess.Popen(
        [sys.executable, script, file, out],
        env=os.environ | {"PYTHONPATH": os.getcwd()},
        start_new_session=True,
    )
    os.kill(_process_at(out, 4), signal.SIGKILL)
    hanging = [_process_at(out, 5), _process_at(out, 6)]
    _until(lambda: [attempts(out, seed) for seed in (1, 2, 3, 4)] == [1, 1, 1, 1])
    os.killpg(campaign.pid, signal.SIGKILL)
    campaign.wait()
    _until(lambda: not any(map(_lives, hanging)))
    done = [row["param.seed"] for row in read_journal(out)]

    run_campaign_file(request_of(resume=True), stand_ins.figures)

    assert done == [1.0, 2.0, 3.0]
    assert [row["param.seed"] for row in rows_of(out)] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert [attempts(out, seed) for seed in range(1, 7)] == [1, 1, 1, 2, 2, 2]


def _process_at(folder: Path, seed: int) -> int:
    """The process that hangs at a seed."""
    _until(lambda: list(folder.glob(f"pid-{seed}-*")))
    (mark,) = folder.glob(f"pid-{seed}-*")
    return int(mark.name.rpartition("-")[2])


def _until(happened) -> None:
    deadline = time.monotonic() + 60.0
    while not happened():
        if time.monotonic() > deadline:
            pytest.fail("it did not happen")
        time.sleep(0.02)


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


BATCHED = """\
name: wide
engine: batched
base: {trajectory: way.yaml, settings: {hover_s: 0.2}}
sample: {method: latin-hypercube, points: 5}
parameters:
  plant.mass: {low: 0.9, high: 1.1}
  plant.delay_s: {low: 0.0, high: 0.01}
each:
  controller: [mpc-l1, lqr-l1]
"""


def test_a_batched_campaign_has_the_same_table_and_goes_on(request_of, out, file, tmp_path):
    (tmp_path / "way.yaml").write_text("points: [[0, 0, 0, 1], [0.5, 0.1, 0, 1], [1, 0, 0, 1]]\n")
    Path(file).write_text(BATCHED)
    run_campaign_file(request_of())
    before = rows_of(out)
    lines = (out / JOURNAL).read_text().splitlines(keepends=True)
    (out / JOURNAL).write_text("".join(lines[:4]))

    run_campaign_file(request_of(resume=True))

    rows = rows_of(out)
    assert {row["engine"] for row in rows} == {"batched"}
    assert [row["outcome"] for row in rows] == ["tracked"] * 10
    assert [row["key"] for row in rows] == [row["key"] for row in before]
    assert len({row["key"] for row in rows}) == 10
    assert [row["wall_s"] for row in rows[:4]] == [row["wall_s"] for row in before[:4]]


def test_a_batched_row_depends_on_neither_the_processes_nor_what_was_flown_before(
    request_of, out, file, tmp_path, monkeypatch
):
    monkeypatch.setattr(batches, "_AT_ONCE", 4)
    pieces = []

    class Told(batches.Workers):
        def run(self, items, on_done):
            pieces.append([[key for key, _ in piece] for piece in items])
            return super().run(items, on_done)

    monkeypatch.setattr(batches, "Workers", Told)
    (tmp_path / "way.yaml").write_text("points: [[0, 0, 0, 1], [0.5, 0.1, 0, 1], [1, 0, 0, 1]]\n")
    Path(file).write_text(BATCHED)
    run_campaign_file(request_of())
    before = rows_of(out)
    lines = (out / JOURNAL).read_text().splitlines(keepends=True)
    (out / JOURNAL).write_text("".join(lines[:6]))

    run_campaign_file(request_of(resume=True, jobs=2))

    assert [len(piece) for piece in pieces[0]] == [4, 4, 2]
    assert pieces[1] == pieces[0][1:]
    rows = rows_of(out)
    without = [{name: v for name, v in row.items() if name != "wall_s"} for row in rows]
    assert str(without) == str(
        [{name: v for name, v in row.items() if name != "wall_s"} for row in before]
    )
    assert len((out / JOURNAL).read_text().splitlines()) == 10


def test_what_batches_do_not_model_is_refused_before_anything_is_flown(request_of, out, file):
    Path(file).write_text(BATCHED.replace("way.yaml", "4").replace("lqr-l1", "mpc-l1-plus"))
    with pytest.raises(ConfigError, match="controller: mpc-l1-plus"):
        run_campaign_file(request_of())

    Path(file).write_text(BATCHED.replace("way.yaml", "4"))
    with pytest.raises(ConfigError, match="--scheduler is for engine: flights"):
        run_campaign_file(request_of(scheduler="tcp://127.0.0.1:1", jobs=None))
    assert not (out / RESULTS).exists()
