"""The inner controllers: from the position reference r2 to the control input u."""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from companion.control import l1_adaptive, pid
from companion.control.interfaces import AdaptationMean, InnerRecord
from companion.control.l1_adaptive import HeldEstimate, L1Gains, L1Memory
from companion.control.pid import PidGains, PidMemory
from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2

_HORIZONTAL = (0, 1)
_WANDER_DEVIATIONS = 3.0
_NOISE_DEVIATIONS = 6.0
"""Of the velocity's noise in the bound of ỹ: 3, of an ỹ that has up to twice that noise in it."""


@dataclass(frozen=True, slots=True)
class L1Controller:
    """The extended L1 adaptive controller of the paper."""

    gains: L1Gains
    y_tilde_bound_m_s: tuple[float, ...] | None = None
    """For the records; see `y_tilde_bounds_m_s`."""
    estimate: HeldEstimate | None = None
    """Held in place of σ̂; None while the law adapts."""
    _bounds: tuple[Array, Array] = field(init=False, repr=False, compare=False)
    """Of |ỹ| and |σ̂|, for the records."""

    def __post_init__(self) -> None:
        """Make arrays of what every record says."""
        sigma = np.array(self.gains.sigma_bound)
        y_tilde = np.full_like(sigma, np.nan)
        if self.y_tilde_bound_m_s is not None:
            y_tilde = np.array(self.y_tilde_bound_m_s)
        for bound in (y_tilde, sigma):
            bound.setflags(write=False)
        object.__setattr__(self, "_bounds", (y_tilde, sigma))

    def start(self, position_m: Array, velocity_m_s: Array, u: Array) -> tuple[L1Memory, Array]:
        """Memory without a bump; its r2 asks for the velocity that the vehicle has."""
        r2 = position_m + velocity_m_s / np.array(self.gains.gain_k)
        return l1_adaptive.start(self.gains, velocity_m_s, u), r2

    def step(
        self, memory: L1Memory, r2_m: Array, position_m: Array, velocity_m_s: Array, dt_s: float
    ) -> tuple[L1Memory, InnerRecord]:
        """See `l1_adaptive.step`."""
        memory, record = l1_adaptive.step(
            self.gains, memory, r2_m, position_m, velocity_m_s, dt_s, self.estimate
        )
        return memory, InnerRecord(
            record.u,
            record.r1_m_s,
            record.y_tilde_m_s,
            record.sigma_hat,
            record.projecting,
            *self._bounds,
        )

    def with_applied(self, memory: L1Memory, applied_u: Array) -> L1Memory:
        """See `l1_adaptive.with_applied`."""
        return l1_adaptive.with_applied(self.gains, memory, applied_u)

    def held(self, mean: AdaptationMean) -> "L1Controller | None":
        """The same law with σ of the nominal vehicle, and the rest of σ̂ held, in place of σ̂.

        σ̂ contains the vehicle itself: with ``σ = ẏ1/m + y1 - u`` held as a whole the law would be
        ``u = C(s) (r1 - const)``, a tilt that is proportional to a position error, with no damping.
        What the law is without adaptation is M(s) matched by a model: on the horizontal axes, with
        ``ẏ1 = g u``, ``σ = y1 + (g/m - 1) u + d``, of which d, the disturbance, is held.  On the
        vertical one the vehicle is ``y1 = u`` for as long as M(s) matters, and d is σ̂ itself.

        Returns:
            None where an M(s) of the horizontal axes is not of first order.
        """
        count = len(self.gains.gain_k)
        velocity, u = np.zeros(count), np.zeros(count)
        for axis in _HORIZONTAL:
            model = self.gains.reference_model[axis]
            if model.order != 1:
                return None
            m = model.denominator[1] / model.denominator[0]
            velocity[axis], u[axis] = 1.0, GRAVITY_M_S2 / m - 1.0
        offset = np.array(mean.sigma_hat) - velocity * mean.velocity_m_s - u * mean.u
        return replace(self, estimate=HeldEstimate(offset, velocity, u))


def y_tilde_bounds_m_s(
    gains: L1Gains,
    acceleration_m_s2: float,
    speed_m_s: tuple[float, float, float],
    velocity_noise_m_s: tuple[float, float, float],
    acceleration_noise: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[float, ...]:
    """What |ỹ| stays below, per axis, while the vehicle moves as it is stated to and is itself.

    For a σ that is smooth against the mode at √(mΓ), ỹ = -σ'/Γ.  ``σ = y1 + ẏ1/m - u`` of a motion
    that reaches both the stated acceleration a and the speed v, whose jerk is then a²/v, changes by
    at most ``a + a²/(v m) + |u'|``, where u' is a²/(v g) for a tilt and a for a climb rate.  The
    noise of the velocity comes to this.

    This is what is to be expected and not the γ0 of `companion.theory`: that holds for every σ
    within the projection, and is so far from what happens that it would never tell anything.

    Args:
        gains: of the law.
        acceleration_m_s2: that is planned at most.
        speed_m_s: the same, per axis.
        velocity_noise_m_s: of the reported velocity, per axis, one standard deviation.
        acceleration_noise: density of the unexplained acceleration, m/s² per √Hz, per axis: it
            drives the predictor's mode, whose damping is m/2, to a deviation of ``n / √(2 m)``.
    """
    bounds = []
    for axis, (model, gamma, speed, noise, wander) in enumerate(
        zip(
            gains.reference_model,
            gains.gamma,
            speed_m_s,
            velocity_noise_m_s,
            acceleration_noise,
            strict=True,
        )
    ):
        jerk = acceleration_m_s2**2 / speed
        # The least of M(s)' poles stands for m where it has several.
        m = min(abs(pole) for pole in np.roots(model.denominator).tolist())
        input_rate = jerk / GRAVITY_M_S2 if axis in _HORIZONTAL else acceleration_m_s2
        sigma_rate = acceleration_m_s2 + jerk / m + input_rate
        wandering = _WANDER_DEVIATIONS * wander / math.sqrt(2.0 * m)
        bounds.append(float(sigma_rate / gamma + _NOISE_DEVIATIONS * noise + wandering))
    return tuple(bounds)


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

    def held(self, mean: AdaptationMean) -> None:
        """There is no adaptation."""
