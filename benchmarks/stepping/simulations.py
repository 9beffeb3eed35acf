"""Simulations alone, that give their steps per second: this package's plant, and rotorpy."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

import numpy as np

from companion.trajectories.harmonic import TEST_TRAJECTORIES
from sitl_shim.compiled import VARIABLE
from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import VehicleModel, load_vehicle
from sitl_shim.wind.field import SteadyWind

STEP_S = 0.004
STEPS = 1000
"""Of a simulation alone, in each round."""


@contextmanager
def compiling(kind: str) -> Iterator[None]:
    """Let what is made inside be ``compiled``, or ``plain``."""
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = "1" if kind == "compiled" else "0"
    try:
        yield
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before


def steppers(kinds: tuple[str, ...], trajectory: int) -> dict[str, Callable[[], float]]:
    """Simulations that give their steps per second of processor time."""
    vehicle = load_vehicle("bebop2")
    found: dict[str, Callable[[], float]] = {}
    for kind in kinds:
        found[f"plant alone, {kind}"] = _plant_stepper(vehicle, kind)
    if find_spec("rotorpy"):
        found |= _rotorpy_steppers(vehicle, trajectory)
    return found


def _plant_stepper(vehicle: VehicleModel, kind: str) -> Callable[[], float]:
    with compiling(kind):
        plant = Plant(
            vehicle, SteadyWind((0.0, 0.0, 0.0)), seed=0, airborne_at_enu_m=(0.0, 0.0, 100.0)
        )
    hover = (vehicle.hover_signal,) * 4

    def step() -> float:
        begin = time.process_time()
        for _ in range(STEPS):
            plant.step(hover)
        return STEPS / (time.process_time() - begin)

    return step


def _rotorpy_steppers(vehicle: VehicleModel, trajectory: int) -> dict[str, Callable[[], float]]:
    """Rotorpy's quadrotor with this vehicle's numbers, on a trajectory."""
    from rotorpy.controllers.quadrotor_control import SE3Control  # type: ignore[import-untyped]
    from rotorpy.vehicles.multirotor import Multirotor  # type: ignore[import-untyped]

    parameters = rotorpy_parameters(vehicle)
    hover_rad_s = np.sqrt(vehicle.mass_kg * 9.81 / 4.0 / parameters["k_eta"])
    points = _flat_outputs(trajectory)
    start = {
        "x": points[0]["x"],
        "v": points[0]["x_dot"],
        "q": np.array([0.0, 0.0, 0.0, 1.0]),
        "w": np.zeros(3),
        "wind": np.zeros(3),
        "rotor_speeds": np.full(4, hover_rad_s),
    }
    controller = SE3Control(parameters)
    body = Multirotor(parameters, initial_state=start)
    coarse = Multirotor(
        parameters,
        initial_state=start,
        integrator_kwargs={"method": "RK45", "first_step": STEP_S, "rtol": 1.0, "atol": 1.0},
    )
    commands = []
    state = start
    for k, point in enumerate(points):
        commands.append(controller.update(k * STEP_S, state, point))
        state = body.step(state, commands[-1], STEP_S)
    if not np.linalg.norm(state["x"] - points[-1]["x"]) < 1.0:
        raise ValueError("rotorpy's controller does not fly the trajectory")

    def fly_it() -> float:
        state = start
        begin = time.process_time()
        for k, point in enumerate(points):
            state = body.step(state, controller.update(k * STEP_S, state, point), STEP_S)
        return len(points) / (time.process_time() - begin)

    def repeat(body: Multirotor) -> float:
        state = start
        begin = time.process_time()
        for command in commands:
            state = body.step(state, command, STEP_S)
        return len(commands) / (time.process_time() - begin)

    return {
        "rotorpy, dynamics": lambda: repeat(body),
        "rotorpy, one step each": lambda: repeat(coarse),
        "rotorpy, SE3": fly_it,
    }


def rotorpy_parameters(vehicle: VehicleModel) -> dict[str, Any]:
    """A vehicle as rotorpy describes one.

    Its thrust goes with the square of a rotor's speed, where this vehicle's is linear in the
    signal; full thrust, lag, arms, mass, inertia and drag at hover are the same.
    """
    full_rad_s = 1000.0
    k_eta = vehicle.propulsion.max_thrust_n / full_rad_s**2
    hover_rad_s = np.sqrt(vehicle.mass_kg * 9.81 / 4.0 / k_eta)
    dx, _, dz = vehicle.drag.linear_n_s_m
    ix, iy, iz = vehicle.inertia_kg_m2
    quadratic = vehicle.drag.quadratic_n_s2_m2
    return {
        "mass": vehicle.mass_kg,
        **{"Ixx": ix, "Iyy": iy, "Izz": iz, "Ixy": 0.0, "Ixz": 0.0, "Iyz": 0.0},
        "num_rotors": 4,
        "rotor_pos": {
            f"r{k}": np.array(rotor.position_flu_m) for k, rotor in enumerate(vehicle.rotors, 1)
        },
        "rotor_directions": np.array([-1 if r.spin == "ccw" else 1 for r in vehicle.rotors]),
        "rI": np.zeros(3),
        **{"c_Dx": quadratic, "c_Dy": quadratic, "c_Dz": quadratic},
        "k_eta": k_eta,
        "k_m": k_eta * vehicle.propulsion.torque_per_thrust_m,
        "k_d": dx / (4.0 * hover_rad_s),
        "k_z": dz / (4.0 * hover_rad_s),
        **{"k_h": 0.0, "k_flap": 0.0},
        "tau_m": vehicle.propulsion.time_constant_s,
        **{"rotor_speed_min": 0.0, "rotor_speed_max": full_rad_s, "motor_noise_std": 0.0},
    }


def _flat_outputs(trajectory: int) -> list[dict[str, Any]]:
    """Points of a trajectory, a step apart, as rotorpy's controller takes them."""
    times_s = np.arange(STEPS, dtype=np.float64) * STEP_S
    motion = TEST_TRAJECTORIES[trajectory].motion(times_s)
    nothing = np.zeros(3)
    return [
        {
            "x": position,
            "x_dot": velocity,
            "x_ddot": acceleration,
            "x_dddot": nothing,
            "x_ddddot": nothing,
            "yaw": 0.0,
            "yaw_dot": 0.0,
            "yaw_ddot": 0.0,
        }
        for position, velocity, acceleration in zip(
            motion.position_m, motion.velocity_m_s, motion.acceleration_m_s2, strict=True
        )
    ]
