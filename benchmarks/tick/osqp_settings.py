"""OSQP's settings for both of its formulations."""

from typing import Any

SPARSE_TOLERANCE = 3e-6
CONDENSED_TOLERANCE = 1e-5
"""Such that the first input is right to a millimetre."""
_COMMON: dict[str, Any] = {
    "verbose": False,
    "max_iter": 4000,
    "adaptive_rho": True,
    "adaptive_rho_interval": 25,
    "polishing": False,
    "warm_starting": True,
    "check_termination": 10,
}
"""The interval of adaptive rho is a count and not a time, so that a run can be repeated."""


def settings(tolerance: float) -> dict[str, Any]:
    """All settings, for an absolute and relative tolerance."""
    return _COMMON | {"eps_abs": tolerance, "eps_rel": tolerance}
