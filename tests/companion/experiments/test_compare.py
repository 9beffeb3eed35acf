import shutil

import pytest

from companion.config.resolve import configs_folder
from companion.config.yaml_source import ConfigError
from companion.experiments.compare import Contender, Grid, contenders, plan
from companion.experiments.perturbations import chosen

BEBOP2 = configs_folder() / "vehicles" / "bebop2.yaml"


def grid(*controllers, **changes):
    fields = {
        "contenders": contenders(controllers, "bebop2"),
        "winds": ("calm", "fan"),
        "perturbations": chosen(("mass+20", "loss10")),
        "trajectories": (1, 4),
        "seeds": (1, 2, 3),
    }
    return Grid(**(fields | changes))


def test_a_controller_may_have_a_label_and_a_vehicle_file_of_its_own():
    assert contenders(("mpc-l1", "found=a/b.yaml@a/vehicle.yaml", "a/c.yaml"), "x500") == (
        Contender("mpc-l1", "mpc-l1", "x500"),
        Contender("found", "a/b.yaml", "a/vehicle.yaml"),
        Contender("c", "a/c.yaml", "x500"),
    )


def test_two_files_of_one_name_are_told_apart_by_their_paths():
    told = contenders(("mpc-l1", "a/mpc-l1.yaml", "pid-l1"), "bebop2")
    assert [contender.label for contender in told] == ["mpc-l1", "a/mpc-l1.yaml", "pid-l1"]


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        ((), "no controller"),
        (("mpc-l1", "mpc-l1"), "given twice"),
        (("a=mpc-l1", "a=pid-l1"), "given twice"),
        (("x=@v.yaml",), "no controller is named"),
    ],
)
def test_controllers_that_can_not_be_told_apart_are_refused(texts, said):
    with pytest.raises(ConfigError, match=said):
        contenders(texts, "bebop2")


def test_each_controller_flies_every_wind_perturbation_trajectory_and_seed(tmp_path):
    planned = plan(grid("mpc-l1", "pid-l1", sensors="exact", whole=True), tmp_path)

    assert len(planned) == 2 * 2 * 3
    tasks = planned["pid-l1", "fan", "mass+20"]
    assert [(t.trajectory, t.seed) for t in tasks] == [(n, s) for n in (1, 4) for s in (1, 2, 3)]
    for (label, wind, perturbation), of_cell in planned.items():
        for task in of_cell:
            assert (task.controller, task.wind, task.sensors) == (label, wind, "exact")
            assert not task.airborne
            assert (task.shim_vehicle is not None) == (perturbation == "mass+20")
            assert (task.faults is not None) == (perturbation == "loss10")
    assert len({task.key for of_cell in planned.values() for task in of_cell}) == 72


def test_a_controller_flies_with_its_own_vehicle_file_and_the_plant_of_that_name(tmp_path):
    vehicle = tmp_path / "identified.yaml"
    shutil.copy(BEBOP2, vehicle)
    planned = plan(grid(f"mpc-l1@{vehicle}", "plain=mpc-l1"), tmp_path)
    own, plain = planned["mpc-l1", "calm", "mass+20"][0], planned["plain", "calm", "mass+20"][0]
    assert (own.vehicle, plain.vehicle) == (str(vehicle), "bebop2")
    assert own.shim_vehicle == plain.shim_vehicle


def test_controllers_on_different_vehicles_are_not_compared(tmp_path):
    with pytest.raises(ConfigError, match="different vehicles: mpc-l1 flies bebop2, other flies"):
        plan(grid("mpc-l1", "other=mpc-l1@x500"), tmp_path)


def test_a_controller_that_there_is_none_of_is_refused_before_anything_flies(tmp_path):
    with pytest.raises(ConfigError, match="unknown controller 'mpc-l2'"):
        plan(grid("mpc-l1", "mpc-l2"), tmp_path)
