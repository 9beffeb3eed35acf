"""What is built for people who have no checkout: the wheel and the source distribution."""

import email
import hashlib
import json
import os
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("companion", "sitl_shim")
COPIES = {
    "companion/_configs": "configs",
    "sitl_shim/_scenarios": "configs/scenarios",
    "sitl_shim/_faults": "configs/faults",
}
"""Folders of the wheel that stand elsewhere in the checkout."""


def run(*command, folder, **variables):
    """Run a command elsewhere, as somebody does who has nothing set."""
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [str(part) for part in command],
        check=False,
        cwd=folder,
        env=environment | variables,
        capture_output=True,
        text=True,
        timeout=200.0,
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def build(target, source, folder):
    run(sys.executable, "-m", "hatchling", "build", "-t", target, "-d", folder, folder=source)
    (built,) = folder.iterdir()
    return built


def files_below(folder):
    return {
        path.relative_to(folder).as_posix(): path
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


def digests(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return {n: hashlib.sha256(archive.read(n)).hexdigest() for n in archive.namelist()}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return build("wheel", ROOT, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    return build("sdist", ROOT, tmp_path_factory.mktemp("sdist"))


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """The programs' folder of a fresh environment with the wheel, and no way to the checkout.

    What the wheel depends on is lent by the environment of the tests: nothing is downloaded.  That
    environment's own link to the checkout is not followed from there.
    """
    home = tmp_path_factory.mktemp("elsewhere") / "environment"
    lends_pip = find_spec("pip") is not None
    venv.create(home, with_pip=not lends_pip, symlinks=True)
    programs = home / "bin"
    pip = (sys.executable, "-m", "pip", "--python") if lends_pip else ()
    alone = () if lends_pip else ("-m", "pip")
    install = ("install", "--quiet", "--no-deps", "--no-index", "--no-compile", wheel)
    run(*pip, programs / "python", *alone, *install, folder=home)
    asked = "import sysconfig; print(sysconfig.get_path('purelib'))"
    packages = Path(run(programs / "python", "-c", asked, folder=home).strip())
    lent = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    (packages / "lent.pth").write_text("\n".join(sorted(lent)) + "\n")
    return programs


def test_the_wheel_holds_the_packages_and_the_configurations_and_nothing_else(wheel):
    expected = {}
    for package in PACKAGES:
        expected |= {f"{package}/{n}": p for n, p in files_below(ROOT / package).items()}
    for inside, outside in COPIES.items():
        expected |= {f"{inside}/{n}": p for n, p in files_below(ROOT / outside).items()}
    held = {n: d for n, d in digests(wheel).items() if ".dist-info/" not in n}
    assert held == {n: hashlib.sha256(p.read_bytes()).hexdigest() for n, p in expected.items()}


def test_the_wheel_names_itself_as_the_project_does(wheel):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    with zipfile.ZipFile(wheel) as archive:
        (folder,) = {n.split("/")[0] for n in archive.namelist() if ".dist-info/" in n}
        metadata = email.message_from_bytes(archive.read(f"{folder}/METADATA"))
        scripts = archive.read(f"{folder}/entry_points.txt").decode()
        licences = {
            name.removeprefix(f"{folder}/licenses/"): archive.read(name)
            for name in archive.namelist()
            if name.startswith(f"{folder}/licenses/")
        }
    assert wheel.name == f"companion-{project['version']}-py3-none-any.whl"
    assert metadata["Name"] == "companion"
    assert metadata["Version"] == project["version"]
    assert metadata["Requires-Python"] == project["requires-python"]
    assert metadata["License-Expression"] == project["license"]
    assert set(metadata.get_all("Provides-Extra")) == set(project["optional-dependencies"])
    assert {"companion = companion.cli:main", "sitl-shim = sitl_shim.cli:main"} <= set(
        scripts.splitlines()
    )
    assert licences == {name: (ROOT / name).read_bytes() for name in licences}
    assert {"LICENSE", "companion/live/static/vendor/three/LICENSE"} <= set(licences)


def test_the_source_distribution_builds_the_same_wheel(wheel, sdist, tmp_path):
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path / "source", filter="data")
    (source,) = (tmp_path / "source").iterdir()
    again = tmp_path / "again"
    again.mkdir()
    assert digests(build("wheel", source, again)) == digests(wheel)
    tests = {n for n in files_below(ROOT / "tests") if n.endswith(".py")}
    assert tests <= set(files_below(source / "tests"))


def test_the_wheel_alone_flies_and_finds_what_it_ships(installed, tmp_path):
    packages = (
        installed / "python",
        "-c",
        "import companion, sitl_shim; print(companion, sitl_shim)",
    )
    assert str(ROOT) not in run(*packages, folder=tmp_path)
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert run(installed / "companion", "--version", folder=tmp_path) == f"companion {version}\n"
    assert "--autopilot" in run(installed / "sitl-shim", "run", "--help", folder=tmp_path)
    fly = (installed / "companion", "fly", "--traj", "4", "--wind", "fan", "--lockstep", "--json")
    # Compiling the plant would take longer than the flight, and is the same for every install.
    result = json.loads(run(*fly, folder=tmp_path, SITL_SHIM_COMPILED="0"))
    assert result["outcome"] == "landed"
    assert result["mean_tracking_error_m"] < 0.05
    (flight,) = (tmp_path / "flights").iterdir()
    assert {"flight.mcap", "flight.tlog", "result.json"} <= set(files_below(flight))
