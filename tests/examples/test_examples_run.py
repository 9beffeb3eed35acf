"""The five examples run as they stand, in a folder of their own, and print what they promise."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
PNG = b"\x89PNG\r\n\x1a\n"
NUMBER = re.compile(r"\d+(?:\.\d+)?")
HALF_A_TENTH_MM = 0.05


def run(name: str, folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def figures(pattern: str, text: str) -> list[float]:
    return [float(found) for found in re.findall(pattern, text)]


def is_as_shown(page: str, said: str) -> bool:
    """Whether a page shows this output, but for figures that differ by a tenth at most."""
    text = (EXAMPLES.parent / "docs" / "api" / page).read_text(encoding="utf-8")
    (shown,) = re.findall(r"^```text\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    ours, theirs = NUMBER.findall(said), NUMBER.findall(shown)
    alike = NUMBER.sub("#", said) == NUMBER.sub("#", shown)
    return alike and [float(n) for n in ours] == pytest.approx(
        [float(n) for n in theirs], rel=0.1, abs=0.02
    )


def loaded(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_there_are_five_examples():
    found = {path.name for path in EXAMPLES.iterdir() if path.suffix in (".py", ".ipynb")}
    assert found == {
        "another_vehicle.py",
        "fly_and_plot.ipynb",
        "own_controller.py",
        "own_trajectory.py",
        "own_wind.py",
    }


def test_a_controller_of_ones_own_tracks_as_well_as_mpc_l1(tmp_path):
    said = run("own_controller.py", tmp_path)

    assert is_as_shown("own-controller.md", said)
    geometric, mpc_l1 = figures(r"mean error ([\d.]+) mm", said)
    assert said.startswith("geometric: tracked")
    assert 10.0 < geometric < 40.0
    assert 10.0 < mpc_l1 < 40.0
    assert (tmp_path / "own_controller.png").read_bytes().startswith(PNG)


def test_a_trajectory_of_ones_own_is_flown_and_one_that_is_too_fast_is_not(tmp_path):
    said = run("own_trajectory.py", tmp_path)

    assert is_as_shown("own-trajectory.md", said)
    (error,) = figures(r"helix: tracked, mean error ([\d.]+) mm", said)
    assert 5.0 < error < 35.0
    assert "refused: trajectory 'too fast' needs an acceleration of 6." in said
    assert (tmp_path / "own_trajectory.png").read_bytes().startswith(PNG)


def test_a_wind_of_ones_own_blows_alike_whenever_it_is_flown(tmp_path):
    from companion.api import fly

    said = run("own_wind.py", tmp_path)

    assert is_as_shown("own-wind.md", said)
    (calm,) = figures(r"calm: mean error ([\d.]+) mm, the air pushes by up to 0.00", said)
    ((whirl, push),) = re.findall(r"whirl: mean error ([\d.]+) mm, .* to ([\d.]+) m/s²", said)
    assert calm < 20.0
    assert calm < float(whirl) < 60.0
    assert 1.2 < float(push) < 1.6
    again = fly(trajectory=2, wind=loaded("own_wind").whirl, seed=1)
    assert 1e3 * again.mean_error_m == pytest.approx(float(whirl), abs=HALF_A_TENTH_MM)


def test_another_vehicle_is_flown_from_its_two_files(tmp_path):
    said = run("another_vehicle.py", tmp_path)

    assert is_as_shown("another-vehicle.md", said)
    errors = figures(r"tracked, mean error ([\d.]+) mm", said)
    assert len(errors) == 2
    assert max(errors) < 40.0
    light, heavy = figures(r"hovers at ([\d.]+) of its thrust", said)
    assert heavy / light == pytest.approx(1.3, abs=0.03)
    assert {path.name for path in tmp_path.iterdir()} == {"heavy.yaml", "heavy-plant.yaml"}
