"""Gains of `mpc-l1` for a vehicle, from its dynamics and the noise of its state, by one method.

Of x and y first: m, ω, K, Γ and N_h that are worth most on a family of plants about the vehicle
(`recommend_plants`, `recommend_score`, `recommend_search`).  The horizon is the MPC's, so that z is
searched with it: once over the vehicle's own climb loop, and once over an autopilot's.  The bounds
follow from the vehicle's limits and from what the noise makes of σ̂ and of r.

docs/recommended-gains.md tells the method with its reasons.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version

from companion.config.models import (
    ClimbRateGains,
    ControllerConfig,
    L1Config,
    MpcConfig,
    NoiseConfig,
    ResponseConfig,
    ThrustConfig,
    VehicleConfig,
)
from companion.control.qp.condensed import Weights
from companion.control.thrust import GRAVITY_M_S2
from companion.control.transfer_function import TransferFunction, first_order
from companion.identification.recommend_loop import AxisNoise, LoopBuilder, Rates
from companion.identification.recommend_plants import (
    TYPICAL_CLIMB_RATE_LOOP,
    horizontal_family,
    vertical_family,
)
from companion.identification.recommend_plus import lag_s
from companion.identification.recommend_score import HORIZONTAL, VERTICAL, Scorer
from companion.identification.recommend_search import Space, search
from companion.theory.envelope import Air, ThrustLoop, horizontal_bounds, vertical_bounds

PERIOD_S = 0.03
"""Of the MPC, about: the paper's.  What matters is the horizon in seconds, from 25 to 200 Hz."""
ASSUMED_NOISE = NoiseConfig(
    position_m=(0.001, 0.001, 0.001),
    velocity_m_s=(0.015, 0.015, 0.015),
    acceleration_m_s2_sqrt_hz=(0.01, 0.01, 0.01),
    tilt_rad=0.001,
)
"""Of a motion-capture system in a room: where nothing is known of a vehicle's own."""
_SIGMAS = 4.0
_R_MAX_ROOM = 2.0
_LONGEST_HORIZON_S = 2.0
_K_TIMES_LAG = (0.06, 0.4)
_LEAST_R_MAX_M_S2 = 1000.0
"""A bound that acts delays the MPC; one that does not costs nothing."""


@dataclass(frozen=True, slots=True)
class AxisGains:
    """Of one axis, and what they are worth."""

    m: float
    omega: float
    k: float
    gamma: float
    sigma_bound: float
    horizon: int
    r_max_m_s2: float
    """Bound of the second difference of r: what trajectories and noise ask for, with room."""
    errors_mm: tuple[tuple[str, float], ...]
    """Mean tracking error of the linear model, by plant of the family."""


@dataclass(frozen=True, slots=True)
class Recommendation:
    """Gains of `mpc-l1` for a vehicle."""

    controller: ControllerConfig
    horizontal: AxisGains
    vertical: AxisGains
    climb_rate: AxisGains
    """Over an autopilot's own climb-rate loop."""


def recommend(
    vehicle: VehicleConfig,
    *,
    climb_rate_field: bool = False,
    shaped_commands: bool = False,
    state_rate_hz: float = 100.0,
    generations: int = 60,
    progress: Callable[[int, int], None] | None = None,
) -> Recommendation:
    """Derive gains of `mpc-l1`; deterministic, of the order of half a minute.

    Args:
        vehicle: with its dynamics; its noise is taken as that of a motion-capture system where it
            states none.
        climb_rate_field: whether its `dynamics.climb` is of the autopilot's own climb-rate loop,
            and not of the companion's thrust loop.
        shaped_commands: whether the autopilot shapes the commanded attitude, as ArduCopter does.
        state_rate_hz: of the state's samples.
        generations: of each search.
        progress: told how many generations of all searches are done, and of how many.

    Raises:
        ValueError: the vehicle states no dynamics.
        NothingHoldsError: no gains hold on every plant of the family.
    """
    dynamics = vehicle.dynamics
    if dynamics is None:
        raise ValueError(f"the vehicle '{vehicle.name}' states no dynamics to derive gains from")
    noise = vehicle.noise or ASSUMED_NOISE
    sample_s = 1.0 / state_rate_hz
    per_plan = max(1, round(PERIOD_S / sample_s))
    mpc = MpcConfig(period_s=per_plan * sample_s)
    weights = Weights(mpc.q, mpc.r, mpc.s)
    rates = Rates(sample_s, per_plan, dynamics.loop_delay_s, weights)
    longest = math.ceil(_LONGEST_HORIZON_S / rates.period_s)
    thrust = ThrustConfig()

    attitude_lag_s = lag_s(dynamics.attitude, dynamics.loop_delay_s)
    scale = GRAVITY_M_S2 * dynamics.tilt_gain * attitude_lag_s
    searches = 2 if climb_rate_field else 3

    def counted(before: int) -> Callable[[int], None] | None:
        """Tells how far the search is that comes after `before` others."""
        if progress is None:
            return None
        return lambda done: progress(before * generations + done, searches * generations)

    horizontal = _searched(
        Scorer(
            LoopBuilder(
                horizontal_family(dynamics, shaped_commands=shaped_commands),
                rates,
                _horizontal_noise(noise),
            ),
            HORIZONTAL,
            longest,
            math.sin(math.radians(vehicle.tilt_limit_deg)),
        ),
        Space(
            k=(_K_TIMES_LAG[0] / attitude_lag_s, _K_TIMES_LAG[1] / attitude_lag_s),
            damping=(0.3, 0.9),
            omega_over_m=(0.3 / scale, 1.4 / scale),
            gamma=(100.0, 2000.0),
            horizon_s=(0.7, _LONGEST_HORIZON_S),
            generations=generations,
        ),
        lambda m, omega: horizontal_bounds(vehicle, dynamics, Air(), m, omega, 0.0).sigma,
        counted(0),
    )

    def over(climb: ResponseConfig, *, autopilots: bool, before: int) -> AxisGains:
        family = vertical_family(climb, dynamics.loop_delay_s, autopilots=autopilots)
        climb_lag_s = lag_s(climb, dynamics.loop_delay_s)
        stated = dynamics.model_copy(update={"climb": climb})
        loop = ThrustLoop(thrust.proportional, thrust.maximum_acceleration_m_s2)
        return _searched(
            Scorer(
                LoopBuilder(family, rates, _vertical_noise(noise, thrust)),
                VERTICAL,
                longest,
                min(vehicle.climb_limit_m_s, vehicle.descent_limit_m_s),
            ),
            Space(
                k=(_K_TIMES_LAG[0] / climb_lag_s, _K_TIMES_LAG[1] / climb_lag_s),
                damping=(0.5, 1.6),
                omega_over_m=(0.3, 1.6),
                gamma=(100.0, 2000.0),
                horizon_s=None,
                horizon=horizontal.horizon,
                generations=generations,
            ),
            lambda m, omega: vertical_bounds(vehicle, stated, Air(), loop, m, omega, 0.0).sigma,
            counted(before),
        )

    theirs = dynamics.climb if climb_rate_field else TYPICAL_CLIMB_RATE_LOOP
    climb_rate = over(theirs, autopilots=True, before=1)
    vertical = climb_rate
    if not climb_rate_field:
        vertical = over(dynamics.climb, autopilots=False, before=2)
    if progress is not None:
        progress(searches * generations, searches * generations)
    controller = ControllerConfig(
        framework="mpc-l1",
        source=method_source(vehicle),
        l1=_l1(horizontal, vertical, None if climb_rate_field else climb_rate),
        mpc=mpc.model_copy(
            update={
                "horizon": horizontal.horizon,
                "r_max_m_s2": max(x.r_max_m_s2 for x in (horizontal, vertical, climb_rate)),
            }
        ),
    )
    return Recommendation(controller, horizontal, vertical, climb_rate)


