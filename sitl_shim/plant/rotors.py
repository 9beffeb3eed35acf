"""Four rotors: lag from command to signal, thrust and torque maps, and the sum on the body."""

from collections.abc import Callable, Sequence
from math import exp, isfinite

from sitl_shim.plant.equations import (
    Arms,
    Four,
    Lag,
    ThrustMap,
    Wrench,
    lag_signals,
    thrusts_of,
    wrench_of,
)
from sitl_shim.plant.vehicle import VehicleModel

__all__ = [
    "Four",
    "Wrench",
    "arms_of",
    "lag_of",
    "make_lag",
    "make_thrusts",
    "make_wrench",
    "sane_commands",
    "thrust_map_of",
]


def sane_commands(commands: Sequence[float]) -> Four:
    """Commands as a speed controller takes them: within [0, 1], and no motion without a command.

    NaN is PX4's way to say that a motor shall stand still (``actuator_motors.control``), and no
    speed controller turns a motor on a signal that it cannot read, so what is not finite is 0.

    Raises:
        ValueError: there are not four of them.
    """
    if len(commands) != 4:
        raise ValueError(f"four rotor commands are needed, {len(commands)} were given")
    a, b, c, d = commands
    if 0.0 <= a <= 1.0 and 0.0 <= b <= 1.0 and 0.0 <= c <= 1.0 and 0.0 <= d <= 1.0:
        return (a, b, c, d)
    first, second, third, fourth = (
        min(1.0, max(0.0, value)) if isfinite(value) else 0.0 for value in commands
    )
    return (first, second, third, fourth)


def lag_of(time_constant_s: float, step_s: float) -> Lag:
    """What a first-order lag leaves of a distance after half a step and after a whole one."""
    return (exp(-0.5 * step_s / time_constant_s), exp(-step_s / time_constant_s))


def thrust_map_of(
    vehicle: VehicleModel, thrust_scale: float, factors: Four = (1.0, 1.0, 1.0, 1.0)
) -> ThrustMap:
    """From signals to thrusts.

    Args:
        vehicle: the vehicle.
        thrust_scale: this very vehicle's thrust over its type's.
        factors: each rotor's thrust over that of a sound one.
    """
    shape = vehicle.propulsion.thrust_shape
    linear = (1.0 - shape) * vehicle.propulsion.max_thrust_n * thrust_scale
    square = shape * vehicle.propulsion.max_thrust_n * thrust_scale
    l1, l2, l3, l4 = (linear * factor for factor in factors)
    s1, s2, s3, s4 = (square * factor for factor in factors)
    return (l1, l2, l3, l4, s1, s2, s3, s4)


def arms_of(vehicle: VehicleModel) -> Arms:
    """Where the rotors are and how they turn.

    A thrust T at (x, y) gives the torque (y T, -x T); a rotor that turns counter-clockwise
    turns the body clockwise, which is negative about FLU z.
    """
    (x1, y1, _), (x2, y2, _), (x3, y3, _), (x4, y4, _) = (r.position_flu_m for r in vehicle.rotors)
    per_thrust = vehicle.propulsion.torque_per_thrust_m
    k1, k2, k3, k4 = (-per_thrust if r.spin == "ccw" else per_thrust for r in vehicle.rotors)
    return (x1, x2, x3, x4, y1, y2, y3, y4, k1, k2, k3, k4)


def make_lag(time_constant_s: float, step_s: float) -> Callable[[Four, Four], tuple[Four, Four]]:
    """The first-order lag, exact for a command held over the step.

    Returns:
        A function of signals and held targets that gives the signals after half a step and
        after a whole one.
    """
    lag = lag_of(time_constant_s, step_s)
    return lambda signals, targets: lag_signals(lag, signals, targets)


def make_thrusts(
    vehicle: VehicleModel, thrust_scale: float, factors: Four = (1.0, 1.0, 1.0, 1.0)
) -> Callable[[Four], Four]:
    """The thrust map (see `thrust_map_of`): signals to the thrust of each rotor, N."""
    thrust_map = thrust_map_of(vehicle, thrust_scale, factors)
    return lambda signals: thrusts_of(thrust_map, signals)


def make_wrench(vehicle: VehicleModel) -> Callable[[Four], Wrench]:
    """Sum of the rotors' thrusts, of their moments and of their reaction torques."""
    arms = arms_of(vehicle)
    return lambda thrusts: wrench_of(arms, thrusts)
