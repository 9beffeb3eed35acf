"""The shipped missions: each is valid, and one with a trajectory of its own flies."""

import json

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.config.models import MissionConfig
from companion.config.resolve import configs_folder, load_flight
from companion.flight.assemble import infeasibilities, make_trajectory
from companion.link.url import parse_link_url
from companion.trajectories.from_file import load_trajectory

MISSIONS = sorted((configs_folder() / "missions").glob("*.yaml"))
TRAJECTORIES = sorted((configs_folder() / "trajectories").iterdir())


def test_these_are_shipped():
    assert [path.stem for path in MISSIONS] == [
        "figure-eight-fan",
        "figure-eight",
        "own-trajectory",
        "real-px4",
    ]
    assert [path.name for path in TRAJECTORIES] == [
        "bound-check.yaml",
        "climbing-square.yaml",
        "hover.yaml",
        "short-eight.yaml",
        "slalom.csv",
    ]


@pytest.mark.parametrize("path", MISSIONS, ids=lambda path: path.stem)
def test_a_shipped_mission_fits_its_vehicle_and_its_geofence(path):
    config = load_flight(path, {}, {})
    assert infeasibilities(make_trajectory(config.mission), config.mission, config.vehicle) == []
    if config.mission.connect is not None:
        assert parse_link_url(config.mission.connect).port == 14540


@pytest.mark.parametrize("path", TRAJECTORIES, ids=lambda path: path.name)
def test_a_shipped_trajectory_fits_the_default_vehicle_and_geofence(path):
    config = load_flight(None, {}, {})
    assert infeasibilities(load_trajectory(path), config.mission, config.vehicle) == []


def test_the_first_mission_shows_the_defaults():
    shown = load_flight(configs_folder() / "missions" / "figure-eight.yaml", {}, {}).mission
    assert shown == MissionConfig()


def test_a_trajectory_of_ones_own_is_flown(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mission = str(configs_folder() / "missions" / "own-trajectory.yaml")
    result = CliRunner().invoke(app, ["fly", "--mission", mission, "--lockstep", "--json"])
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    assert (answer["outcome"], answer["completed"]) == ("landed", True)
    assert answer["trajectory"].endswith("slalom.csv")
    assert answer["mean_tracking_error_m"] < 0.03
    (folder,) = (tmp_path / "flights").iterdir()
    assert folder.name.endswith("-traj-slalom")
    assert answer["log_dir"] == str(folder)
    assert sorted(path.name for path in folder.iterdir()) == [
        "flight.mcap",
        "flight.tlog",
        "report.html",
        "result.json",
        "track.png",
    ]
