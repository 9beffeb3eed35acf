"""Measures a vehicle's attitude, climb-rate and drag by steps, over MAVLink, in the shim.

    python tools/measure_responses.py bebop2 [--seeds 3] [--sensors exact]

The vehicle holds in the air; the companion's own thrust loop runs on its telemetry.  Steps of roll,
of pitch and of the climb-rate command are flown, and to each a second-order response of free gain
behind a dead time is fitted, over the samples' own time: the dead time is from a sample's time
until what was decided on it begins to show.  What remains of it without the transport delay (twice
the age of an arriving sample) is the vehicle's own.  Only the first 0.8 s after a step count: what
the integral of the thrust loop makes good later is not of the loop's speed.  The drag comes from
coasting level after a run at 15° of tilt.  The figures belong into `dynamics:` of the vehicle's
file, with a word on where they came from.
"""

import argparse
import heapq
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from companion.config.models import ThrustConfig, VehicleConfig
from companion.config.resolve import find_config
from companion.config.validation import validate
from companion.config.yaml_source import read_yaml
from companion.control import thrust
from companion.control.thrust import GRAVITY_M_S2, ThrustGains
from companion.frames import euler_from_quaternion, quaternion_from_euler, rotate, tilt_cosine
from companion.mavlink.codec import Packer, encode
from companion.mavlink.framing import Framer
from companion.mavlink.messages import MessageId, Target
from companion.mavlink.setpoints import AttitudeSetpoint, setpoint_message
from companion.mavlink.telemetry import is_truth, state_from_odometry
from companion.vehicle_state import VehicleState
from sitl_shim.mavlink.endpoint import Shim
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.simulation import ShimOptions

_SAMPLES_US = 10_000
_SET_INTERVAL, _SET_MODE = 511, 176
_OFFBOARD = (1.0, 6.0)
_SETTLED_S = 4.0
_TILT_STEP_RAD = math.radians(8.0)
_CLIMB_STEP_M_S = 0.5
_COUNTED_S = 0.8
_RUN_TILT_RAD = math.radians(15.0)

Array = np.ndarray


@dataclass(frozen=True)
class Command:
    """What a tick asks for."""

    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    climb_m_s: float = 0.0


@dataclass(frozen=True)
class Response:
    """A fitted response."""

    natural_frequency_rad_s: float
    damping: float
    dead_time_s: float
    gain: float
    residual: float
    """Root mean square of what the fit leaves, in steps."""


class Vehicle:
    """A vehicle in the air, under the companion's thrust loop, sampled at 100 Hz."""

    def __init__(self, options: ShimOptions, gains: ThrustGains) -> None:
        self.shim = Shim(options, (LinkKind.ONBOARD,))
        self.ages_s: list[float] = []
        """Of the samples as they arrived."""
        self._gains = gains
        self._memory: thrust.ThrustMemory | None = None
        self._last_s = 0.0
        self._framer = Framer()
        self._packer = Packer(1)
        self._arriving: list[tuple[float, int, bytes]] = []
        self._count = 0

    def command(self, number: int, *parameters: float) -> None:
        """Send a COMMAND_LONG."""
        values = {f"param{k + 1}": value for k, value in enumerate((*parameters, *[0.0] * 7)[:7])}
        ids = {"target_system": 1, "target_component": 1}
        self._send(encode("COMMAND_LONG", command=number, confirmation=0, **ids, **values))

    def fly(
        self, seconds: float, wanted: Callable[[float], Command]
    ) -> list[tuple[VehicleState, Command]]:
        """Fly on; `wanted` gives the command at the time since the beginning."""
        begin_s = self.shim.time_s
        flown = []
        while self.shim.time_s < begin_s + seconds:
            for state in self._samples():
                command = wanted(self.shim.time_s - begin_s)
                flown.append((state, command))
                self.ages_s.append(self.shim.time_s - state.time_s)
                self._answer(state, command)
        return flown

    def _samples(self) -> list[VehicleState]:
        for datagram in self.shim.step():
            self._count += 1
            heapq.heappush(self._arriving, (datagram.due_s, self._count, datagram.data))
        states = []
        while self._arriving and self._arriving[0][0] <= self.shim.time_s + 1e-9:
            for frame in self._framer.feed(heapq.heappop(self._arriving)[2]):
                if frame.message_id == MessageId.ODOMETRY and not is_truth(frame):
                    state = state_from_odometry(frame)
                    assert isinstance(state, VehicleState)
                    states.append(state)
        return states

    def _answer(self, state: VehicleState, wanted: Command) -> None:
        climb, cosine = state.velocity_enu_m_s[2], tilt_cosine(state.attitude_flu_to_enu)
        if self._memory is None:
            self._memory = thrust.start(self._gains, climb)
        dt = max(1e-3, state.time_s - self._last_s)
        self._memory, field = thrust.step(
            self._gains, self._memory, wanted.climb_m_s, climb, cosine, min(dt, 0.05)
        )
        self._last_s = state.time_s
        yaw = euler_from_quaternion(state.attitude_flu_to_enu)[2]
        attitude = quaternion_from_euler(wanted.roll_rad, wanted.pitch_rad, yaw)
        setpoint = AttitudeSetpoint(attitude, field)
        self._send(setpoint_message(setpoint, self.shim.time_s, Target(1, 1)))

    def _send(self, outgoing: object) -> None:
        self.shim.receive(0, self._packer.pack(outgoing), self.shim.time_s)  # type: ignore[arg-type]


