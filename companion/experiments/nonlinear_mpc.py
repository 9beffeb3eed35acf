"""A plain nonlinear MPC of the same task, horizon and rate as the paper's linear one.

It stands in for the "nonlinear MPC schemes" to which the paper compares the cost of its linear
one.  It plans roll, pitch and thrust over the vehicle's nonlinear dynamics: direct multiple
shooting, one RK4 step a period, CasADi's derivatives, warm-started from the shifted last solution.
It knows the vehicle's parameters exactly and adapts to nothing.

The problem, in `nonlinear_problem`, is one and the same for the three ways of solving it:

- ``ipopt``: IPOPT with exact second derivatives, until it has converged;
- ``sqp``: CasADi's `sqpmethod` over HPIPM, until it has converged.  Its Hessian is Gauss-Newton's:
  the cost's, which is quadratic, without the dynamics' curvature.  That converges in a few steps
  while the vehicle tracks; from a standstill far away, with bounds active, it often doesn't within
  `_ITERATIONS`;
- ``rti``: the same with a single iteration a plan, the real-time iteration of Diehl, Bock and
  Schlöder (SIAM J. Control Optim. 43(5), 2005).  It is as fast as such a scheme gets here, and
  its plans are not solutions but steps towards one that moves on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Literal

import numpy as np

from companion.control.reference_model import Array
from companion.experiments.flight_store import MissingExtraError
from companion.experiments.nonlinear_problem import (
    CARRIED,
    STAGE,
    NonlinearSettings,
    bounds,
    problem,
)
from companion.experiments.point_mass import HOVER, INPUTS, STATES
from companion.extras import install_extra

SolverName = Literal["ipopt", "sqp", "rti"]
"""Ways of solving; see above."""

_TOLERANCE = 1e-6
_ITERATIONS = 100


@dataclass(frozen=True, slots=True)
class NonlinearMemory:
    """What the controller carries from plan to plan."""

    applied: tuple[float, ...]
    """The input that was applied last."""
    guess: Array | None = None
    """The last solution, shifted by one period; None before the first plan."""
    multipliers: tuple[Any, Any] | None = None
    """Of the last solution's bounds and constraints, CasADi's own type; not shifted, which saves
    no iterations."""


@dataclass(frozen=True, slots=True)
class NonlinearRecord:
    """Why the input is what it is."""

    converged: bool
    """The solver met its tolerance; with `rti` it isn't asked to."""
    usable: bool
    """A finite solution came back; else the shifted last one was applied."""
    iterations: int
    states: Array
    """(N_h + 2, STATES) the plan's states."""
    inputs: Array
    """(N_h + 1, INPUTS) the plan's inputs."""


