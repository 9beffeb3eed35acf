"""The plants that recommended gains must do well on: a vehicle's axis, and what it may be instead.

An identified vehicle is flown with another battery, in other air, with another payload, and its
identification has an error of its own.  So gains are judged on a family of plants about the
identified one: more and less lag, more delay than anybody knows of, more and less gain, more drag
and a gust.
"""

import math
from dataclasses import dataclass, replace

from companion.config.models import DynamicsConfig, ResponseConfig
from companion.theory.plant import AxisPlant, axis_plants, second_order

MORE_DELAY_S = 0.020
GAIN_SHARE = 0.15
MORE_LAG, LESS_LAG = 1.25, 0.75
STABLE_DELAY_S, STABLE_DELAY_Z_S = 0.040, 0.060
"""With this much more delay a loop must still be stable, however badly it flies.  A height that
oscillates takes the horizontal axes with it, and over the companion's own loop z has room."""
GAMMA_SHARE, GAMMA_SHARE_SHAPED = 0.8, 0.65
"""Of Γ, with which the loop must still be stable: Γ is that much above its lower bound.  The second
where an autopilot shapes its commands: the adaptation mode is where the plant is known worst."""
STABLE_LAG, STABLE_LAG_SHAPED = 0.65, 0.6
"""Of the attitude's lag, with which x and y must still be stable: with less lag the adaptation mode
comes to its limit.  The second where an autopilot shapes its commands: it answers to small ones
quicker than to the steps of an identification."""
_LEAST_DAMPING = 0.05
GUST_M_S2 = 1.2
"""Peak of the acceleration by gusts, as in the jet of a fan."""
GUST_M_S = 0.2
"""Peak of what gusts add to the climb rate, the loop below at rest."""

TYPICAL_CLIMB_RATE_LOOP = ResponseConfig(natural_frequency_rad_s=3.75, damping=0.605, delay_s=0.075)
"""ArduCopter's own climb-rate loop with its default gains, fitted to a step of 0.5 m/s (10 % after
209 ms, 63 % after 509 ms, 10 % of overshoot)."""


@dataclass(frozen=True, slots=True)
class Member:
    """A plant of the family, and what it counts for."""

    name: str
    plant: AxisPlant
    push: tuple[float, ...]
    """Numerator, over the plant's denominator, through which a disturbance comes to the velocity:
    an acceleration for x and y, and for z what adds to the climb-rate command."""
    weight: float
    """Of its tracking error; 0: it must be stable, and no more."""
    gain: float = 1.0
    more_delay_s: float = 0.0
    """Delay on top of the plant's own, of which the controller does not know."""
    gust: float = 0.0
    """Peak of gusts that come by, in the unit of what they add to."""
    bounded: bool = False
    """An error much larger than the nominal plant's counts many times."""
    gamma_share: float = 1.0
    """Of the candidate's Γ: below its least stable value the estimate lags too far behind."""
    held: bool = False
    """The position reference rests, as under a fallback; there is no MPC."""


def horizontal_family(
    dynamics: DynamicsConfig, *, shaped_commands: bool = False
) -> tuple[Member, ...]:
    """The plants of x or y, the nominal one first.

    Args:
        dynamics: of the vehicle.
        shaped_commands: whether its autopilot shapes the commanded attitude, as ArduCopter does.
    """
    share, quickest = GAMMA_SHARE, STABLE_LAG
    if shaped_commands:
        share, quickest = GAMMA_SHARE_SHAPED, STABLE_LAG_SHAPED
    quick = _horizontal("quickest", dynamics, 0.0, _gain_lag(dynamics.attitude, quickest))
    gain = dynamics.tilt_gain
    nominal = replace(_horizontal("nominal", dynamics, 4.0, dynamics.attitude), bounded=False)
    return (
        nominal,
        _horizontal("lag +25 %", dynamics, 0.6, _gain_lag(dynamics.attitude, MORE_LAG)),
        _horizontal("lag -25 %", dynamics, 0.6, _gain_lag(dynamics.attitude, LESS_LAG)),
        _horizontal("slower by 25 %", dynamics, 0.6, _slower(dynamics.attitude, MORE_LAG)),
        replace(nominal, name="delay +20 ms", weight=1.0, more_delay_s=MORE_DELAY_S, bounded=True),
        replace(nominal, name="gain +15 %", weight=0.5, gain=gain * (1 + GAIN_SHARE), bounded=True),
        replace(nominal, name="gain -15 %", weight=0.5, gain=gain * (1 - GAIN_SHARE), bounded=True),
        _horizontal("drag × 2", dynamics, 0.3, dynamics.attitude, drag=2.0),
        replace(nominal, name="gusts", weight=1.2, gust=GUST_M_S2),
        replace(
            nominal,
            name=f"delay +{STABLE_DELAY_S * 1e3:.0f} ms",
            weight=0.0,
            more_delay_s=STABLE_DELAY_S,
        ),
        replace(quick, name=f"lag {quickest - 1.0:.0%}", bounded=False),
        *_only_stable(nominal, share),
    )


