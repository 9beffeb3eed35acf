"""Versions of what is installed, and whether the solvers solve."""

import platform
import re
import time
from collections.abc import Callable
from importlib import metadata

import numpy as np

from companion.config.folders import configs_folder
from companion.control.qp.port import QpSolverFactory
from companion.control.qp.solvers import SolverName, solver_factory
from companion.doctor.readings import Extra, Software, Solver
from companion.extras import pip_install

PURPOSES = {
    "study": "companion paper, tune, campaign, report, and tables as Parquet",
    "nonlinear": "the nonlinear MPC that companion paper times",
    "mavsdk": "link.mission_backend: mavsdk",
    "mocap": "Vicon, OptiTrack, Qualisys, VRPN",
    "daqp": "the quickest QP solver",
    "speed": "a compiled plant: faster simulated flights",
    "cluster": "campaigns on a Dask cluster",
    "live": "companion fly --live, companion live",
    "rerun": "companion export --to rerun",
}
"""What each extra is for; those that only developers want are not told."""
SHIPPED = (
    "missions",
    "controllers",
    "vehicles",
    "trajectories",
    "scenarios",
    "faults",
    "campaigns",
    "schemas",
)
_REQUIREMENT = re.compile(r"\s*([A-Za-z0-9][A-Za-z0-9._-]*)")
_EXTRA = re.compile(r"extra\s*==\s*['\"]([^'\"]+)['\"]")
_SOLVERS: tuple[SolverName, ...] = ("osqp", "daqp")
_SOLVES = 21
_TOLERANCE = 1e-3


def read_software(version: str, commit: str) -> Software:
    """Versions, and which extras are there.

    Args:
        version: of the program.
        commit: of its checkout; empty outside of one.
    """
    plain, extras = _requirements()
    found = tuple(
        Extra(name, purpose, tuple(one for one in extras.get(name, ()) if _version(one) is None))
        for name, purpose in PURPOSES.items()
        if not extras or name in extras
    )
    return Software(
        companion=version,
        commit=commit,
        python=f"{platform.python_implementation()} {platform.python_version()}",
        system=f"{platform.system()} {platform.release()}, {platform.machine()}",
        packages={name: _version(name) for name in plain},
        extras=found if extras else (),
        pip_install=pip_install(),
    )


def missing_configs() -> tuple[str, ...]:
    """Folders that should lie in that of the shipped configurations and do not."""
    folder = configs_folder()
    return tuple(name for name in SHIPPED if not (folder / name).is_dir())


def read_solvers(
    factory: Callable[[SolverName], QpSolverFactory] = solver_factory,
) -> tuple[Solver, ...]:
    """Let each solver solve a small problem whose answer is known."""
    return tuple(_solver(name, factory) for name in _SOLVERS)


def _solver(name: SolverName, factory: Callable[[SolverName], QpSolverFactory]) -> Solver:
    """The point of the unit square that is nearest to (1, 3) is (1, 1)."""
    try:
        make = factory(name)
    except ModuleNotFoundError:
        return Solver(name, installed=False)
    q, low, high = np.array([-2.0, -6.0]), np.zeros(2), np.ones(2)
    try:
        solver = make(2.0 * np.eye(2), np.eye(2))
        times_s = []
        for _ in range(_SOLVES):
            began_s = time.perf_counter()
            solution = solver.solve(q, low, high)
            times_s.append(time.perf_counter() - began_s)
    except Exception as error:  # whatever a foreign library raises is the finding
        return Solver(name, installed=True, trouble=f"{type(error).__name__}: {error}")
    if solution.x is None:
        return Solver(name, installed=True, trouble=f"solved nothing: {solution.status}")
    if float(np.abs(solution.x - 1.0).max()) > _TOLERANCE:
        found = ", ".join(f"{value:.4g}" for value in solution.x)
        return Solver(name, installed=True, trouble=f"a wrong answer: ({found}) in place of (1, 1)")
    return Solver(name, installed=True, time_us=1e6 * sorted(times_s)[len(times_s) // 2])


def _requirements() -> tuple[tuple[str, ...], dict[str, list[str]]]:
    """What the installed package needs, and what each of its extras does."""
    try:
        lines = metadata.requires("companion") or []
    except metadata.PackageNotFoundError:  # run from a checkout that is not installed
        lines = []
    plain: list[str] = []
    extras: dict[str, list[str]] = {}
    for line in lines:
        name = _REQUIREMENT.match(line)
        extra = _EXTRA.search(line)
        if name is None or name[1] == "companion":
            continue
        if extra is None:
            plain.append(name[1])
        else:
            extras.setdefault(extra[1], []).append(name[1])
    return tuple(plain), extras


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None
