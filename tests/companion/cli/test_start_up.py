"""What is not used is not imported: `companion --help` answers at once, and flights begin soon."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

IMPORTED = re.compile(r"import time:\s+\d+ \|\s+\d+ \|\s*(\S+)")
OURS = ("numpy", "scipy", "matplotlib", "pymavlink", "dask")
HEAVY = (*OURS, "pydantic")
"""With what typer itself may import, once it looks at the options of a command."""


def told(*words: str) -> tuple[str, list[str]]:
    """Standard output, and the standard error of a run that tells its imports, by lines.

    The plant is not compiled: for one short flight, loading what compiles takes longest.
    """
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "companion", *words],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "SITL_SHIM_COMPILED": "0"},
    )
    return done.stdout, done.stderr.splitlines()


def imports(lines: list[str]) -> list[str]:
    """Modules in the order in which their imports ended."""
    return [found[1] for line in lines if (found := IMPORTED.match(line))]


@pytest.mark.parametrize(
    ("words", "heavy"), [(("--help",), HEAVY), (("--version",), HEAVY), (("fly", "--help"), OURS)]
)
def test_help_imports_no_heavy_package(words: tuple[str, ...], heavy: tuple[str, ...]) -> None:
    said, lines = told(*words)
    assert "companion" in said
    packages = {module.partition(".")[0] for module in imports(lines)}
    assert "typer" in packages  # or nothing was told
    assert packages.isdisjoint(heavy)


def test_a_flight_imports_what_draws_only_after_it(tmp_path: Path) -> None:
    trajectory = tmp_path / "short.csv"
    trajectory.write_text("t,x,y,z\n0,0,0,1.5\n2,0.2,0,1.5\n4,0,0,1.5\n")
    said, lines = told("fly", f"--traj={trajectory}", "--lockstep", f"--out={tmp_path / 'flight'}")
    assert "landed" in said
    ended = max(at for at, line in enumerate(lines) if re.match(r"\s*\d+\.\d s\s+land ", line))
    before = {module.partition(".")[0] for module in imports(lines[:ended])}
    assert "pymavlink" in before  # or nothing was told
    assert before.isdisjoint({"matplotlib", "PIL", "dask", "distributed", "pyarrow", "mavsdk"})
    assert "matplotlib" in imports(lines[ended:])