def _searched(
    scorer: Scorer,
    space: Space,
    largest_sigma: Callable[[TransferFunction, TransferFunction], float],
    progress: Callable[[int], None] | None = None,
) -> AxisGains:
    """Search an axis, and take the bounds that go with what was found.

    Args:
        scorer: of its family.
        space: where to search.
        largest_sigma: bound of |σ| by M(s) and C(s), without noise.
        progress: as of `search`.
    """
    found = search(scorer, space, progress)
    best = found.candidate
    m, omega = float(best.m[0]), float(best.omega[0])
    sigma = largest_sigma(first_order(m), first_order(omega))
    sigma += _SIGMAS * scorer.noise_of_sigma(best)
    free = math.sqrt(1.0 + L1Config.model_fields["projection_margin"].default)
    planned = scorer.largest_second_difference_m_s2(best, _SIGMAS)
    names = [member.name for member in scorer.family]
    return AxisGains(
        m=m,
        omega=omega,
        k=float(best.k[0]),
        gamma=float(best.gamma[0]),
        sigma_bound=float(math.ceil(sigma * free)),
        horizon=best.horizon[0],
        r_max_m_s2=max(_LEAST_R_MAX_M_S2, 100.0 * math.ceil(_R_MAX_ROOM * planned / 100.0)),
        errors_mm=tuple(
            (name, float(error))
            for name, error in zip(names, found.scores.errors_mm[:, 0], strict=True)
            if math.isfinite(error)
        ),
    )


def _l1(horizontal: AxisGains, z: AxisGains, climb_rate: AxisGains | None) -> L1Config:
    x = horizontal
    return L1Config(
        m=(x.m, x.m, z.m),
        omega=(x.omega, x.omega, z.omega),
        k=(x.k, x.k, z.k),
        gamma=(x.gamma, x.gamma, z.gamma),
        sigma_bound=(x.sigma_bound, x.sigma_bound, z.sigma_bound),
        climb_rate=None
        if climb_rate is None
        else ClimbRateGains(
            m=climb_rate.m,
            omega=climb_rate.omega,
            k=climb_rate.k,
            gamma=climb_rate.gamma,
            sigma_bound=climb_rate.sigma_bound,
        ),
    )


def _horizontal_noise(noise: NoiseConfig) -> AxisNoise:
    """The worse of x and y: one set of gains flies both."""
    return AxisNoise(
        max(noise.position_m[:2]),
        max(noise.velocity_m_s[:2]),
        max(noise.acceleration_m_s2_sqrt_hz[:2]),
    )


def _vertical_noise(noise: NoiseConfig, thrust: ThrustConfig) -> AxisNoise:
    """An acceleration comes to the climb rate over the thrust loop's gain."""
    return AxisNoise(
        noise.position_m[2],
        noise.velocity_m_s[2],
        noise.acceleration_m_s2_sqrt_hz[2] / thrust.proportional,
    )


def method_source(vehicle: VehicleConfig) -> str:
    """What the files say of where their numbers come from."""
    return (
        f"companion {version('companion')}, the method of docs/recommended-gains.md on the "
        f"dynamics of {vehicle.name}."
    )
