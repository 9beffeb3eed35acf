"""Searches m, ω, K, Γ and N_h of MPC-L1 on a linear model of a vehicle's horizontal axes.

    python tools/search_gains.py [--attitude 12 0.8] [--attitude-delay-ms 10]
        [--telemetry-delay-ms 15] [--command-delay-ms 15] [--drag 0.15] [--seconds 300]

The model: attitude of second order behind a delay, drag linear in the speed, transport delays both
ways, noise of a motion-capture system, the MPC's first input in closed form with its bound clipped.
The score is the mean tracking error on trajectories 2, 4 and 5, together with the same on a vehicle
with 25 % more and less attitude lag, 20 ms more delay, 15 % more and less gain, and a gust.  It
is a start, not a result: check what it finds by flights (`companion compare --perturb all`).
"""

import argparse
import math
import sys
import time
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import expm
from scipy.optimize import differential_evolution

from companion.control import l1_adaptive
from companion.control.l1_adaptive import first_order_gains
from companion.control.qp.condensed import Weights, condense
from companion.control.reference_model import discretise_position_model
from companion.trajectories.harmonic import TEST_TRAJECTORIES

STEP_S = 0.005
SAMPLE_STEPS = 2
PLAN_STEPS = 6
HOVER_S = 4.0
SCORED_S = 20.0
GRAVITY_M_S2 = 9.80665
LARGEST_SINE = math.sin(math.radians(35.0))
R_MAX_M_S2 = 600.0
COLUMNS = [(number, axis) for number in (2, 4, 5) for axis in (0, 1)]
STEPS = round((HOVER_S + SCORED_S) / STEP_S)
FLOWN_AWAY_MM = 1000.0


@dataclass(frozen=True)
class Model:
    """A vehicle's horizontal axes."""

    omega_rad_s: float
    zeta: float
    attitude_delay_s: float
    telemetry_delay_s: float
    command_delay_s: float
    drag_1_s: float
    gain: float = 1.0
    gust: bool = False


def family(nominal: Model) -> list[tuple[float, Model]]:
    """The vehicles that gains are scored on, with their weights."""
    return [
        (4.0, nominal),
        (1.2, replace(nominal, omega_rad_s=nominal.omega_rad_s * 0.8)),
        (0.3, replace(nominal, omega_rad_s=nominal.omega_rad_s * 1.25)),
        (
            1.0,
            replace(
                nominal,
                telemetry_delay_s=nominal.telemetry_delay_s + 0.010,
                command_delay_s=nominal.command_delay_s + 0.010,
            ),
        ),
        (0.3, replace(nominal, gain=1.15)),
        (0.3, replace(nominal, gain=0.85)),
        (1.2, replace(nominal, gust=True)),
    ]


def desired_positions() -> np.ndarray:
    """(steps and preview, columns) desired positions, the hover first."""
    times = np.arange(STEPS + 800) * STEP_S - HOVER_S
    return np.stack([TEST_TRAJECTORIES[n].position(times)[:, a] for n, a in COLUMNS], axis=1)


DESIRED = desired_positions()


