"""Bandwidths of `mpc-l1-plus` for a vehicle: in proportion to its lags, by one rule.

A feedback can be as quick as what it acts through allows, so the bandwidths go inversely with the
lag L: the delay in all and the time constant 2 ζ/ωn of the response.  The factors are of a study
of nominal error against the error on perturbed plants and the command's slew (docs/mpc-l1-plus.md).
"""

from companion.config.models import (
    ControllerConfig,
    DynamicsConfig,
    ResponseConfig,
    VehicleConfig,
)
from companion.config.plus_models import PlusConfig, VerticalPlusConfig
from companion.identification.recommend_plants import TYPICAL_CLIMB_RATE_LOOP

_BANDWIDTH_LAGS = 1.66
_LEAST_BANDWIDTH_RAD_S, _LARGEST_BANDWIDTH_RAD_S = 2.0, 12.0
_RATE_TIME_LAGS = 0.29
_LOW_PASS_LAGS, _LARGEST_LOW_PASS_RAD_S = 3.5, 20.0
_LIFT_BANDWIDTH_LAGS, _LARGEST_LIFT_BANDWIDTH_RAD_S = 0.6, 6.0
_CLIMB_BANDWIDTH_LAGS = 1.2
_VERTICAL_RATE_TIME_S = 0.05
_SIGMA_WALK = 0.5
"""How quickly wind changes; nothing of the vehicle."""


def recommend_plus(
    vehicle: VehicleConfig, source: str, *, climb_rate_field: bool = False, fallback: str | None
) -> ControllerConfig:
    """The gains of `mpc-l1-plus`.

    Args:
        vehicle: with its dynamics.
        source: for the file.
        climb_rate_field: whether its `dynamics.climb` is of the autopilot's own climb-rate loop.
        fallback: the robust controller, as a controller's file names it.

    Raises:
        ValueError: the vehicle states no dynamics.
    """
    dynamics = vehicle.dynamics
    if dynamics is None:
        raise ValueError(f"the vehicle '{vehicle.name}' states no dynamics to derive gains from")
    return ControllerConfig(
        framework="mpc-l1-plus",
        source=source,
        plus=plus_gains(dynamics, climb_rate_field=climb_rate_field),
        fallback=fallback,
    )


def plus_gains(dynamics: DynamicsConfig, *, climb_rate_field: bool = False) -> PlusConfig:
    """The section `plus:`; arguments as for `recommend_plus`."""
    late_s = dynamics.loop_delay_s
    tilt_s = lag_s(dynamics.attitude, late_s)
    # Without a response of the thrust the tilt's lag stands for it, on the safe side.
    lift_s = tilt_s if dynamics.lift is None else lag_s(dynamics.lift, late_s)
    climb = dynamics.climb if climb_rate_field else TYPICAL_CLIMB_RATE_LOOP
    climb_s = lag_s(climb, late_s)
    across = _between(_LEAST_BANDWIDTH_RAD_S, _BANDWIDTH_LAGS / tilt_s, _LARGEST_BANDWIDTH_RAD_S)
    up = min(_LARGEST_LIFT_BANDWIDTH_RAD_S, _LIFT_BANDWIDTH_LAGS / lift_s)
    quick = _three_digits(_RATE_TIME_LAGS * tilt_s)
    low_pass = _three_digits(min(_LARGEST_LOW_PASS_RAD_S, _LOW_PASS_LAGS / tilt_s))
    return PlusConfig(
        bandwidth_rad_s=(_three_digits(across), _three_digits(across), _three_digits(up)),
        rate_time_s=(quick, quick, _VERTICAL_RATE_TIME_S),
        low_pass_rad_s=(low_pass, low_pass, low_pass),
        sigma_walk=(_SIGMA_WALK, _SIGMA_WALK, _SIGMA_WALK),
        climb_rate=VerticalPlusConfig(
            bandwidth_rad_s=_three_digits(_CLIMB_BANDWIDTH_LAGS / climb_s),
            rate_time_s=_VERTICAL_RATE_TIME_S,
            low_pass_rad_s=low_pass,
            sigma_walk=_SIGMA_WALK,
        ),
    )


def lag_s(response: ResponseConfig, loop_delay_s: float) -> float:
    """Delay in all, and the time constant 2 ζ / ωn."""
    return (
        loop_delay_s + response.delay_s + 2.0 * response.damping / response.natural_frequency_rad_s
    )


def _between(low: float, value: float, high: float) -> float:
    return max(low, min(high, value))


def _three_digits(value: float) -> float:
    return float(f"{value:.3g}")