class NonlinearMpc:
    """The controller with its solver; the solver holds nothing from plan to plan."""

    def __init__(self, settings: NonlinearSettings, solver: SolverName = "ipopt") -> None:
        """Build the problem and the solver, 0.1 to 0.5 s.

        Raises:
            MissingExtraError: CasADi is not installed.
        """
        casadi = load_casadi()
        self.settings = settings
        self._inputs = settings.horizon + 1
        program, hessian = problem(casadi, settings)
        name, options = _solver_options(casadi, solver)
        if solver != "ipopt":
            options["hess_lag"] = hessian
        self._solver = casadi.nlpsol("nonlinear_mpc", name, program, options)
        self._bounds = {key: casadi.DM(value) for key, value in bounds(settings).items()}

    @property
    def preview_times_s(self) -> Array:
        """Offsets from k̄ at which `step` wants y*, (N_h + 2,), as the linear MPC's."""
        times: Array = self.settings.period_s * np.arange(self._inputs + 1, dtype=np.float64)
        return times

    def start(self, applied: Sequence[float] = HOVER) -> NonlinearMemory:
        """Memory before the first plan, with the input that is in effect."""
        return NonlinearMemory(tuple(applied))

    def step(
        self, memory: NonlinearMemory, state: Sequence[float], preview_m: Array
    ) -> tuple[NonlinearMemory, tuple[float, ...], NonlinearRecord]:
        """Plan from the state at k̄ and apply the first input.

        Args:
            memory: from `start` or from the plan before.
            state: as in `STATES`, at k̄.
            preview_m: (N_h + 2, 3) y* at k̄ … k̄+N_h+1.

        Returns:
            The new memory, the input to apply until the next plan, and the record.
        """
        guess = memory.guess if memory.guess is not None else self._first_guess(memory, preview_m)
        given: dict[str, Any] = dict(self._bounds)
        if memory.multipliers is not None:
            given["lam_x0"], given["lam_g0"] = memory.multipliers
        parameters = np.concatenate([state, memory.applied, preview_m.ravel()])
        solution = self._solver(x0=guess, p=parameters, **given)
        found: Array = solution["x"].full().ravel()
        usable = bool(np.isfinite(found).all())
        if not usable:
            found = guess
        said = self._solver.stats()
        stages = found[: STAGE * self._inputs].reshape(self._inputs, STAGE)
        applied = tuple(stages[0, -INPUTS:].tolist())
        multipliers = (solution["lam_x"], solution["lam_g"]) if usable else None
        advanced = NonlinearMemory(applied, _shifted(found), multipliers)
        record = NonlinearRecord(
            converged=usable and bool(said["success"]),
            usable=usable,
            iterations=int(said["iter_count"]),
            states=np.vstack([stages[:, :STATES], found[-CARRIED:-INPUTS]]),
            inputs=stages[:, -INPUTS:],
        )
        return advanced, applied, record

    def _first_guess(self, memory: NonlinearMemory, preview_m: Array) -> Array:
        """On the desired path, at rest and level."""
        stages = np.zeros((self._inputs + 1, STAGE))
        stages[:, :3] = preview_m
        stages[:, STATES : STATES + INPUTS] = memory.applied
        stages[:, -INPUTS:] = HOVER
        return stages.ravel()[:-INPUTS]


def load_casadi() -> ModuleType:
    """CasADi.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        import casadi
    except ImportError as error:
        raise MissingExtraError(
            f"The nonlinear MPC needs CasADi, which is missing: {install_extra('nonlinear')}"
        ) from error
    module: ModuleType = casadi
    return module


def _solver_options(casadi: Any, solver: SolverName) -> tuple[str, dict[str, Any]]:  # noqa: ANN401
    """CasADi's name of a solver and its options: silent, and warm-started."""
    if solver == "ipopt":
        ipopt = {
            "print_level": 0,
            "sb": "yes",
            "tol": _TOLERANCE,
            "warm_start_init_point": "yes",
            "mu_init": 1e-4,
            "max_iter": _ITERATIONS,
        }
        return "ipopt", {"print_time": False, "ipopt": ipopt}
    silent = {"print_header": False, "print_iteration": False, "print_status": False}
    quiet: dict[str, Any] = {"print_time": False, "error_on_fail": False}
    program = quadratic_solver(casadi)
    if program == "qrqp":
        quiet |= {"print_header": False, "print_iter": False, "print_info": False}
    return "sqpmethod", {
        "print_time": False,
        **silent,
        "tol_pr": _TOLERANCE,
        "tol_du": _TOLERANCE,
        "max_iter": 1 if solver == "rti" else _ITERATIONS,
        "qpsol": program,
        "qpsol_options": quiet,
    }


def quadratic_solver(casadi: Any) -> str:  # noqa: ANN401 - CasADi has no types
    """HPIPM, which uses the structure of such problems, where the wheel has it."""
    return "hpipm" if casadi.has_conic("hpipm") else "qrqp"


def _shifted(found: Array) -> Array:
    """A plan one period on, its last stage repeated."""
    last, last_input = found[-CARRIED:], found[-CARRIED - INPUTS : -CARRIED]
    return np.concatenate([found[STAGE:-CARRIED], last, last_input, last])