def vertical_family(
    climb: ResponseConfig, loop_delay_s: float, *, autopilots: bool
) -> tuple[Member, ...]:
    """The plants of z over a climb loop, the nominal one first.

    Args:
        climb: climb-rate command to climb rate.
        loop_delay_s: of the loop.
        autopilots: whether the climb loop is the autopilot's own, and not the companion's.
    """
    nominal = _vertical("nominal", climb, loop_delay_s, 4.0)
    slow, quick = _gain_lag(climb, MORE_LAG), _gain_lag(climb, LESS_LAG)

    def later(name: str, more_s: float, weight: float) -> Member:
        # The companion's own loop is closed over the delay, too, and swings more with it.
        inner = climb if autopilots else _closed_later(climb, more_s)
        member = _vertical(name, inner, loop_delay_s, weight)
        return replace(member, more_delay_s=more_s, bounded=weight > 0.0)

    stable_s = STABLE_DELAY_S if autopilots else STABLE_DELAY_Z_S
    return (
        nominal,
        replace(_vertical("lag +25 %", slow, loop_delay_s, 0.6), bounded=True),
        replace(_vertical("lag -25 %", quick, loop_delay_s, 0.6), bounded=True),
        replace(
            _vertical("slower by 25 %", _slower(climb, MORE_LAG), loop_delay_s, 0.6), bounded=True
        ),
        later("delay +20 ms", MORE_DELAY_S, 1.0),
        replace(nominal, name="gain +15 %", weight=0.5, gain=1 + GAIN_SHARE, bounded=True),
        replace(nominal, name="gain -15 %", weight=0.5, gain=1 - GAIN_SHARE, bounded=True),
        replace(nominal, name="gusts", weight=1.2, gust=GUST_M_S),
        later(f"delay +{stable_s * 1e3:.0f} ms", stable_s, 0.0),
        *_only_stable(nominal, GAMMA_SHARE),
    )


def _only_stable(nominal: Member, gamma_share: float) -> tuple[Member, ...]:
    """Loops with less Γ, of which nothing is asked but to be stable."""
    bare = replace(nominal, weight=0.0, gamma_share=gamma_share)
    return (
        replace(bare, name="less Γ"),
        replace(bare, name="less Γ, reference held", held=True),
    )


def _horizontal(
    name: str,
    dynamics: DynamicsConfig,
    weight: float,
    attitude: ResponseConfig,
    drag: float = 1.0,
) -> Member:
    drag_1_s = dynamics.linear_drag_1_s * drag
    changed = dynamics.model_copy(update={"attitude": attitude, "linear_drag_1_s": drag_1_s})
    push = second_order(attitude).denominator
    return Member(name, axis_plants(changed)[0], push, weight, dynamics.tilt_gain, bounded=True)


def _vertical(name: str, climb: ResponseConfig, loop_delay_s: float, weight: float) -> Member:
    answer = second_order(climb)
    return Member(name, AxisPlant(answer, loop_delay_s + climb.delay_s), answer.numerator, weight)


def _slower(response: ResponseConfig, factor: float) -> ResponseConfig:
    """All of it slower."""
    return response.model_copy(
        update={"natural_frequency_rad_s": response.natural_frequency_rad_s / factor}
    )


def _gain_lag(response: ResponseConfig, factor: float) -> ResponseConfig:
    """More lag by the gain of the angle's loop alone: slower and better damped."""
    root = math.sqrt(factor)
    return response.model_copy(
        update={
            "natural_frequency_rad_s": response.natural_frequency_rad_s / root,
            "damping": response.damping * root,
        }
    )


def _closed_later(climb: ResponseConfig, more_s: float) -> ResponseConfig:
    """A climb loop of the companion's that is closed over more delay.

    ``L = ωn² / (s² + 2 ζ ωn s)`` is what closes to the response; with ``e^{-sD}`` to second order
    the characteristic polynomial is ``(1 + ωn² D² / 2) s² + (2 ζ ωn - ωn² D) s + ωn²``.
    """
    stiffness = climb.natural_frequency_rad_s**2
    inertia = 1.0 + 0.5 * stiffness * more_s**2
    damping = 2.0 * climb.damping * climb.natural_frequency_rad_s - stiffness * more_s
    omega = math.sqrt(stiffness / inertia)
    return climb.model_copy(
        update={
            "natural_frequency_rad_s": omega,
            "damping": max(_LEAST_DAMPING, 0.5 * damping / (inertia * omega)),
        }
    )
