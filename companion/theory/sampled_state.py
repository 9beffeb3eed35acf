"""The state of the sampled loop as one vector per axis, whatever memories the laws carry."""

from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np

from companion.control.reference_model import Array

_NOT_READ = ("plan_m",)
"""Kept for a fallback of the MPC; the closed form does not read it."""


@dataclass(slots=True)
class LoopState:
    """All that the loop carries from period to period; arrays begin with the axis."""

    plant: Array
    """(axes, states): velocity first, position last."""
    sent: Array
    """(axes, samples): inputs on their way, the newest first."""
    inner: Any
    outer: Any
    references: Array
    """(axes, references): r2 of the last plans, the newest first."""


def pack(state: LoopState) -> Array:
    """(axes, states)."""
    parts = [state.plant, state.sent, state.references]
    parts += [leaf.reshape(len(leaf), -1) for leaf in _leaves((state.inner, state.outer))]
    return np.concatenate(parts, axis=1)


def unpack(like: LoopState, vector: Array) -> LoopState:
    """The state that packs to a vector."""
    cut = 0

    def take(leaf: Array) -> Array:
        nonlocal cut
        width = leaf.size // len(leaf)
        part = vector[:, cut : cut + width].reshape(leaf.shape)
        cut += width
        return part

    plant, sent, references = take(like.plant), take(like.sent), take(like.references)
    return LoopState(plant, sent, _filled(like.inner, take), _filled(like.outer, take), references)


def _leaves(memory: Any) -> list[Array]:  # noqa: ANN401 - of any law
    """The arrays of a memory, however its dataclasses are nested."""
    if isinstance(memory, np.ndarray):
        return [memory]
    if isinstance(memory, tuple):
        return [leaf for part in memory for leaf in _leaves(part)]
    if not is_dataclass(memory):
        return []
    return [leaf for name in _names(memory) for leaf in _leaves(getattr(memory, name))]


def _filled(memory: Any, take: Callable[[Array], Array]) -> Any:  # noqa: ANN401
    """A memory with other arrays, in the order of `_leaves`."""
    if isinstance(memory, np.ndarray):
        return take(memory)
    if not is_dataclass(memory) or isinstance(memory, type):
        return memory
    return replace(
        memory, **{name: _filled(getattr(memory, name), take) for name in _names(memory)}
    )


def _names(memory: Any) -> list[str]:  # noqa: ANN401
    return [field.name for field in fields(memory) if field.name not in _NOT_READ]
