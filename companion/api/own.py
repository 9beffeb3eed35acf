"""What a user brings along: looked at before it flies."""

import inspect
import math
from collections.abc import Callable
from typing import cast

import numpy as np

from companion.api.errors import InputError
from companion.control.own_controller import Controller, ControlSample, Setpoint
from companion.frames import Vector3
from companion.trajectories.from_function import (
    Along,
    FunctionTrajectory,
    trajectory_from_function,
)
from companion.trajectories.trajectory import Trajectory
from companion.vehicle_state import VehicleState

Wind = Callable[[float, Vector3], Vector3]
"""A wind of one's own: velocity of the air (x, y, z), ENU m/s, at a time and a place.

The time is the autopilot's, s since its boot, and never goes back; the place is ENU, m, in the
autopilot's local frame.  It is asked every 4 ms of simulated time.  Draw random numbers from a
generator that is made, with its seed, for each flight anew, and the flight can be repeated.
"""

_AT_REST_M_S = 0.05
_AGREE_WITHIN_M = 1e-6


def make_trajectory(
    position: Along,
    duration_s: float,
    *,
    name: str = "own",
    velocity: Along | None = None,
    acceleration: Along | None = None,
) -> FunctionTrajectory:
    """A trajectory from a function of time.

    It starts and stops by itself without a jolt: the path time s runs from 0, slowly over the first
    2 s, and rests at the duration 2 s after the scored part has ended.

    Args:
        position: (x, y, z), ENU m, at the path time s; asked for 0 ≤ s ≤ `duration_s` only.
        duration_s: of the scored part, s; from 4 s to an hour.
        name: for people, and in the results.
        velocity: its derivative by s, m/s; None: by differences.
        acceleration: the derivative of that, m/s²; None: by differences.

    Raises:
        InputError: it gives no three finite numbers, or the formulas are not its derivatives.
    """
    try:
        return trajectory_from_function(
            position, duration_s, name=name, velocity=velocity, acceleration=acceleration
        )
    except (ValueError, TypeError) as error:
        raise InputError(f"{error}.") from error


def sound_trajectory(given: object) -> Trajectory:
    """What a user calls a trajectory, if it is one.

    Raises:
        InputError: something of the protocol is missing, or does not agree with the rest.
    """
    for name in ("name", "scored_s", "end_s", "position", "position_at", "motion"):
        if not hasattr(given, name):
            raise InputError(
                f"{given!r} is no trajectory: it has no '{name}'. Give 1 … 5, a file, or an object "
                "with what companion.api.Trajectory has; make_trajectory makes one of a function."
            )
    trajectory = cast("Trajectory", given)
    try:
        return _looked_at(trajectory)
    except InputError:
        raise
    except Exception as error:  # whatever a user's function raises
        raise InputError(
            f"trajectory '{trajectory.name}': {type(error).__name__}: {error}. Its times are "
            "numbers, and its functions give what companion.api.Trajectory says."
        ) from error


def _looked_at(trajectory: Trajectory) -> Trajectory:
    scored_s, end_s = trajectory.scored_s, trajectory.end_s
    if not 0.0 < scored_s <= end_s < math.inf:
        raise InputError(
            f"trajectory '{trajectory.name}': 0 < scored_s ≤ end_s < ∞ must hold, not "
            f"{scored_s:g} s and {end_s:g} s."
        )
    times = np.linspace(0.0, end_s, 101)
    motion = trajectory.motion(times)
    position = trajectory.position(times)
    arrays = (position, motion.position_m, motion.velocity_m_s, motion.acceleration_m_s2)
    if any(np.shape(array) != (len(times), 3) for array in arrays):
        raise InputError(
            f"trajectory '{trajectory.name}': position and motion give arrays (samples, 3)."
        )
    if not all(np.isfinite(array).all() for array in arrays):
        raise InputError(f"trajectory '{trajectory.name}' is not finite from 0 to end_s.")
    one_by_one = np.array([trajectory.position_at(t) for t in times.tolist()])
    if np.abs(one_by_one - position).max() > _AGREE_WITHIN_M:
        raise InputError(f"trajectory '{trajectory.name}': position_at and position differ.")
    for t, velocity in ((0.0, motion.velocity_m_s[0]), (end_s, motion.velocity_m_s[-1])):
        speed = float(np.linalg.norm(velocity))
        if speed > _AT_REST_M_S:
            raise InputError(
                f"trajectory '{trajectory.name}' moves at {speed:.2f} m/s at t = {t:g} s; it must "
                "begin and end at rest. make_trajectory adds the ramps."
            )
    return trajectory


def sound_controller(given: object) -> Controller:
    """What a user calls a controller, if it is one.

    Raises:
        InputError: it has no `start` or no `step`, or is a class.
    """
    if inspect.isclass(given):
        raise InputError(f"{given.__name__} is a class. Give an instance: {given.__name__}().")
    if not all(callable(getattr(given, name, None)) for name in ("start", "step")):
        raise InputError(
            f"{given!r} is no controller: it needs the methods start(state) and step(sample). Give "
            "a name, a YAML file, or an object with what companion.api.Controller has."
        )
    return cast("Controller", given)


class WatchedController:
    """Passes everything on to a controller, and keeps the first exception that it raises."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self.raised: Exception | None = None
        """The first one; None while all is well."""

    def start(self, state: VehicleState) -> None:
        """As of the controller."""
        try:
            self._controller.start(state)
        except Exception as error:
            self.raised = self.raised or error
            raise

    def step(self, sample: ControlSample) -> Setpoint:
        """As of the controller."""
        try:
            return self._controller.step(sample)
        except Exception as error:
            self.raised = self.raised or error
            raise


def name_of(given: object) -> str:
    """What a user's object or function is called: its `name`, else its class's or its own."""
    for candidate in (getattr(given, "name", None), getattr(given, "__name__", None)):
        if isinstance(candidate, str) and candidate:
            return candidate
    return type(given).__name__