def mean_error_mm(model: Model, m: float, omega: float, k: float, gamma: float, n: int) -> float:
    """Mean tracking error over the three trajectories, mm; large if the loop is unstable."""
    columns = len(COLUMNS)
    rng = np.random.default_rng(0)
    period = PLAN_STEPS * STEP_S
    a, b = discretise_position_model(np.array([m]), np.array([k]), period)
    row = condense(a[0], b[0], n, Weights(17.0, 0.08, 0.02)).gain[0]
    delay_steps = round((model.telemetry_delay_s + model.command_delay_s) / STEP_S)
    carry_a, carry_b = discretise_position_model(
        np.array([m]), np.array([k]), max(delay_steps, 1) * STEP_S
    )
    w, z = model.omega_rad_s, model.zeta
    attitude = expm(np.array([[0, 1, 0], [-w * w, -2 * z * w, w * w], [0, 0, 0]]) * STEP_S)
    gains = first_order_gains(
        (m,) * columns, (omega,) * columns, (k,) * columns, (gamma,) * columns, (16.0,) * columns
    )
    p, v = DESIRED[0].copy(), np.zeros(columns)
    tilt, tilt_rate = np.zeros(columns), np.zeros(columns)
    seen = [(p, v)] * (round(model.telemetry_delay_s / STEP_S) + 1)
    held = round((model.command_delay_s + model.attitude_delay_s) / STEP_S) + 1
    commands = [np.zeros(columns)] * held
    memory = l1_adaptive.start(gains, v, np.zeros(columns))
    r, r_before = p.copy(), p.copy()
    preview = np.arange(n + 2) * PLAN_STEPS
    bound = R_MAX_M_S2 * period**2
    u = np.zeros(columns)
    errors = np.zeros((STEPS, columns))
    for step in range(STEPS):
        if step % SAMPLE_STEPS == 0:
            position = seen[0][0] + 1.0e-3 * rng.standard_normal(columns)
            velocity = seen[0][1] + 1.5e-2 * rng.standard_normal(columns)
            if step % PLAN_STEPS == 0:
                state = carry_a[0] @ np.stack([position, velocity]) + np.outer(carry_b[0], r)
                ahead = step + round(model.command_delay_s / STEP_S)
                wanted = DESIRED[ahead + preview]
                data = np.vstack([state, r, wanted[1:], wanted[:-1]])
                data -= np.where(np.arange(len(data)) == 1, 0.0, 1.0)[:, None] * wanted[0]
                straight = 2.0 * r - r_before
                planned = np.clip(row @ data + wanted[0], straight - bound, straight + bound)
                r_before, r = r, planned
            memory, record = l1_adaptive.step(
                gains, memory, r, position, velocity, SAMPLE_STEPS * STEP_S
            )
            u = np.clip(record.u, -LARGEST_SINE, LARGEST_SINE)
            memory = l1_adaptive.with_applied(gains, memory, u)
        commands.append(u)
        command = commands.pop(0)
        tilt, tilt_rate = (
            attitude[0, 0] * tilt + attitude[0, 1] * tilt_rate + attitude[0, 2] * command,
            attitude[1, 0] * tilt + attitude[1, 1] * tilt_rate + attitude[1, 2] * command,
        )
        push = 0.9 * math.exp(-(((step * STEP_S - HOVER_S - 8.0) / 0.4) ** 2)) if model.gust else 0
        v = v + STEP_S * (model.gain * GRAVITY_M_S2 * tilt - model.drag_1_s * v + push)
        p = p + STEP_S * v
        seen.append((p, v))
        seen.pop(0)
        errors[step] = DESIRED[step] - p
        if step % 200 == 0 and np.abs(errors[step]).max() > 5.0:
            return FLOWN_AWAY_MM
    scored = errors[round(HOVER_S / STEP_S) :]
    lengths = np.hypot(scored[:, 0::2], scored[:, 1::2])
    return min(FLOWN_AWAY_MM, float(lengths.mean()) * 1e3)


def score(gains: np.ndarray, vehicles: list[tuple[float, Model]]) -> float:
    """Weighted mean error over a family of vehicles; stops early once it is hopeless."""
    m, omega, k, log_gamma, n = gains
    total, weights = 0.0, sum(weight for weight, _ in vehicles)
    for weight, model in vehicles:
        total += weight * mean_error_mm(model, m, omega, k, 10.0**log_gamma, round(n))
        if total > 4.0 * FLOWN_AWAY_MM:
            break
    return total / weights


def main() -> None:
    """Search until the time is over and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--attitude", nargs=2, type=float, default=(12.0, 0.8), metavar=("ω", "ζ"))
    parser.add_argument("--attitude-delay-ms", type=float, default=10.0)
    parser.add_argument("--telemetry-delay-ms", type=float, default=15.0)
    parser.add_argument("--command-delay-ms", type=float, default=15.0)
    parser.add_argument("--drag", type=float, default=0.15, help="1/s")
    parser.add_argument("--seconds", type=float, default=300.0, help="how long to search")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    vehicles = family(
        Model(
            options.attitude[0],
            options.attitude[1],
            options.attitude_delay_ms * 1e-3,
            options.telemetry_delay_ms * 1e-3,
            options.command_delay_ms * 1e-3,
            options.drag,
        )
    )
    end_s = time.monotonic() + options.seconds

    def tell(best: np.ndarray, convergence: float) -> bool:
        m, omega, k, log_gamma, n = best
        errors = [mean_error_mm(v, m, omega, k, 10.0**log_gamma, round(n)) for _, v in vehicles]
        sys.stdout.write(
            f"m {m:.3f}  ω {omega:.3f}  K {k:.3f}  Γ {10.0**log_gamma:.0f}  N_h {round(n)}  mm: "
            + "  ".join(f"{e:.0f}" for e in errors)
            + f"  (converged to {convergence:.2f})\n"
        )
        sys.stdout.flush()
        return time.monotonic() > end_s

    differential_evolution(
        score,
        [(0.35, 0.8), (0.1, 0.35), (0.45, 1.1), (2.3, 3.0), (28, 50)],
        args=(vehicles,),
        popsize=5,
        maxiter=200,
        seed=options.seed,
        x0=[0.5, 0.215, 0.62, 2.7, 37],
        callback=tell,
        polish=False,
    )


if __name__ == "__main__":
    main()
