import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from companion.config.resolve import configs_folder
from companion.config.yaml_source import ConfigError
from companion.experiments import flight_task
from companion.experiments.flight_task import FlightTask, load_task

TASK = FlightTask("mpc-l1", 4, wind="fan")
SHIPPED = configs_folder() / "controllers" / "mpc-l1" / "bebop2.yaml"


def test_the_fan_is_that_of_the_trajectory_and_what_the_task_says_goes_to_the_shim(tmp_path):
    plant = tmp_path / "heavy.yaml"
    plant.write_text("")
    loaded = load_task(replace(TASK, seed=7, sensors="exact", shim_vehicle=str(plant)))

    assert loaded.shim.scenario.name == "fan-4.yaml"
    assert (loaded.shim.seed, loaded.shim.sensors) == (7, "exact")
    assert loaded.shim.vehicle == str(plant)
    assert load_task(TASK).shim.vehicle == "bebop2"


def test_a_key_can_be_read_and_is_fit_for_a_file():
    assert re.fullmatch(r"mpc-l1-bebop2-t4-fan-s1-[0-9a-f]{10}", TASK.key)
    nasty = replace(TASK, trajectory=str(configs_folder() / "trajectories" / "slalom.csv"))
    assert re.fullmatch(
        r"mpc-l1-bebop2-tslalom-calm-s1-[0-9a-f]{10}", replace(nasty, wind="calm").key
    )


def test_a_key_is_the_same_in_another_process():
    ask = (
        "from companion.experiments.flight_task import FlightTask;"
        "print(FlightTask('mpc-l1', 4, wind='fan').key)"
    )
    said = subprocess.run(
        [sys.executable, "-c", ask],
        check=True,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONHASHSEED": "7", "PYTHONPATH": os.getcwd()},
    )

    assert said.stdout.strip() == TASK.key


def test_every_field_of_a_task_changes_its_key(tmp_path):
    plant = tmp_path / "bebop2.yaml"
    plant.write_text("mass_kg: 0.5\n")
    tasks = [
        TASK,
        replace(TASK, trajectory=3, wind="fan-4"),
        replace(TASK, wind="calm"),
        replace(TASK, seed=2),
        replace(TASK, vehicle="x500"),
        replace(TASK, settings=(("hover_s", "1.0"),)),
        replace(TASK, settings=(("controller.l1.gamma", "[1e3, 1e3, 999.0]"),)),
        replace(TASK, settings=(("vehicle.hover_thrust", "0.45"),)),
        replace(TASK, sensors="exact"),
        replace(TASK, airborne=False),
        replace(TASK, faults="bad-link"),
        replace(TASK, faults="{link: [{loss: 0.1}]}"),
        replace(TASK, shim_vehicle=str(plant)),
    ]

    assert len({task.key for task in tasks}) == len(tasks)


def test_a_key_follows_a_files_content_and_not_its_place(tmp_path):
    folders = [tmp_path / name for name in ("one", "two")]
    keys = []
    for folder in folders:
        folder.mkdir()
        path = folder / "mine.yaml"
        shutil.copy(SHIPPED, path)
        keys.append(replace(TASK, controller=str(path)).key)
    assert keys[0] == keys[1]

    text = path.read_text()
    path.write_text(text.replace("source: >-", "source: >-\n  Elsewhere:") + "\n# a remark\n")
    assert replace(TASK, controller=str(path)).key.split("-")[-1] == keys[0].split("-")[-1]
    path.write_text(re.sub(r"(?m)^(\s+k): .*$", r"\1: [0.6, 0.6, 0.5]", text, count=1))
    assert replace(TASK, controller=str(path)).key != keys[0]


@pytest.mark.parametrize("field", ["wind", "faults", "trajectory", "shim_vehicle", "sensors"])
def test_a_key_follows_the_content_of_the_other_files(tmp_path, field):
    shipped = {
        "wind": configs_folder() / "scenarios" / "gusts.yaml",
        "faults": configs_folder() / "faults" / "bad-link.yaml",
        "trajectory": configs_folder() / "trajectories" / "slalom.csv",
        "shim_vehicle": configs_folder() / "vehicles" / "bebop2.yaml",
        "sensors": Path("sitl_shim/sensors/profiles/exact.yaml"),
    }[field]
    path = tmp_path / shipped.name
    shutil.copy(shipped, path)
    task = replace(TASK, wind="calm")
    before = replace(task, **{field: str(path)}).key

    path.write_text(path.read_text() + "\n")

    assert replace(task, **{field: str(path)}).key != before


def test_a_key_follows_the_code_that_flies(monkeypatch, tmp_path):
    before = TASK.key
    names = [name for name, _ in flight_task._deciding_files()]
    flying = ("companion/lockstep.py", "control/l1_adaptive.py", "vehicles/bebop2.yaml")
    for needed in (*flying, "report/metrics.py", "experiments/flight_table.py"):
        assert needed in names
    assert not {"report/figure.py", "experiments/tuning.py", "cli/fly.py"} & set(names)

    other = tmp_path / "mpc.py"
    other.write_text("changed")
    files = [(n, other if n == "control/mpc.py" else p) for n, p in flight_task._deciding_files()]
    monkeypatch.setattr(flight_task, "_deciding_files", lambda: iter(files))
    flight_task.code_digest.cache_clear()
    changed = TASK.key
    flight_task.code_digest.cache_clear()

    assert changed != before


@pytest.mark.parametrize(
    ("task", "said"),
    [
        (replace(TASK, controller="nonsense"), "unknown controller"),
        (replace(TASK, wind="storm"), "unknown scenario"),
        (replace(TASK, settings=(("hover", "1"),)), "unknown key"),
        (replace(TASK, settings=(("hover_s", "1"), ("hover_s", "2"))), "set twice"),
        (replace(TASK, shim_vehicle="nowhere.yaml"), "no such plant file"),
        (replace(TASK, trajectory="nowhere.csv", wind="calm"), "nowhere.csv"),
    ],
)
def test_a_task_that_can_not_be_flown_says_why(task, said):
    with pytest.raises(ConfigError, match=said):
        _ = task.key
