"""Control allocation of a quad X: from torques and thrust to the rotors' signals.

PX4's order of giving way (src/lib/control_allocation, sequential desaturation), solved in closed
form, with its normalised columns: one unit of roll or pitch torque is 1/sqrt(2) per rotor, one
unit of yaw or thrust is 1 per rotor.
"""

import math
from typing import NamedTuple

from sitl_shim.autopilot.interface import RotorCommands
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Vector3

_SHARE = math.sqrt(0.5)
_YAW_MARGIN = 0.15
"""Some yaw is kept at full thrust: the thrust gives way for it by this much."""


class Allocation(NamedTuple):
    """What the rotors are told, and what they could not be told."""

    thrusts: RotorCommands
    """Thrust of each rotor over its full thrust, 0 to 1."""
    saturated: tuple[int, int, int]
    """For roll, pitch, yaw (FLU): the sign of the torque that was cut, else 0."""


_UNSATURATED = (0, 0, 0)


def allocate(torque_flu: Vector3, thrust: float, *, airmode: bool) -> Allocation:
    """Share torques (normalised, FLU) and collective thrust among four rotors.

    Without airmode thrust is only ever lowered: at the upper end it gives way to roll and
    pitch, at the lower end roll and pitch are cut; yaw always gives way first.  With airmode
    thrust may rise too.
    """
    roll, pitch, yaw = torque_flu
    # Roll and pitch add a to rotor 2 and b to rotor 3, and take them from rotors 1 and 4.
    a, b = _SHARE * (roll + pitch), _SHARE * (roll - pitch)
    first, second = thrust - a - yaw, thrust + a - yaw
    third, fourth = thrust + b + yaw, thrust - b + yaw
    if (
        0.0 <= first <= 1.0
        and 0.0 <= second <= 1.0
        and 0.0 <= third <= 1.0
        and 0.0 <= fourth <= 1.0
    ):
        return Allocation((first, second, third, fourth), _UNSATURATED)

    thrust, scale = _fit_roll_and_pitch(thrust, max(abs(a), abs(b)), airmode=airmode)
    a, b = scale * a, scale * b
    ccw = (thrust - a, thrust + a)  # yaw (FLU) takes from these two and gives to the others
    cw = (thrust + b, thrust - b)
    yaw_given = _fit_yaw(yaw, ccw, cw)
    excess = max(0.0, max(ccw) - yaw_given - 1.0, max(cw) + yaw_given - 1.0)
    cut_tilt = scale < 1.0 - 1e-9
    return Allocation(
        (
            _within(ccw[0] - yaw_given - excess),
            _within(ccw[1] - yaw_given - excess),
            _within(cw[0] + yaw_given - excess),
            _within(cw[1] + yaw_given - excess),
        ),
        (
            _sign(roll) if cut_tilt else 0,
            _sign(pitch) if cut_tilt else 0,
            _sign(yaw) if abs(yaw_given) < abs(yaw) - 1e-9 else 0,
        ),
    )


def _fit_roll_and_pitch(thrust: float, most: float, *, airmode: bool) -> tuple[float, float]:
    """Thrust and the share of roll and pitch that fit together.

    Args:
        thrust: collective, asked for.
        most: the largest change of a rotor that roll and pitch ask for, to either side.
        airmode: whether thrust may rise.
    """
    scale = min(1.0, 0.5 / most) if most > 0.0 else 1.0
    thrust = min(thrust, 1.0 - scale * most)
    if thrust < scale * most:
        if airmode:
            thrust = scale * most
        else:
            scale = max(0.0, thrust) / most
    return thrust, scale


def _fit_yaw(yaw: float, ccw: tuple[float, float], cw: tuple[float, float]) -> float:
    """The yaw torque that fits once roll and pitch are in: none of it is taken from them."""
    rising, falling = (cw, ccw) if yaw > 0.0 else (ccw, cw)
    highest, lowest = max(rising), min(falling)
    room = min(lowest, 1.0 + _YAW_MARGIN - highest, 0.5 * (1.0 - (highest - lowest)))
    return math.copysign(min(abs(yaw), max(0.0, room)), yaw)


def _within(value: float) -> float:
    """Rounding may have gone past the ends."""
    return 0.0 if value < 0.0 else 1.0 if value > 1.0 else value


def _sign(value: float) -> int:
    return 0 if value == 0.0 else 1 if value > 0.0 else -1


class ThrustCurve:
    """Signal of a rotor for its thrust: the inverse of f u^2 + (1 - f) u (THR_MDL_FAC)."""

    __slots__ = ("_factor",)

    def __init__(self, parameters: ParameterStore) -> None:
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read the factor anew."""
        self._factor = parameters["THR_MDL_FAC"]

    def signals(self, thrusts: RotorCommands) -> RotorCommands:
        """Signals, 0 to 1, for thrusts over full thrust, 0 to 1."""
        factor = self._factor
        if factor <= 0.0:
            return thrusts
        a, b, c, d = thrusts
        return (_signal(a, factor), _signal(b, factor), _signal(c, factor), _signal(d, factor))


def _signal(thrust: float, factor: float) -> float:
    """Positive root of f u^2 + (1 - f) u = thrust, written so that a small f does no harm."""
    if thrust <= 0.0:
        return 0.0
    linear = 1.0 - factor
    return 2.0 * thrust / (linear + math.sqrt(linear * linear + 4.0 * factor * thrust))
