"""Files to begin with: whole, commented, valid, and never in the place of another."""

import re

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.config.folders import schema_path
from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.config.resolve import controller_path, find_config, load_flight
from companion.config.validation import validate
from companion.config.yaml_source import read_yaml
from companion.experiments.campaigns.plan import load_plan
from companion.trajectories.from_file import load_trajectory
from sitl_shim.faults.schema import load_faults
from sitl_shim.wind.scenario import load_scenario

COMMENTED_KEY = re.compile(r"^( *)#(?=[^ #\n])", re.MULTILINE)


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def new(*words):
    return CliRunner().invoke(app, ["new", *words])


def written(path, *words):
    done = new(*words, path)
    assert done.exit_code == 0, done.output
    return done.output


def test_a_new_mission_is_a_mission_with_what_is_set_first(here):
    said = written("m.yaml", "mission")
    assert "companion fly --mission m.yaml --lockstep" in said
    text = (here / "m.yaml").read_text()
    assert text.startswith(f"# yaml-language-server: $schema={schema_path('mission')}\n")
    live = set(read_yaml(here / "m.yaml").data)
    assert live == {"trajectory", "controller", "vehicle", "wind", "seed"}
    assert load_flight(here / "m.yaml", {}, {}).mission.trajectory == 4


def test_it_has_every_key_of_the_model_and_each_counts_without_its_mark(here):
    written("m.yaml", "mission")
    text = COMMENTED_KEY.sub(r"\1", (here / "m.yaml").read_text())
    (here / "all.yaml").write_text(text)
    source = read_yaml(here / "all.yaml")
    assert set(source.data) == set(MissionConfig.model_fields)
    mission = validate(MissionConfig, source)
    default = MissionConfig()
    shown_otherwise = {"seed", "faults", "sensors", "plant", "connect", "link", "mocap", "switch",
                       "preflight"}  # fmt: skip
    for name in set(MissionConfig.model_fields) - shown_otherwise:
        assert getattr(mission, name) == getattr(default, name), name


def test_its_options_are_set_and_files_are_named_from_its_folder(here):
    written("loop.csv", "trajectory")
    (here / "missions").mkdir()
    written("missions/m.yaml", "mission", "--traj", "loop.csv", "--wind", "gusts")
    config = load_flight(here / "missions" / "m.yaml", {}, {})
    assert config.mission.wind == "gusts"
    assert load_trajectory(here / str(config.mission.trajectory)).end_s == 8.0


def test_a_file_that_is_there_is_not_overwritten(here):
    (here / "mission.yaml").write_text("seed: 7\n")
    done = new("mission")
    assert done.exit_code == 2
    assert "mission.yaml is there already" in done.output
    assert (here / "mission.yaml").read_text() == "seed: 7\n"


@pytest.mark.parametrize(
    ("base", "vehicle"),
    [("mpc-l1", "bebop2"), ("mpc-l1", "x500"), ("mpc-l1-plus", "x500"), ("pid-l1", "bebop2"),
     ("mpc-pid", "bebop2"), ("lqr-l1", "bebop2")],
)  # fmt: skip
def test_a_new_controller_is_the_shipped_one_with_comments(here, base, vehicle):
    written("c.yaml", "controller", "--from", base, "--vehicle", vehicle)
    made = validate(ControllerConfig, read_yaml(here / "c.yaml"))
    shipped = validate(ControllerConfig, read_yaml(controller_path(base, vehicle)))
    assert made.model_dump(exclude={"source"}) == shipped.model_dump(exclude={"source"})
    assert " ".join(made.source.split()) == " ".join(shipped.source.split())
    assert "α" not in (here / "c.yaml").read_text()


def test_a_new_vehicle_is_the_shipped_one(here):
    written("v.yaml", "vehicle", "--from", "x500")
    made = validate(VehicleConfig, read_yaml(here / "v.yaml"))
    shipped = validate(VehicleConfig, read_yaml(find_config("vehicle", "x500")))
    assert made.model_dump(exclude={"source"}) == shipped.model_dump(exclude={"source"})


def test_a_new_campaign_can_be_planned(here):
    written("c.yaml", "campaign")
    assert load_plan("c.yaml").config.name == "mine"


def test_new_trajectories_scenarios_and_faults_are_read_by_what_reads_them(here):
    for path in ("t.csv", "t.yaml"):
        written(path, "trajectory")
    assert load_trajectory(here / "t.csv").points_m == load_trajectory(here / "t.yaml").points_m
    written("w.yaml", "scenario", "--from", "fan-4")
    assert load_scenario(here / "w.yaml") == load_scenario("fan-4")
    written("f.yaml", "faults")
    assert load_faults(here / "f.yaml") == load_faults("bad-link")
    assert (here / "f.yaml").read_text().count("yaml-language-server") == 1


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("rocket",), "unknown kind 'rocket'. Give one of: mission, "),
        (("mission", "m.txt"), "give a file that ends in .yaml"),
        (("mission", "--from", "x"), "--from says nothing of a new mission"),
        (("trajectory", "--traj", "3"), "--traj says nothing of a new trajectory"),
        (("mission", "--vehicle", "zeppelin"), "unknown vehicle 'zeppelin'"),
        (("controller", "--from", "lqr-l1", "--vehicle", "x500"), "only for bebop2"),
        (("scenario", "--from", "storm"), "unknown scenario 'storm'"),
        (("mission", "no/such/folder/m.yaml"), "No such file"),
    ],
)
def test_what_can_not_be_begun_is_told_and_nothing_is_written(here, words, says):
    done = new(*words)
    assert done.exit_code == 2
    assert says in done.output
    assert list(here.iterdir()) == []
