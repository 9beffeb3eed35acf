"""Real flights, of a second and a half: here, on a cluster, and one of them by itself."""

import shutil
from pathlib import Path

import pyarrow.parquet as parquet
import pytest

from companion.commands.campaign import CampaignRequest, run_campaign_file
from companion.config.resolve import configs_folder
from companion.config.yaml_source import ConfigError
from companion.experiments.campaigns import cluster, parcel
from companion.experiments.campaigns.flown_before import check_point, plan_of_folder
from companion.experiments.campaigns.one_point import fly_point
from companion.experiments.campaigns.results import RESULTS
from companion.experiments.flight_store import MissingExtraError, read_flight_table
from companion.recording.flight_log import FlightLogError
from tests.companion.experiments.campaigns import stand_ins

FILE = """\
name: flown
base:
  trajectory: way.yaml
  wind: breeze.yaml
  controller: mine.yaml
  settings: {hover_s: 0.2}
sample: {method: latin-hypercube, points: 2}
parameters:
  plant.mass: {low: 0.9, high: 1.1}
  seed: {low: 1, high: 100, integer: true}
each:
  faults: [none, lossy.yaml]
"""
WAY = "points: [[0, 0, 0, 1], [0.5, 0.1, 0, 1], [1.0, 0, 0, 1]]\n"
BREEZE = "name: breeze\nwinds: [{kind: steady, velocity_enu_m_s: [1.0, 0.5, 0.0]}]\n"
LOSSY = "name: lossy\nlink: [{loss: 0.1}]\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A campaign with files of its own, flown here."""
    folder = tmp_path_factory.mktemp("flown")
    for name, text in (("flown", FILE), ("way", WAY), ("breeze", BREEZE), ("lossy", LOSSY)):
        (folder / f"{name}.yaml").write_text(text)
    shutil.copy(configs_folder() / "controllers" / "mpc-l1" / "bebop2.yaml", folder / "mine.yaml")
    run_campaign_file(CampaignRequest(str(folder / "flown.yaml"), jobs=1, out=folder / "here"))
    return folder


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """Address of a cluster of two workers."""
    import dask
    from distributed import LocalCluster

    marks = tmp_path_factory.mktemp("marks")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(stand_ins.MARKS, str(marks))
        quiet = {"logging.distributed": "critical", "distributed.worker.daemon": True}
        with (
            dask.config.set(quiet),
            LocalCluster(
                n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
            ) as cluster,
        ):
            yield cluster.scheduler_address


def table_of(folder):
    return parquet.read_table(folder / RESULTS).drop_columns("wall_s")


def test_a_cluster_gives_the_same_rows_and_flights_as_this_computer(folder, scheduler):
    run_campaign_file(
        CampaignRequest(str(folder / "flown.yaml"), scheduler=scheduler, out=folder / "there")
    )

    here, there = table_of(folder / "here"), table_of(folder / "there")
    assert here.num_rows == 4
    assert set(here.to_pydict()["outcome"]) == {"tracked"}
    assert here.equals(there)
    for key in here.to_pydict()["key"]:
        one, other = (
            read_flight_table(folder / place / "flights" / f"{key}.parquet")
            for place in ("here", "there")
        )
        assert one.columns["r2_x_m"].tobytes() == other.columns["r2_x_m"].tobytes()


def test_a_point_by_itself_gives_the_rows_figures_and_a_full_log(folder, tmp_path):
    plan = plan_of_folder(folder / "here")
    assert check_point(folder / "here", plan, 3) is None

    again = fly_point(plan, 3, tmp_path / "again")

    (row,) = table_of(folder / "here").slice(3).to_pylist()
    assert {name: again.row[name] for name in row} == row
    assert again.trouble is None
    assert {path.suffix for path in (tmp_path / "again").iterdir()} >= {".tlog", ".mcap", ".json"}
    with pytest.raises(FlightLogError, match="holds a flight's log already"):
        fly_point(plan, 3, tmp_path / "again")
    with pytest.raises(ConfigError, match=r"has the points 0 … 3"):
        fly_point(plan, 4, tmp_path / "other")


def test_the_flights_of_a_killed_worker_go_to_another(scheduler, tmp_path):
    path = tmp_path / "seeds.yaml"
    path.write_text(
        "name: seeds\nkeep: figures\nsample: {method: grid}\n"
        "parameters: {seed: [1, 2, 3, 4, 5, 6]}\n"
    )
    request = CampaignRequest(str(path), scheduler=scheduler, out=tmp_path / "out")

    assert run_campaign_file(request, fly_there=stand_ins.die_once_there)

    rows = table_of(tmp_path / "out").to_pydict()
    assert rows["param.seed"] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert rows["outcome"] == ["tracked"] * 6


def test_workers_with_another_program_are_refused_before_anything_is_flown(
    scheduler, folder, tmp_path, monkeypatch
):
    monkeypatch.setattr(parcel, "code_digest", lambda: "another")
    request = CampaignRequest(str(folder / "flown.yaml"), scheduler, out=tmp_path / "out")

    with pytest.raises(ConfigError, match=r"has another program: code \w+ there, another here"):
        run_campaign_file(request)

    assert not (tmp_path / "out").exists()


def test_a_worker_that_comes_later_with_another_program_flies_nothing():
    stranger = parcel.Parcel("k", None, None, None, (), False, (("companion", "0.0"),))

    with pytest.raises(parcel.StrangerError, match="companion"):
        parcel.fly_parcel(stranger)


def test_no_cluster_no_library_and_no_jobs_there_are_told_with_the_remedy(
    folder, tmp_path, monkeypatch
):
    import sys

    def refused(kind, says, **options):
        file = str(folder / "flown.yaml")
        with pytest.raises(kind, match=says):
            run_campaign_file(CampaignRequest(file, out=tmp_path / "out", **options))
        shutil.rmtree(tmp_path / "out", ignore_errors=True)

    monkeypatch.setattr(cluster, "_CONNECTS_WITHIN_S", 0.2)
    nobody = "tcp://127.0.0.1:1"
    refused(ConfigError, "no Dask scheduler answers there", scheduler=nobody)
    refused(ConfigError, "no Dask scheduler answers there", scheduler="not an address")
    refused(ConfigError, "leave --scheduler out", scheduler=nobody, point=1)
    refused(ConfigError, "Leave one of the two out", scheduler=nobody, jobs=2)
    monkeypatch.setitem(sys.modules, "distributed", None)
    refused(MissingExtraError, r"pip install 'companion\[cluster\]'", scheduler=nobody)
    assert not list(Path(tmp_path).glob("out/flights/*"))
