"""MPC-L1+ as it flies, on a finely simulated vehicle of one axis, for tests of its theory."""

import math
from dataclasses import replace

import numpy as np

from companion.config.resolve import load_flight
from companion.control.frameworks import Tick
from companion.control.matrix_exponential import matrix_exponential
from companion.control.thrust import GRAVITY_M_S2
from companion.experiments.certified import plus_subject
from companion.frames import euler_from_quaternion, quaternion_from_euler
from companion.theory.plus_law import law_of
from companion.theory.plus_loop import axis_plants
from companion.vehicle_state import VehicleState

SAMPLE_S = 0.01
FINE_S = 0.0005
HEIGHT_M = 1.2


def subject_of(vehicle, **settings):
    config = load_flight(None, {"controller": "mpc-l1-plus", "vehicle": vehicle}, settings)
    return plus_subject(config, 4.5)


def law_and_plants(subject):
    delay_s = subject.dynamics.loop_delay_s
    law = law_of(subject.stack, delay_s, subject.sample_s)
    return law, axis_plants(subject.stack.settings.plant, delay_s)


class FineAxis:
    """Position, velocity, acceleration as the tilt says, its rate; the input through a queue."""

    def __init__(self, plant, disturbance_m_s2=0.0):
        a = plant.actuation
        omega, zeta = a.natural_frequency_rad_s, a.damping
        system = np.zeros((6, 6))  # the four states, the input, the disturbance
        system[0, 1] = 1.0
        if a.interface == "acceleration":
            system[1, 1:3] = -plant.drag_1_s, plant.push
            system[2, 3] = 1.0
            system[3, 2:5] = -(omega**2), -2.0 * zeta * omega, plant.gain * omega**2
        else:
            system[1, 2] = 1.0
            through = plant.gain * plant.push * omega**2
            system[2, 1:3], system[2, 4] = (-(omega**2), -2.0 * zeta * omega), through
        system[1, 5] = 1.0
        whole = int(a.delay_s / FINE_S + 1e-9)
        rest_s = max(0.0, a.delay_s - whole * FINE_S)  # within a step, before the input arrives
        self.before = matrix_exponential(system * rest_s)
        self.after = matrix_exponential(system * (FINE_S - rest_s))
        self.x = np.zeros(6)
        self.x[5] = disturbance_m_s2
        self.queue = [0.0] * whole

    def advance(self, u, seconds):
        for _ in range(round(seconds / FINE_S)):
            self.queue.append(u)
            self.x = self.before @ self.x
            self.x[4] = self.queue.pop(0)
            self.x = self.after @ self.x


def _state(time_s, axis, x, force):
    position, velocity = np.array([0.0, 0.0, HEIGHT_M]), np.zeros(3)
    position[axis] += x[0]
    velocity[axis] += x[1]
    attitude, rates = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if axis < 2:
        angle = math.atan(x[2] / force)
        turn = x[3] / force * math.cos(angle) ** 2
        roll, pitch = (0.0, angle) if axis == 0 else (-angle, 0.0)
        attitude = quaternion_from_euler(roll, pitch, 0.0)
        rates = (0.0, turn, 0.0) if axis == 0 else (-turn, 0.0, 0.0)
    return VehicleState(time_s, tuple(position), tuple(velocity), attitude, rates)


def flown(subject, law, axis, plant, samples, *, kick_m=0.0, disturbance_m_s2=0.0, noise=None):
    """Positions and inputs (samples,) of the stack itself, nothing learnt, about a hover.

    Args:
        subject: with the stack, and the delay that it is told.
        law: for the predictor's covariance at rest.
        axis: that moves.
        plant: of that axis.
        samples: how many.
        kick_m: of the position at the beginning.
        disturbance_m_s2: throughout.
        noise: (samples, 4) of the measurements.
    """
    # Quadratic drag is no part of a linear loop about rest.
    settings = replace(subject.stack.settings, lag=None, mismatch=None, quadratic_drag_1_m=0.0)
    stack = replace(subject.stack, settings=settings)
    force = GRAVITY_M_S2 * settings.plant.tilt_gain
    memory = stack.start(_state(10.0 - SAMPLE_S, axis, np.zeros(4), force))
    settled = replace(memory.sensed.predictor, covariance=law.covariance)
    sensed = replace(memory.sensed, predictor=settled)
    memory = replace(memory, sensed=sensed, deviation=np.zeros(3))  # it has flown for a while
    vehicle = FineAxis(plant, disturbance_m_s2)
    vehicle.x[0] = kick_m
    hover = np.array([[0.0, 0.0, HEIGHT_M]])
    positions, inputs = np.empty(samples), np.empty(samples)
    for k in range(samples):
        seen = vehicle.x[:4] + (0.0 if noise is None else noise[k])
        state = _state(10.0 + k * SAMPLE_S, axis, seen, force)
        tick = Tick(state, subject.dynamics.loop_delay_s, 0.0)
        memory, command, record = stack.step(memory, tick, lambda at: hover.repeat(len(at), axis=0))
        u = float(record.applied_u[2])
        if axis < 2:
            roll, pitch, _ = euler_from_quaternion(command.attitude_flu_to_enu)
            u = force * math.tan(pitch if axis == 0 else -roll)
        positions[k], inputs[k] = vehicle.x[0], u
        vehicle.advance(u, SAMPLE_S)
    return positions, inputs
