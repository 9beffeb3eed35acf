"""An attitude that answers slower or faster by a factor: the same response, stretched in time.

A step of attitude is answered by the angle loop over a rate loop.  In a time that runs slower by
``f`` a torque must be ``f²`` times less, and a rate ``f`` times: so the angle's gain and the
proportional gain of the rates go with ``1/f``, their integral gain with ``1/f²``, and their
derivative gain, which acts like inertia, stays; a filter of the rates' target has its cut-off at
``1/f``.  What is faster by far (motors, gyro filters) need not follow.  So natural frequency goes
with ``1/f`` and damping stays, where the angle's gain alone would have made it better damped.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from companion.experiments.perturbed_plant import Change, PlantFile


@dataclass(frozen=True, slots=True)
class _Loops:
    """The parameters of an autopilot's roll and pitch loops."""

    section: str
    """Of the plant file."""
    powers: Mapping[str, int]
    """By parameter: how often it is divided by the factor."""
    defaults: Mapping[str, float]
    """The autopilot's own values, of what a plant file does not state."""


_PX4 = _Loops(
    "autopilot_parameters",
    {
        f"MC_{axis}{gain}": power
        for axis in ("ROLL", "PITCH")
        for gain, power in (("_P", 1), ("RATE_P", 1), ("RATE_I", 2))
    },
    {
        f"MC_{axis}{gain}": value
        for axis in ("ROLL", "PITCH")
        for gain, value in (("_P", 4.0), ("RATE_P", 0.15), ("RATE_I", 0.2))
    },
)
_ARDUPILOT = _Loops(
    "ardupilot_parameters",
    {
        f"ATC_{name}": power
        for axis in ("RLL", "PIT")
        for name, power in (
            (f"ANG_{axis}_P", 1),
            (f"RAT_{axis}_P", 1),
            (f"RAT_{axis}_I", 2),
            (f"RAT_{axis}_FLTT", 1),
        )
    },
    {
        f"ATC_{name}": value
        for axis in ("RLL", "PIT")
        for name, value in (
            (f"ANG_{axis}_P", 4.5),
            (f"RAT_{axis}_P", 0.135),
            (f"RAT_{axis}_I", 0.135),
            (f"RAT_{axis}_FLTT", 20.0),
        )
    },
)


def attitude_lag(factor: float) -> Change:
    """Stretches the answer to an attitude setpoint, under either autopilot.

    Args:
        factor: on the lag: 1.25 for a quarter more.
    """

    def change(plant: PlantFile) -> None:
        for loops in (_PX4, _ARDUPILOT):
            stated = plant.setdefault(loops.section, {})
            for name, power in loops.powers.items():
                stated[name] = stated.get(name, loops.defaults[name]) / factor**power

    return change
