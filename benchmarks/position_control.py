"""What a user would pick instead: the autopilot's own position control on the test trajectories.

    python benchmarks/position_control.py [--seeds 3] [--wind calm --wind wind3 ...] [--json]

The shim's PX4 (`sih_quadx`) and ArduCopter (`arducopter`), with the errors of their own estimators,
begin in the air at the trajectory's first point.  SET_POSITION_TARGET_LOCAL_NED is streamed
at 50 Hz: position, velocity and acceleration of the trajectory ("full"), or its position alone.
After 6 s of hover the 20 s of the trajectory are scored, against the truth and against the
autopilot's own estimate.  Limits of the autopilot are its own, but for ArduCopter's on trajectory 5
(see `RAISED`), which it leaves by metres with those.
"""

import argparse
import json
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from companion.trajectories.harmonic import TEST_TRAJECTORIES
from companion.trajectories.trajectory import Trajectory
from sitl_shim.frames import swap_enu_ned
from sitl_shim.mavlink.endpoint import Shim
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Packer, dialect
from sitl_shim.simulation import ShimOptions

VEHICLES = {"px4": "sih_quadx", "ardupilot": "arducopter"}
RAISED = {5: {"WPNAV_ACCEL": 500.0, "PSC_JERK_NE": 20.0}}
"""ArduCopter's limits of position control, for the trajectory that it leaves with its own."""
MODES = {"px4": 6 << 16, "ardupilot": 4}
"""OFFBOARD and GUIDED, as custom modes."""
HOVER_S = 6.0
STREAM_TICKS = 5
"""Ticks of 4 ms from setpoint to setpoint."""
_NO_VELOCITY_NOR_ACCELERATION = 0x038 | 0x1C0
_NO_YAW_RATE = 0x800
_SET_MODE = 176


@dataclass(frozen=True, slots=True)
class Errors:
    """Mean distance from the trajectory over the scored part, m; over seeds."""

    truth_m: float
    estimate_m: float


def fly(autopilot: str, number: int, wind: str, seed: int, *, full: bool) -> Errors:
    """One flight."""
    trajectory = TEST_TRAJECTORIES[number]
    east, north, up = trajectory.position(np.zeros(1))[0]
    scenario = f"fan-{number}" if wind == "fan" else wind
    options = ShimOptions(
        autopilot=autopilot,
        vehicle=VEHICLES[autopilot],
        scenario=scenario,
        seed=seed,
        parameters=RAISED.get(number, {}) if autopilot == "ardupilot" else {},
        airborne_at_enu_m=(float(east), float(north), float(up)),
    )
    shim = Shim(options, (LinkKind.ONBOARD,))
    simulation, packer = shim.simulation, Packer(1, 191)
    mask = _NO_YAW_RATE | (0 if full else _NO_VELOCITY_NOR_ACCELERATION)
    start_s = HOVER_S + 2.0
    desired, heading = _sampled(trajectory, start_s), _heading(simulation)
    errors: list[tuple[float, float]] = []
    for tick in range(1, len(desired)):
        shim.step()
        time_s = simulation.time_us * 1e-6
        if tick % STREAM_TICKS == 0:
            position, velocity, acceleration = (swap_enu_ned(v) for v in desired[tick])
            message = dialect.MAVLink_set_position_target_local_ned_message(
                round(time_s * 1e3), 1, 1, 1, mask,
                *position, *velocity, *acceleration, heading, 0.0,
            )  # fmt: skip
            shim.receive(0, packer.pack(message), time_s)
        if tick == 250:
            mode = MODES[autopilot]
            words = (mode >> 16 & 0xFF, mode >> 24) if autopilot == "px4" else (mode, 0)
            command = dialect.MAVLink_command_long_message(
                1, 1, _SET_MODE, 0, 1, *words, 0, 0, 0, 0
            )
            shim.receive(0, packer.pack(command), time_s)
        if start_s <= time_s <= start_s + trajectory.scored_s and tick % 2 == 0:
            wanted = desired[tick][0]
            errors.append(
                (
                    math.dist(simulation.state.position_enu_m, wanted),
                    math.dist(simulation.estimate.position_enu_m, wanted),
                )
            )
    assert simulation.autopilot.heartbeat.custom_mode == MODES[autopilot], "the mode was left"
    truth, estimate = np.mean(errors, axis=0)
    return Errors(float(truth), float(estimate))


def _sampled(trajectory: Trajectory, start_s: float) -> list[tuple[Any, Any, Any]]:
    """Position, velocity and acceleration at each tick, ENU."""
    times = np.arange(0.0, start_s + trajectory.scored_s + 0.1, 0.004) - start_s
    motion = trajectory.motion(times)
    parts = (motion.position_m, motion.velocity_m_s, motion.acceleration_m_s2)
    return [
        (tuple(p), tuple(v), tuple(a))
        for p, v, a in zip(*(part.tolist() for part in parts), strict=True)
    ]


def _heading(simulation: Any) -> float:  # noqa: ANN401 - the shim's
    """Of the nose at first, from north to the east."""
    w, x, y, z = simulation.state.attitude_flu_to_enu
    return math.pi / 2.0 - math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def main(arguments: Sequence[str] | None = None) -> None:
    """Fly all of them and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--wind", action="append", help="calm, wind3, fan, gusts")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args(arguments)
    if not asked.json:
        numbers = [f"{number:<13}" for number in [*TEST_TRAJECTORIES, "mean"]]
        sys.stdout.write(
            f"mean error against the truth (against the estimate), m, {asked.seeds} seeds\n"
            f"{'':<32}{'  '.join(numbers)}\n"
        )
    found = []
    for autopilot in VEHICLES:
        for full in (True, False):
            for wind in (asked.wind or ["calm", "wind3", "fan"]) if full else ["calm"]:
                row = {"autopilot": autopilot, "full": full, "wind": wind}
                for number in TEST_TRAJECTORIES:
                    flights = [
                        fly(autopilot, number, wind, seed, full=full)
                        for seed in range(1, asked.seeds + 1)
                    ]
                    row[str(number)] = {
                        "truth_m": float(np.mean([f.truth_m for f in flights])),
                        "estimate_m": float(np.mean([f.estimate_m for f in flights])),
                    }
                found.append(row)
                if not asked.json:
                    sys.stdout.write(_line(row) + "\n")
                    sys.stdout.flush()
    if asked.json:
        sys.stdout.write(json.dumps(found, indent=2) + "\n")


def _line(row: dict[str, Any]) -> str:
    """Truth, and in brackets the estimate, of each trajectory and of their mean."""
    cells = [row[str(number)] for number in TEST_TRAJECTORIES]
    mean = {key: sum(cell[key] for cell in cells) / len(cells) for key in cells[0]}
    words = [f"{c['truth_m']:.3f} ({c['estimate_m']:.3f})" for c in [*cells, mean]]
    kind = "full" if row["full"] else "position only"
    return f"{row['autopilot']:<10}{kind:<14}{row['wind']:<8}" + "  ".join(words)


if __name__ == "__main__":
    main()
