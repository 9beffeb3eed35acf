"""`companion` as a library: fly in lockstep with one call, and get arrays back.

>>> from companion.api import fly
>>> flight = fly(trajectory=4, controller="mpc-l1", vehicle="bebop2", wind="fan", seed=1)
>>> flight.outcome
'tracked'

What is listed in `__all__` is the stable surface: see docs/api/index.md for what is promised.
Everything flies the simulated vehicle; a real one is flown by the command `companion fly`.
"""

from companion.api.errors import ControllerError, InputError
from companion.api.flight import Figures, Flight, Ticks, Truth, score
from companion.api.flying import fly
from companion.api.own import Wind, make_trajectory
from companion.api.reading import read_flight
from companion.api.vehicles import plant_of, vehicle_of, write_yaml
from companion.control.own_controller import (
    AccelerationSetpoint,
    AttitudeSetpoint,
    Controller,
    ControlSample,
    DesiredMotion,
    Preview,
    Setpoint,
)
from companion.trajectories.from_function import FunctionTrajectory
from companion.trajectories.trajectory import Motion, Trajectory
from companion.vehicle_state import VehicleState

__all__ = [
    "AccelerationSetpoint",
    "AttitudeSetpoint",
    "ControlSample",
    "Controller",
    "ControllerError",
    "DesiredMotion",
    "Figures",
    "Flight",
    "FunctionTrajectory",
    "InputError",
    "Motion",
    "Preview",
    "Setpoint",
    "Ticks",
    "Trajectory",
    "Truth",
    "VehicleState",
    "Wind",
    "fly",
    "make_trajectory",
    "plant_of",
    "read_flight",
    "score",
    "vehicle_of",
    "write_yaml",
]
