"""Each perturbation is what its name says: measured through MAVLink, or on the plant."""

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
import yaml
from scipy.optimize import least_squares

from companion.experiments import fly_task as flying
from companion.experiments.flight_task import FlightTask
from companion.experiments.fly_task import fly_task
from companion.experiments.perturbations import PERTURBATIONS, perturbed_plant
from companion.lockstep import fly_in_lockstep
from companion.report.flight_data import is_truth_packet
from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import load_vehicle
from sitl_shim.simulation import ShimOptions
from sitl_shim.wind.field import CALM, SteadyWind
from tests.flights.bench import SHORT
from tests.sitl_shim.autopilot.copter_client import CopterClient, tilted
from tests.sitl_shim.mavlink.shim_client import OFFBOARD, ShimClient

_ATTITUDE, _ODOMETRY, _ATTITUDE_TARGET = 30, 331, 83
_SEQUENCE = 4
"""Place of the packet's number in a MAVLink 2 packet."""
_STEP_DEG = 5.0
_FITTED_S = 0.8
_PX4 = ("bebop2", "x500", "sih_quadx")
_FLOWN = [(v, "px4") for v in _PX4] + [(v, "ardupilot") for v in (*_PX4, "arducopter")]
_LAGS = {"lag+25": 1.25, "lag-25": 0.75, "lag+50": 1.5, "slow+25": 1.25, "slow+50": 1.5}


@cache
def _plant(vehicle, perturbation):
    """The perturbed vehicle, in the shim's own words."""
    with TemporaryDirectory() as folder:
        path = perturbed_plant(vehicle, PERTURBATIONS[perturbation], Path(folder))
        return load_vehicle(vehicle if path is None else path)


def _client(vehicle, flavour, perturbation, folder):
    path = perturbed_plant(vehicle, PERTURBATIONS[perturbation], folder)
    made = CopterClient if flavour == "ardupilot" else ShimClient
    client = made(
        ShimOptions(
            autopilot=flavour,
            vehicle=path or vehicle,
            sensors="exact",
            seed=1,
            airborne_at_enu_m=(0.0, 0.0, 30.0),
        )
    )
    client.run(1.0)
    return client


def _second_order(times_s, omega, zeta):
    t = np.maximum(times_s, 0.0)
    root = np.sqrt(complex(zeta * zeta - 1.0 + 1e-12))
    fast, slow = omega * (-zeta - root), omega * (-zeta + root)
    return np.real(1.0 - (fast * np.exp(slow * t) - slow * np.exp(fast * t)) / (fast - slow))


def _fitted(times_s, response):
    """(lag, ωn, ζ) of a step: dead time and 2 ζ / ωn together."""
    use = times_s < _FITTED_S

    def residuals(p):
        return p[3] * _second_order(times_s[use] - p[2], p[0], p[1]) - response[use]

    fit = least_squares(
        residuals, [8.0, 0.9, 0.03, 1.0], bounds=([1, 0.2, 0, 0.5], [60, 4, 0.3, 1.5]),
        diff_step=1e-4,
    )  # fmt: skip
    omega, zeta, dead_s, _ = fit.x
    assert np.sqrt(np.mean(fit.fun**2)) < 0.02
    return 2.0 * zeta / omega + dead_s, omega, zeta


@cache
def _step(vehicle, flavour, perturbation):
    """Lag of a step of roll and of pitch, without the command's transport; ωn and ζ of roll."""
    with TemporaryDirectory() as folder:
        client = _client(vehicle, flavour, perturbation, Path(folder))
    hover = client.simulation.vehicle.autopilot_parameters.get("MPC_THR_HOVER", 0.5)

    def send(q):
        if flavour == "px4":
            client.setpoint(q, hover)
        else:
            client.climb(0.0, q)

    client.set_interval(_ATTITUDE, 4000)
    stop = client.every(0.004, lambda: send(tilted()))
    client.run(0.2)
    if flavour == "px4":
        client.set_mode(OFFBOARD)
    client.run(1.0)
    stop()
    client.forget()
    begin_s = client.time_s + client.simulation.vehicle.command_delay_s
    # Small enough that the two axes leave each other alone.
    client.every(0.004, lambda: send(tilted(_STEP_DEG, _STEP_DEG)))
    client.run(1.0)
    messages = client.messages("ATTITUDE")
    times = np.array([m.time_boot_ms / 1e3 for m in messages]) - begin_s
    found = []
    for axis in ("roll", "pitch"):
        angles = np.degrees([getattr(m, axis) for m in messages]) / _STEP_DEG
        found.append(_fitted(times, angles - angles[:3].mean()))
    (roll_s, omega, zeta), (pitch_s, _, _) = found
    return roll_s, pitch_s, omega, zeta


