"""Vehicles whose attitude answers later or sooner by a factor, under either autopilot.

The lag of an attitude is by how much a slow motion of it comes late: of a second-order response
``2 ζ / ωn`` and its dead time.  Where a proportional law on the angle stands over a rate loop with
an integral, it is the inverse of that law's gain, whatever the rate loop does.

- `attitude_lag` changes that gain alone: the lag has the factor, natural frequency and damping its
  root, so that what lags more is better damped.
- `slower_attitude` stretches the whole response in time: natural frequency falls by the factor and
  damping stays.  In a time that runs slower by ``f`` a torque must be ``f²`` times less, and a rate
  ``f`` times: the gain of the angle and the proportional gain of the rates go with ``1/f``, their
  integral gain with ``1/f²``; the derivative gain, which acts like inertia, stays; a filter of the
  rates' target has its cut-off at ``1/f``.  This asks more of a controller than the lag alone.

Where ArduPilot shapes the attitude that is asked for and feeds its rate forward, the lag is mostly
that of the shaping, whose time constant changes with it: 1.2 times as much for the lag alone, where
the rate loop's part of it stays (measured on `arducopter`).
"""

from collections.abc import Mapping
from dataclasses import dataclass

from companion.experiments.perturbed_plant import Change, PlantFile

_SHAPED, _SHAPING_S = "ATC_RATE_FF_ENAB", "ATC_INPUT_TC"
_DEFAULT_SHAPING_S = 0.15
_SHAPING_PER_LAG = 1.2


@dataclass(frozen=True, slots=True)
class _Loops:
    """The parameters of an autopilot's roll and pitch loops, by their names without the axis."""

    section: str
    """Of the plant file."""
    axes: tuple[str, str]
    angle: Mapping[str, float]
    """The angle's gain, with the autopilot's default."""
    rates: Mapping[str, tuple[float, int]]
    """Of the rate loop: default, and how often it is divided by the factor."""

    def divide(self, plant: PlantFile, factor: float, *, rates: bool) -> None:
        """Divide the angle's gain, and those of the rates if asked, of both axes."""
        stated = plant.setdefault(self.section, {})
        powers = {name: (default, 1) for name, default in self.angle.items()}
        for pattern, (default, power) in (powers | (dict(self.rates) if rates else {})).items():
            for axis in self.axes:
                name = pattern.format(axis)
                stated[name] = stated.get(name, default) / factor**power


_PX4 = _Loops(
    "autopilot_parameters",
    ("ROLL", "PITCH"),
    {"MC_{}_P": 4.0},
    {"MC_{}RATE_P": (0.15, 1), "MC_{}RATE_I": (0.2, 2)},
)
_ARDUPILOT = _Loops(
    "ardupilot_parameters",
    ("RLL", "PIT"),
    {"ATC_ANG_{}_P": 4.5},
    {"ATC_RAT_{}_P": (0.135, 1), "ATC_RAT_{}_I": (0.135, 2), "ATC_RAT_{}_FLTT": (20.0, 1)},
)


def attitude_lag(factor: float) -> Change:
    """Gives the attitude another lag.

    Args:
        factor: on the lag: 1.25 for a quarter more.
    """
    return lambda plant: _change(plant, factor, rates=False)


def slower_attitude(factor: float) -> Change:
    """Stretches the attitude's whole response in time.

    Args:
        factor: on the time that it takes: 1.25 for a quarter more.
    """
    return lambda plant: _change(plant, factor, rates=True)


def _change(plant: PlantFile, factor: float, *, rates: bool) -> None:
    for loops in (_PX4, _ARDUPILOT):
        loops.divide(plant, factor, rates=rates)
    stated = plant[_ARDUPILOT.section]
    if stated.get(_SHAPED, 1) != 0:
        share = 1.0 if rates else _SHAPING_PER_LAG
        shaping_s = stated.get(_SHAPING_S, _DEFAULT_SHAPING_S)
        stated[_SHAPING_S] = shaping_s * (1.0 + share * (factor - 1.0))
