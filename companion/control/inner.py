"""The inner controllers: from the position reference r2 to the control input u."""

from dataclasses import dataclass

import numpy as np

from companion.control import l1_adaptive, pid
from companion.control.interfaces import InnerRecord
from companion.control.l1_adaptive import L1Gains, L1Memory
from companion.control.pid import PidGains, PidMemory
from companion.control.reference_model import Array


@dataclass(frozen=True, slots=True)
class L1Controller:
    """The extended L1 adaptive controller of the paper."""

    gains: L1Gains

    def start(self, position_m: Array, velocity_m_s: Array, u: Array) -> tuple[L1Memory, Array]:
        """Memory without a bump; its r2 asks for the velocity that the vehicle has."""
        r2 = position_m + velocity_m_s / np.array(self.gains.gain_k)
        return l1_adaptive.start(self.gains, velocity_m_s, u), r2

    def step(
        self, memory: L1Memory, r2_m: Array, position_m: Array, velocity_m_s: Array, dt_s: float
    ) -> tuple[L1Memory, InnerRecord]:
        """See `l1_adaptive.step`."""
        memory, record = l1_adaptive.step(self.gains, memory, r2_m, position_m, velocity_m_s, dt_s)
        return memory, InnerRecord(
            record.u, record.r1_m_s, record.y_tilde_m_s, record.sigma_hat, record.projecting
        )

    def with_applied(self, memory: L1Memory, applied_u: Array) -> L1Memory:
        """See `l1_adaptive.with_applied`."""
        return l1_adaptive.with_applied(self.gains, memory, applied_u)


@dataclass(frozen=True, slots=True)
class PidController:
    """``u = PID(r2 - y2)``: the paper's non-adaptive inner controller."""

    gains: PidGains

    def start(self, position_m: Array, velocity_m_s: Array, u: Array) -> tuple[PidMemory, Array]:
        """Memory without a bump: the integral holds what the derivative does not."""
        return pid.start(u + np.asarray(self.gains.kd) * velocity_m_s), np.array(position_m)

    def step(
        self, memory: PidMemory, r2_m: Array, position_m: Array, velocity_m_s: Array, dt_s: float
    ) -> tuple[PidMemory, InnerRecord]:
        """See `pid.step`."""
        memory, u, _ = pid.step(self.gains, memory, r2_m - position_m, velocity_m_s, dt_s)
        nothing = np.full_like(u, np.nan)
        return memory, InnerRecord(u, nothing, nothing, nothing)

    def with_applied(self, memory: PidMemory, applied_u: Array) -> PidMemory:
        """See `pid.with_applied`."""
        return pid.with_applied(memory, applied_u)