@pytest.mark.parametrize(("vehicle", "flavour"), _FLOWN)
@pytest.mark.parametrize("perturbation", _LAGS)
def test_the_attitude_lags_by_the_factor_under_both_autopilots(vehicle, flavour, perturbation):
    nominal = _step(vehicle, flavour, "nominal")
    perturbed = _step(vehicle, flavour, perturbation)
    for k in range(2):
        assert perturbed[k] / nominal[k] == pytest.approx(_LAGS[perturbation], rel=0.03)


@pytest.mark.parametrize(("vehicle", "flavour"), _FLOWN[:6])
def test_a_slower_attitude_keeps_its_damping_and_one_that_lags_gains_some(vehicle, flavour):
    _, _, omega, zeta = _step(vehicle, flavour, "nominal")
    _, _, slower_omega, slower_zeta = _step(vehicle, flavour, "slow+50")
    _, _, lagging_omega, lagging_zeta = _step(vehicle, flavour, "lag+50")
    assert slower_zeta == pytest.approx(zeta, rel=0.08)
    assert slower_omega < 0.7 * omega
    assert lagging_zeta > 1.2 * zeta
    assert 0.78 * omega < lagging_omega < 0.9 * omega


def _full_thrust_m_s2(vehicle, perturbation):
    """Acceleration by all rotors at full signal once they have come up, but for gravity's."""
    plant = Plant(_plant(vehicle, perturbation), CALM, seed=1, airborne_at_enu_m=(0.0, 0.0, 30.0))
    speeds = [plant.step((1.0,) * 4).velocity_enu_m_s[2] for _ in range(101)]
    model, speed = _plant(vehicle, perturbation), speeds[-1]
    drag_n = (model.drag.linear_n_s_m[2] + model.drag.quadratic_n_s2_m2 * speed) * speed
    return (speeds[-1] - speeds[-2]) / 0.004 + 9.80665 + drag_n / model.mass_kg


def _wind_m_s2(vehicle, perturbation):
    """Acceleration of a hovering vehicle by a wind of 4 m/s."""
    wind = SteadyWind((4.0, 0.0, 0.0))
    plant = Plant(_plant(vehicle, perturbation), wind, seed=1, airborne_at_enu_m=(0.0, 0.0, 30.0))
    return plant.state.acceleration_enu_m_s2[0]


@pytest.mark.parametrize("vehicle", _PX4)
@pytest.mark.parametrize(
    ("perturbation", "factor"),
    [("mass+20", 1 / 1.2), ("mass-20", 1 / 0.8), ("thrust+15", 1.15), ("thrust-15", 0.85)],
)
def test_mass_and_thrust_change_what_full_thrust_accelerates(vehicle, perturbation, factor):
    ratio = _full_thrust_m_s2(vehicle, perturbation) / _full_thrust_m_s2(vehicle, "nominal")
    assert ratio == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize("vehicle", _PX4)
@pytest.mark.parametrize(
    ("perturbation", "factor"),
    [
        ("dragx2", 2.0),
        ("combo", 2.0),
        ("mass+20", 1 / 1.2),
        ("mass-20", 1 / 0.8),
        ("thrust+15", 1.0),
        ("thrust-15", 1.0),
    ],
)
def test_drag_is_doubled_and_a_heavier_vehicle_is_pushed_less_by_wind(
    vehicle, perturbation, factor
):
    ratio = _wind_m_s2(vehicle, perturbation) / _wind_m_s2(vehicle, "nominal")
    assert ratio == pytest.approx(factor, rel=1e-6)


