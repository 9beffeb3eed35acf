"""Equations that run at every tick, compiled by numba where it is installed; plain otherwise.

An equation is written once, in plain Python on floats and on tuples of floats.  `compiled` gives
it back as machine code, or as it is.  Both give the same bits: no option lets the compiler change
the order of a sum, and it takes square roots and sines from where Python takes them.

The machine code is kept beside the module, or in the user's cache where that cannot be written, so
only the very first use compiles (docs/decisions/0019-compiled-plant.md).
``SITL_SHIM_COMPILED=0`` in the environment leaves everything plain.
"""

import os
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from importlib.util import find_spec
from types import FunctionType
from typing import Any, Final, TypeVar, cast

VARIABLE: Final = "SITL_SHIM_COMPILED"
FLOAT: Final = 0
BOOLEAN: Final = -1
ROW: Final = -2

Equation = Callable[..., Any]
Function = TypeVar("Function", bound=Equation)


def compiling() -> bool:
    """Whether equations are compiled from now on: numba is there, and not switched off."""
    return os.environ.get(VARIABLE, "1") != "0" and find_spec("numba") is not None


def compiled(function: Function, *shapes: int, parts: tuple[Equation, ...] = ()) -> Function:
    """An equation as machine code if that is to be had, else itself.

    Args:
        function: takes and gives floats, booleans, and tuples of floats.
        shapes: of its arguments: the length of a tuple, `FLOAT` or `BOOLEAN`; or `ROW` for
            machine code that takes a numpy array (one dimension, contiguous) in place of a tuple.
        parts: all the functions that it calls, and that those call.
    """
    if not compiling():
        return function
    return cast("Function", _machine_code(function, shapes, parts))


@cache
def _machine_code(
    function: Equation, shapes: tuple[int, ...], parts: tuple[Equation, ...]
) -> Equation:
    from numba import boolean, float64, njit, types

    for part in parts:
        _make_callable(part)
    kinds = {FLOAT: float64, BOOLEAN: boolean, ROW: float64[::1]}
    signature = tuple(
        kinds.get(shape) or types.UniTuple(float64, shape)  # type: ignore[no-untyped-call]
        for shape in shapes
    )
    named = _named_after_its_code(function, parts)
    try:
        dispatcher = njit([signature], cache=True)(named)
    except RuntimeError:  # nowhere to keep it: this process compiles for itself
        dispatcher = njit([signature])(named)
    # The machine code itself, without the search for the one that fits the arguments' types.
    machine_code: Equation = dispatcher.get_overload(signature)
    return machine_code


def _named_after_its_code(function: Equation, parts: tuple[Equation, ...]) -> Equation:
    """The same function under a name that changes with all that it calls.

    numba looks up what it keeps by name and by the file of the function alone.
    """
    codes = [part.__code__ for part in (function, *parts)]
    text = repr([(code.co_code, code.co_names, code.co_consts) for code in codes])
    named = FunctionType(function.__code__, function.__globals__, function.__name__)
    named.__module__ = function.__module__
    named.__qualname__ = f"{function.__qualname__}_{sha256(text.encode()).hexdigest()[:12]}"
    return named


@cache
def _make_callable(function: Equation) -> None:
    """Let machine code call a plain function; it stays plain for everybody else."""
    from numba.extending import register_jitable

    register_jitable(function)