def doublet(size: float, hold_s: float) -> tuple[list[tuple[float, float]], float]:
    """Steps (time, change) up, back through zero to below, and back, and when it is over."""
    steps = [(0.5, size), (0.5 + hold_s, -2.0 * size), (0.5 + 2.0 * hold_s, size)]
    return steps, 0.5 + 3.0 * hold_s


def step_response(time_s: Array, omega: float, zeta: float) -> Array:
    """Of ``ωn² / (s² + 2 ζ ωn s + ωn²)``; 0 before time 0."""
    t = np.maximum(time_s, 0.0)
    root = np.sqrt(complex(zeta * zeta - 1.0 + 1e-12))
    fast, slow = omega * (-zeta - root), omega * (-zeta + root)
    return np.real(1.0 - (fast * np.exp(slow * t) - slow * np.exp(fast * t)) / (fast - slow))


def fit(times_s: Array, answers: Array, steps: list[tuple[float, float]], size: float) -> Response:
    """Least squares over natural frequency, damping, dead time, gain and offset."""
    since_s = times_s - np.array(
        [max((at for at, _ in steps if at <= t), default=t) for t in times_s]
    )
    counts = since_s < _COUNTED_S

    def residuals(p: Array) -> Array:
        omega, zeta, dead_s, gain, offset = p
        modelled = sum(d * step_response(times_s - at - dead_s, omega, zeta) for at, d in steps)
        return (gain * modelled + offset - answers)[counts] / size

    starts = ([8.0, 0.8, 0.04, 1.0, 0.0], [4.0, 1.2, 0.08, 1.0, 0.0])
    bounds = ([1.0, 0.2, 0.0, 0.5, -1.0], [60.0, 4.0, 0.3, 1.5, 1.0])
    fits = [least_squares(residuals, s, bounds=bounds, diff_step=1e-4) for s in starts]
    best = min(fits, key=lambda f: f.cost)
    omega, zeta, dead_s, gain, _ = best.x
    return Response(omega, zeta, dead_s, gain, float(np.sqrt(np.mean(best.fun**2))))


def thrust_gains(vehicle: VehicleConfig) -> ThrustGains:
    """The thrust loop as it flies, with the default gains."""
    loop = ThrustConfig()
    return ThrustGains(
        loop.proportional,
        loop.integral,
        vehicle.hover_thrust,
        vehicle.thrust_curve,
        vehicle.minimum_thrust,
        vehicle.maximum_thrust,
        loop.maximum_acceleration_m_s2,
        loop.hover_drift,
        loop.acceleration_noise_m_s2,
    )