def _delays(vehicle, flavour, perturbation, folder):
    """Least age of a state on arrival, and least time until a setpoint is in force, s."""
    client = _client(vehicle, flavour, perturbation, folder)
    client.set_interval(_ATTITUDE, 8000)
    client.run(0.3)
    ages = [at - m.time_boot_ms / 1e3 for at, m in client.received("ATTITUDE")]
    asked = []

    def note(target):
        asked.append((client.time_s, target.thrust))

    autopilot = client.simulation.autopilot
    original = autopilot.receive_attitude_target
    autopilot.receive_attitude_target = lambda target: (note(target), original(target))
    waits = []
    for k in range(5):
        sent_s = client.time_s
        client.setpoint(tilted(), 0.4 + 0.01 * k)
        client.run(0.15)
        waits.append(asked[-1][0] - sent_s)
    assert [thrust for _, thrust in asked] == pytest.approx([0.4 + 0.01 * k for k in range(5)])
    return min(ages), min(waits)


@pytest.mark.parametrize(("vehicle", "flavour"), [("bebop2", "px4"), ("x500", "ardupilot")])
@pytest.mark.parametrize(
    ("perturbation", "more_s"), [("delay+20ms", 0.020), ("delay+40ms", 0.040), ("combo", 0.020)]
)
def test_half_of_a_delay_is_on_the_way_there_and_half_on_the_way_back(
    vehicle, flavour, perturbation, more_s, tmp_path
):
    nominal = _delays(vehicle, flavour, "nominal", tmp_path)
    perturbed = _delays(vehicle, flavour, perturbation, tmp_path)
    assert perturbed[0] - nominal[0] == pytest.approx(more_s / 2, abs=1e-6)
    assert perturbed[1] - nominal[1] == pytest.approx(more_s / 2, abs=0.0041)  # ticks of 4 ms


def test_the_combination_lags_by_a_quarter():
    combined, nominal = _step("bebop2", "px4", "combo"), _step("bebop2", "px4", "nominal")
    assert combined[0] / nominal[0] == pytest.approx(1.25, rel=0.03)


class _Listener:
    """Hears what arrives, and knows by the packets' numbers what did not."""

    def __init__(self):
        self.lost = {"truth": [], "telemetry": []}
        self._numbers = {}

    def __call__(self, data):
        kind, number = "truth" if is_truth_packet(data) else "telemetry", data[_SEQUENCE]
        if kind in self._numbers:
            self.lost[kind] += [True] * ((number - self._numbers[kind] - 1) & 0xFF)
        self.lost[kind].append(False)
        self._numbers[kind] = number
        return data


def test_a_tenth_of_the_packets_is_lost_by_chance_and_the_same_ones_each_time(
    tmp_path, monkeypatch
):
    path = tmp_path / "short.csv"
    path.write_text(SHORT)
    listeners = []

    def listening(*arguments, **options):
        listeners.append(_Listener())
        return fly_in_lockstep(*arguments, from_shim=listeners[-1], **options)

    monkeypatch.setattr(flying, "fly_in_lockstep", listening)
    faults = PERTURBATIONS["loss10"].faults
    assert yaml.safe_load(faults) == {"link": [{"loss": 0.1}]}  # both ways, all the time
    task = FlightTask("mpc-l1", str(path), settings=(("hover_s", "0.5"),))

    whole = fly_task(task)
    first, second = (fly_task(replace(task, faults=faults)) for _ in range(2))

    assert first.outcome == "tracked"
    assert first.mean_error_m == second.mean_error_m != whole.mean_error_m
    sound, hurt, again = (listener.lost for listener in listeners)
    assert not any(sound["telemetry"])
    assert hurt == again
    assert len(hurt["truth"]) > 500
    assert not any(hurt["truth"])
    lost = hurt["telemetry"]
    count = len(lost)
    assert count > 400
    assert abs(np.mean(lost) - 0.1) < 3.0 * math.sqrt(0.1 * 0.9 / count)
    # By chance: a lost packet says nothing of the next one.
    pairs = np.mean([a and b for a, b in pairwise(lost)])
    assert abs(pairs - 0.01) < 3.0 * math.sqrt(0.01 / count)
