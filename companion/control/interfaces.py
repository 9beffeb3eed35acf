"""What every outer and every inner controller offers, so that any two make a stack."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from companion.control.mpc import MpcRecord
from companion.control.pid import PidTerms
from companion.control.reference_model import Array, PositionModel

OuterRecord = MpcRecord | PidTerms
"""Why the position reference r2 is what it is."""

_NOT_KNOWN = np.full(3, np.nan)
_NOT_KNOWN.setflags(write=False)


def _not_known() -> Array:
    return _NOT_KNOWN


# InnerRecord and AdaptationMean are made at every tick, and frozen
# they take several times as long to make: change none.
@dataclass(slots=True)
class InnerRecord:
    """Why u is what it is; each array is (axes,), NaN where a controller has no such thing."""

    u: Array
    r1_m_s: Array
    """Velocity reference."""
    y_tilde_m_s: Array
    """ỹ: error of the output predictor."""
    sigma_hat: Array
    """σ̂, in the unit of u."""
    projecting: bool = False
    """The projection held σ̂ back on some axis."""
    y_tilde_bound_m_s: Array = field(default_factory=_not_known)
    """What |ỹ| stays below while the vehicle is what the controller was made for; NaN: unknown."""
    sigma_bound: Array = field(default_factory=_not_known)
    """What the projection holds |σ̂| below, in the unit of u; NaN where there is none."""


@dataclass(slots=True)
class AdaptationMean:
    """Where an adaptation has been of late: what it is held at when it is switched off.

    Means over about two seconds; each per axis, in the unit of u but for the velocity.
    """

    u: tuple[float, ...]
    sigma_hat: tuple[float, ...]
    velocity_m_s: tuple[float, ...]
    known_s: float = 0.0
    """How long it has been looked at."""


class OuterController(Protocol):
    """From the desired trajectory and the state to the position reference r2.

    Its memory is its own affair; whoever runs it hands it back unread.
    """

    @property
    def period_s(self) -> float:
        """Time between two runs, s; 0 for one at each sample of the state."""

    @property
    def model(self) -> PositionModel | None:
        """What the state is carried over the loop's delay by.

        None for a controller that sees the state as measured, and the reference of that time.
        """

    @property
    def preview_times_s(self) -> Array:
        """(k,) times from now at which `step` wants the desired position; the first is 0."""

    def about(self, anchor_m: Array) -> "OuterController":
        """The same controller where its bounds of position, if any, lie about a point (axes,)."""

    def start(self, r_m: Array) -> Any:  # noqa: ANN401 - its own memory
        """Memory to begin with, where the reference r (axes,) is in effect."""

    def step(
        self,
        memory: Any,  # noqa: ANN401
        position_m: Array,
        velocity_m_s: Array,
        preview_m: Array,
        dt_s: float,
    ) -> tuple[Any, Array, OuterRecord]:
        """The reference r2 (axes,) for a state and a preview (k, axes), dt_s after the last one."""


class InnerController(Protocol):
    """From the position reference r2 and the state to the control input u."""

    def start(self, position_m: Array, velocity_m_s: Array, u: Array) -> tuple[Any, Array]:
        """Memory with which u (axes,) continues without a bump, and the r2 that belongs to it."""

    def step(
        self,
        memory: Any,  # noqa: ANN401
        r2_m: Array,
        position_m: Array,
        velocity_m_s: Array,
        dt_s: float,
    ) -> tuple[Any, InnerRecord]:
        """The control input for a sample, dt_s after the last one."""

    def with_applied(self, memory: Any, applied_u: Array) -> Any:  # noqa: ANN401
        """Memory that knows what the limits after the controller left of u (axes,)."""

    def held(self, mean: AdaptationMean) -> "InnerController | None":
        """The same controller with its adaptation switched off and held at a mean.

        None for one that has none, or that cannot do without.
        """