def measure(
    name: str, seed: int, sensors: str | None
) -> tuple[dict[str, Response], tuple[float, float], float]:
    """The responses of roll, pitch and climb rate, the drag, and the transport delay, s."""
    config = validate(VehicleConfig, read_yaml(find_config("vehicle", name)))
    options = ShimOptions(
        vehicle=name, seed=seed, sensors=sensors, airborne_at_enu_m=(0.0, 0.0, 30.0)
    )
    vehicle = Vehicle(options, thrust_gains(config))
    vehicle.command(_SET_INTERVAL, float(MessageId.ODOMETRY), float(_SAMPLES_US))
    vehicle.fly(1.0, lambda _: Command())
    vehicle.command(_SET_MODE, *_OFFBOARD)
    vehicle.fly(_SETTLED_S, lambda _: Command())
    responses = {}
    for axis, size, hold_s in (
        ("roll", _TILT_STEP_RAD, 1.2),
        ("pitch", _TILT_STEP_RAD, 1.2),
        ("climb", _CLIMB_STEP_M_S, 2.5),
    ):
        steps, over_s = doublet(size, hold_s)

        def wanted(time_s: float, axis: str = axis, steps: list = steps) -> Command:
            value = sum(change for at, change in steps if time_s >= at)
            key = {"roll": "roll_rad", "pitch": "pitch_rad", "climb": "climb_m_s"}[axis]
            return Command(**{key: value})

        flown = vehicle.fly(over_s, wanted)
        states = [state for state, _ in flown]
        times = np.array([state.time_s for state in states])
        asked = [command.roll_rad + command.pitch_rad + command.climb_m_s for _, command in flown]
        # A step stands at the sample that it answered.
        changes = np.diff(asked, prepend=0.0)
        flown_steps = [(times[k], changes[k]) for k in np.flatnonzero(changes)]
        angles = np.array([euler_from_quaternion(s.attitude_flu_to_enu)[:2] for s in states])
        rates = np.array([state.velocity_enu_m_s[2] for state in states])
        answers = {"roll": angles[:, 0], "pitch": angles[:, 1], "climb": rates}[axis]
        responses[axis] = fit(times, answers, flown_steps, size)
        vehicle.fly(2.0, lambda _: Command())
    return responses, drag(vehicle), 2.0 * float(np.median(vehicle.ages_s))


def drag(vehicle: Vehicle) -> tuple[float, float]:
    """k1 (1/s) and k2 (1/m) of the drag ``k1 v + k2 v|v|`` per mass, of coasting level.

    What is left of the tilt while it coasts pushes with ``g tan(tilt)``: the thrust loop makes the
    vertical part of the thrust the weight.
    """
    vehicle.fly(4.0, lambda _: Command(pitch_rad=_RUN_TILT_RAD))
    vehicle.fly(0.8, lambda _: Command())
    states = [state for state, _ in vehicle.fly(6.0, lambda _: Command())]
    times = np.array([state.time_s for state in states])
    velocity = np.array([state.velocity_enu_m_s for state in states])
    ahead = velocity[0, :2] / np.hypot(*velocity[0, :2])
    speed = velocity[:, :2] @ ahead
    up = np.array([rotate(state.attitude_flu_to_enu, (0.0, 0.0, 1.0)) for state in states])
    push = GRAVITY_M_S2 * (up[:, :2] @ ahead) / up[:, 2]
    # Speed lost up to each time is the integral of the drag: no differences of noisy samples.
    steps = np.diff(times, prepend=times[0])
    lost = speed[0] - speed + np.cumsum(push * steps)
    columns = [np.cumsum(speed * steps), np.cumsum(speed * np.abs(speed) * steps)]
    (linear, quadratic), *_ = np.linalg.lstsq(np.stack(columns, axis=1), lost, rcond=None)
    return float(linear), float(quadratic)


def main() -> None:
    """Measure with several seeds and print each fit and the means."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("vehicle")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--sensors")
    arguments = parser.parse_args()
    measured = [
        measure(arguments.vehicle, seed, arguments.sensors) for seed in range(arguments.seeds)
    ]
    delay_s = float(np.mean([delay for *_, delay in measured]))
    print(f"{arguments.vehicle}: transport delay {delay_s * 1e3:.0f} ms (twice a sample's age)")
    print("axis    ωn rad/s   ζ      dead time ms  of it its own  gain   residual")
    for axis in measured[0][0]:
        rows = [responses[axis] for responses, *_ in measured]
        for row in rows:
            own_ms = (row.dead_time_s - delay_s) * 1e3
            print(
                f"{axis:6s}  {row.natural_frequency_rad_s:8.2f}  {row.damping:5.3f}  "
                f"{row.dead_time_s * 1e3:12.1f}  {own_ms:13.1f}  {row.gain:5.3f}  "
                f"{row.residual:8.4f}"
            )
        omega, zeta, dead_s = (
            float(np.mean([getattr(row, key) for row in rows]))
            for key in ("natural_frequency_rad_s", "damping", "dead_time_s")
        )
        print(f"  mean  {omega:8.2f}  {zeta:5.3f}  {dead_s * 1e3:12.1f}")
    for _, (linear, quadratic), _ in measured:
        print(f"drag per mass: {linear:.3f} v + {quadratic:.4f} v|v|")


if __name__ == "__main__":
    main()
