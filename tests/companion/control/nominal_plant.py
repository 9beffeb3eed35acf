"""A plain vehicle for tests of the control laws: lagged attitude, drag, delays, noise.

Second-order attitude (ωn 12 rad/s, ζ 0.8), thrust with a 40 ms lag, drag 0.15 v + 0.02 v|v|,
15 ms of delay each way, 1 mm and 1.5 cm/s of noise.  The full vehicle lives behind MAVLink.
"""

from collections import deque

import numpy as np

from companion.control.frameworks import Stack, Tick
from companion.frames import euler_from_quaternion, quaternion_from_euler, rotate
from companion.vehicle_state import VehicleState


class FlownAwayError(Exception):
    """The loop is unstable."""


def fly(
    stack: Stack,
    reference,
    duration_s: float,
    *,
    seed: int = 1,
    noise: float = 1.0,
    hover_thrust: float = 0.5,
    disturbance_m_s2=lambda t: (0.0, 0.0, 0.0),
    start_m=(0.0, 0.0, 1.2),
    natural_frequency: float = 12.0,
):
    """Fly in closed loop from rest; returns times, true positions, commands' tilt, records."""
    rng = np.random.default_rng(seed)
    h, every, delay = 0.0025, 4, 6
    p, v = np.array(start_m, dtype=float), np.zeros(3)
    angle, rate = np.zeros(2), np.zeros(2)
    trim = np.radians(rng.uniform(-0.8, 0.8, 2)) * noise
    force = 1.0
    outbox, inbox = deque(), deque()
    command = (0.0, 0.0, hover_thrust)
    memory = None
    times, positions, tilts, records = [], [], [], []
    for k in range(round(duration_s / h)):
        t = k * h
        if k % every == 0:
            q = quaternion_from_euler(angle[0], angle[1], 0.0)
            measured_p = p + noise * 1e-3 * rng.standard_normal(3)
            measured_v = v + noise * 1.5e-2 * rng.standard_normal(3)
            outbox.append(
                (
                    k + delay,
                    VehicleState(t, tuple(measured_p), tuple(measured_v), q, (0.0, 0.0, 0.0)),
                )
            )
            times.append(t)
            positions.append(p.copy())
        while outbox and outbox[0][0] <= k:
            state = outbox.popleft()[1]
            if memory is None:
                memory = stack.start(state)
                continue
            memory, out, record = stack.step(memory, Tick(state, 0.03, 0.0), reference)
            roll, pitch, _ = euler_from_quaternion(out.attitude_flu_to_enu)
            inbox.append((k + delay, (roll, pitch, out.thrust)))
            tilts.append((roll, pitch))
            records.append(record)
        while inbox and inbox[0][0] <= k:
            command = inbox.popleft()[1]
        wanted = np.array(command[:2]) - trim
        rate += h * (natural_frequency**2 * (wanted - angle) - 2 * 0.8 * natural_frequency * rate)
        angle = angle + h * rate
        force += h * (command[2] / hover_thrust - force) / 0.04
        thrust = rotate(quaternion_from_euler(angle[0], angle[1], 0.0), (0.0, 0.0, 9.80665 * force))
        speed = float(np.linalg.norm(v))
        a = np.array(thrust) - (0, 0, 9.80665) - (0.15 + 0.02 * speed) * v
        v = v + h * (a + disturbance_m_s2(t))
        p = p + h * v
        if not float(np.abs(p - start_m).max()) < 20.0:
            raise FlownAwayError(f"unstable: at {p} m after {t:.1f} s")
    return np.array(times), np.array(positions), np.array(tilts), records
