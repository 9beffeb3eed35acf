"""What a flight imports only when it comes to it: here at once, before workers are forked.

A worker that is forked from a process which has imported this has no library to load.
"""

import contextlib
import importlib

import osqp
import scipy.interpolate
import scipy.linalg

from companion.experiments import fly_task

__all__ = ["fly_task", "osqp", "scipy"]

for _extra in ("pyarrow.parquet", "numba.extending"):
    with contextlib.suppress(ImportError):
        importlib.import_module(_extra)
