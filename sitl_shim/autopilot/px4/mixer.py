"""Control allocation of a quad X: from torques and thrust to the rotors' signals.

PX4's sequential desaturation (src/lib/control_allocation), with its normalised columns: one
unit of roll or pitch torque is 1/sqrt(2) per rotor, one unit of yaw or thrust is 1 per rotor.
"""

import math
from dataclasses import dataclass

from sitl_shim.autopilot.interface import RotorCommands
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Vector3

_SHARE = math.sqrt(0.5)
_ROLL: RotorCommands = (-_SHARE, _SHARE, _SHARE, -_SHARE)
_PITCH: RotorCommands = (-_SHARE, _SHARE, -_SHARE, _SHARE)
_YAW: RotorCommands = (-1.0, -1.0, 1.0, 1.0)
_THRUST: RotorCommands = (1.0, 1.0, 1.0, 1.0)
_YAW_MARGIN = 0.15
"""Some yaw is kept at full thrust: the thrust gives way for it by this much."""


@dataclass(frozen=True, slots=True)
class Allocation:
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
    a, b = _SHARE * (roll + pitch), _SHARE * (roll - pitch)
    first, second, third, fourth = (
        thrust - a - yaw,
        thrust + a - yaw,
        thrust + b + yaw,
        thrust - b + yaw,
    )
    if (
        0.0 <= first <= 1.0
        and 0.0 <= second <= 1.0
        and 0.0 <= third <= 1.0
        and 0.0 <= fourth <= 1.0
    ):
        return Allocation((first, second, third, fourth), _UNSATURATED)

    rotors = [thrust - a, thrust + a, thrust + b, thrust - b]
    _desaturate(rotors, _THRUST, only_lower=not airmode)
    if not airmode:
        roll += _desaturate(rotors, _ROLL)
        pitch += _desaturate(rotors, _PITCH)
    for i in range(4):
        rotors[i] += _YAW[i] * yaw
    yaw += _desaturate(rotors, _YAW, upper=1.0 + _YAW_MARGIN)
    _desaturate(rotors, _THRUST, only_lower=True)
    first, second, third, fourth = (min(1.0, max(0.0, value)) for value in rotors)
    given = (
        (second + third - first - fourth) * _SHARE / 2.0,
        (second + fourth - first - third) * _SHARE / 2.0,
        (third + fourth - first - second) / 4.0,
    )
    return Allocation(
        (first, second, third, fourth),
        (
            _cut(torque_flu[0], given[0]),
            _cut(torque_flu[1], given[1]),
            _cut(torque_flu[2], given[2]),
        ),
    )


def _cut(asked: float, given: float) -> int:
    missing = asked - given
    return 0 if abs(missing) < 1e-6 else 1 if missing > 0.0 else -1


def _desaturate(
    rotors: list[float], column: RotorCommands, *, upper: float = 1.0, only_lower: bool = False
) -> float:
    """Shift ``rotors`` along ``column`` so that the saturation shrinks; returns the shift."""
    first = _shift(rotors, column, upper)
    if only_lower and first > 0.0:
        return 0.0
    for i in range(4):
        rotors[i] += first * column[i]
    # Half of the second shift: where both ends saturate, it finds the middle.
    second = 0.5 * _shift(rotors, column, upper)
    for i in range(4):
        rotors[i] += second * column[i]
    return first + second


def _shift(rotors: list[float], column: RotorCommands, upper: float) -> float:
    most = least = 0.0
    for value, gain in zip(rotors, column, strict=True):
        if value < 0.0:
            need = -value / gain
        elif value > upper:
            need = (upper - value) / gain
        else:
            continue
        most = max(most, need)
        least = min(least, need)
    return most + least


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
        linear = 1.0 - factor
        square, four, half = linear * linear, 4.0 * factor, 0.5 / factor
        a, b, c, d = thrusts
        return (
            (math.sqrt(square + four * a) - linear) * half,
            (math.sqrt(square + four * b) - linear) * half,
            (math.sqrt(square + four * c) - linear) * half,
            (math.sqrt(square + four * d) - linear) * half,
        )
