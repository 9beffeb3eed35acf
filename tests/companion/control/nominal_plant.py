"""A plain vehicle for tests of the control laws: lagged attitude, drag, delays, noise.

Second-order attitude (ωn 12 rad/s, ζ 0.8), thrust with a 40 ms lag, drag 0.15 v + 0.02 v|v|,
15 ms of delay each way, 1 mm and 1.5 cm/s of noise.  The full vehicle lives behind MAVLink.
"""

from collections import deque

import numpy as np

from companion.control.frameworks import Tick
from companion.control.thrust import GRAVITY_M_S2
from companion.frames import euler_from_quaternion, quaternion_from_euler, rotate
from companion.vehicle_state import VehicleState


class FlownAwayError(Exception):
    """The loop is unstable."""


def fly(
    stack,
    reference,
    duration_s: float,
    *,
    seed: int = 1,
    noise: float = 1.0,
    hover_thrust: float = 0.5,
    disturbance_m_s2=lambda t: (0.0, 0.0, 0.0),
    start_m=(0.0, 0.0, 1.2),
    natural_frequency: float = 12.0,
    extra_delay_s: float = 0.0,
    told_delay_s: float = 0.03,
    loss: float = 0.0,
    drag: float = 1.0,
    climb_rate_field=None,
):
    """Fly in closed loop from rest; returns times, true positions, commands' tilt, records.

    Args:
        stack: of control laws.
        reference: desired positions (n, 3) at times (n,).
        duration_s: of the flight.
        seed: of noise, trim and losses.
        noise: factor on noise and trim.
        hover_thrust: field that hovers.
        disturbance_m_s2: acceleration (3,) at a time.
        start_m: where it begins.
        natural_frequency: of the attitude, rad/s.
        extra_delay_s: beside the 30 ms, on the way of the commands.
        told_delay_s: what the stack is told that the loop's delay is.
        loss: share of the samples, and of the commands, that never arrive.
        drag: factor on it.
        climb_rate_field: the thrust law that says what climb rate a field is, where the vehicle
            flies climb rates by a loop of its own: of second order, ωn 9.9 rad/s, ζ 1.02.
    """
    rng = np.random.default_rng(seed)
    luck = np.random.default_rng([seed, 1])
    h, every, delay = 0.0025, 4, 6
    later = delay + round(extra_delay_s / h)
    p, v = np.array(start_m, dtype=float), np.zeros(3)
    angle, rate = np.zeros(2), np.zeros(2)
    trim = np.radians(rng.uniform(-0.8, 0.8, 2)) * noise
    force = 1.0
    lift = 0.0
    outbox, inbox = deque(), deque()
    command = (0.0, 0.0, hover_thrust if climb_rate_field is None else 0.5)
    memory = None
    times, positions, tilts, records = [], [], [], []
    for k in range(round(duration_s / h)):
        t = k * h
        if k % every == 0:
            q = quaternion_from_euler(angle[0], angle[1], 0.0)
            turn = (rate[0], rate[1] * np.cos(angle[0]), -rate[1] * np.sin(angle[0]))
            measured_p = p + noise * 1e-3 * rng.standard_normal(3)
            measured_v = v + noise * 1.5e-2 * rng.standard_normal(3)
            if luck.random() >= loss:
                state = VehicleState(t, tuple(measured_p), tuple(measured_v), q, turn)
                outbox.append((k + delay, state))
            times.append(t)
            positions.append(p.copy())
        while outbox and outbox[0][0] <= k:
            state = outbox.popleft()[1]
            if memory is None:
                memory = stack.start(state)
                continue
            memory, out, record = stack.step(memory, Tick(state, told_delay_s, 0.0), reference)
            roll, pitch, _ = euler_from_quaternion(out.attitude_flu_to_enu)
            if luck.random() >= loss:
                inbox.append((k + later, (roll, pitch, out.thrust)))
            tilts.append((roll, pitch))
            records.append(record)
        while inbox and inbox[0][0] <= k:
            command = inbox.popleft()[1]
        wanted = np.array(command[:2]) - trim
        rate += h * (natural_frequency**2 * (wanted - angle) - 2 * 0.8 * natural_frequency * rate)
        angle = angle + h * rate
        speed = float(np.linalg.norm(v))
        air = drag * (0.15 + 0.02 * speed) * v
        if climb_rate_field is None:
            force += h * (command[2] / hover_thrust - force) / 0.04
        else:
            up, down = climb_rate_field.climb_m_s, climb_rate_field.descent_m_s
            climb = (2.0 * command[2] - 1.0) * (up if command[2] > 0.5 else down)
            lift += h * (9.9**2 * (climb - v[2]) - 2 * 1.02 * 9.9 * lift)
            upright = rotate(quaternion_from_euler(angle[0], angle[1], 0.0), (0.0, 0.0, 1.0))[2]
            force = (1.0 + (lift + air[2]) / GRAVITY_M_S2) / upright
        thrust = rotate(
            quaternion_from_euler(angle[0], angle[1], 0.0), (0.0, 0.0, GRAVITY_M_S2 * force)
        )
        a = np.array(thrust) - (0, 0, GRAVITY_M_S2) - air
        v = v + h * (a + disturbance_m_s2(t))
        p = p + h * v
        if not float(np.abs(p - start_m).max()) < 20.0:
            raise FlownAwayError(f"unstable: at {p} m after {t:.1f} s")
    return np.array(times), np.array(positions), np.array(tilts), records
