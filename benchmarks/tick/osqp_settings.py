"""OSQP's settings for both of its formulations."""

from typing import Any

TOLERANCE = 1e-5
SETTINGS: dict[str, Any] = {
    "verbose": False,
    "eps_abs": TOLERANCE,
    "eps_rel": TOLERANCE,
    "max_iter": 4000,
    "adaptive_rho": True,
    "adaptive_rho_interval": 25,
    "polishing": False,
    "warm_starting": True,
    "check_termination": 10,
}
"""The interval of adaptive rho is a count and not a time, so that a run can be repeated."""
