"""The outer controllers without a preview: PID-L1, LQR-L1, and r2 given directly (`l1`)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from companion.control import pid
from companion.control.pid import PidGains, PidMemory, PidTerms
from companion.control.reference_model import Array, PositionModel

_NOW = np.zeros(1)


@dataclass(frozen=True, slots=True)
class FeedbackMemory:
    """What the controller carries from run to run."""

    pid: PidMemory
    desired_m: Array | None = None
    """(axes,) y2* of the last run; None before the first."""


@dataclass(frozen=True, slots=True)
class FeedbackController:
    """``r2 = y2* + PID(y2* - y2)`` from the state as measured and the y2* of that time."""

    gains: PidGains
    period_s: float = 0.0
    derivative: Literal["measurement", "error"] = "measurement"
    """What D acts on: -y1, or the error, whose derivative contains that of y2*."""

    @property
    def model(self) -> PositionModel | None:
        """None: the state is not carried over the delay."""
        return None

    @property
    def preview_times_s(self) -> Array:
        """Now, and nothing of the future."""
        return _NOW

    def about(self, anchor_m: Array) -> "FeedbackController":
        """Itself: it bounds no position."""
        return self

    def start(self, r_m: Array) -> FeedbackMemory:
        """Memory with an empty integral."""
        return FeedbackMemory(pid.start(np.zeros_like(r_m)))

    def step(
        self,
        memory: FeedbackMemory,
        position_m: Array,
        velocity_m_s: Array,
        preview_m: Array,
        dt_s: float,
    ) -> tuple[FeedbackMemory, Array, PidTerms]:
        """The reference r2 (axes,); preview_m (1, axes) is the present y2*."""
        desired = preview_m[0]
        rate = velocity_m_s
        if self.derivative == "error" and memory.desired_m is not None and dt_s > 0.0:
            rate = velocity_m_s - (desired - memory.desired_m) / dt_s
        advanced, correction, terms = pid.step(
            self.gains, memory.pid, desired - position_m, rate, dt_s
        )
        return FeedbackMemory(advanced, desired), desired + correction, terms


def direct(axes: int) -> FeedbackController:
    """The controller that gives r2 = y2*."""
    nothing = (0.0,) * axes
    return FeedbackController(PidGains(nothing, nothing, nothing, nothing))
