"""Compiled equations give the bits of plain ones; without numba, or switched off, all is plain."""

import hashlib
import math
import os
import subprocess
import sys

import numpy as np
import pytest

from sitl_shim import compiled as module
from sitl_shim.autopilot.ardupilot import laws as ardupilot
from sitl_shim.autopilot.px4 import laws as px4
from sitl_shim.compiled import BOOLEAN, FLOAT, VARIABLE, compiled
from sitl_shim.frames import quaternion_from_euler
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import load_vehicle
from sitl_shim.simulation import ShimOptions
from sitl_shim.wind import load_scenario, make_wind
from tests.sitl_shim.mavlink.shim_client import ShimClient

KINDS = ("0", "1")
NAN = math.nan


@pytest.fixture
def numba():
    return pytest.importorskip("numba")


def plant_states(steps):
    """A flight from the ground by arbitrary commands, through a wind, into the ground again."""
    scenario = load_scenario("fan-4")
    plant = Plant(load_vehicle("x500"), make_wind(scenario, 5), seed=5)
    random = np.random.default_rng(7)
    states = []
    for k in range(steps):
        share = 0.9 if k < steps // 2 else 0.2
        states.append(plant.step((share + 0.02 * random.standard_normal(4)).tolist()))
    return states


def test_a_plant_moves_by_the_same_bits(numba, monkeypatch):
    flights = []
    for kind in KINDS:
        monkeypatch.setenv(VARIABLE, kind)
        flights.append(plant_states(2500))
    assert max(state.position_enu_m[2] for state in flights[0]) > 5.0
    assert {state.on_ground for state in flights[0]} == {True, False}
    assert flights[0] == flights[1]


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_whole_vehicle_sends_the_same_bytes(numba, monkeypatch, autopilot):
    digests = []
    for kind in KINDS:
        monkeypatch.setenv(VARIABLE, kind)
        client = ShimClient(
            ShimOptions(
                autopilot=autopilot,
                scenario="wind3",
                seed=3,
                airborne_at_enu_m=(0.0, 0.0, 5.0),
                boot_scale=0.02,
            ),
            (LinkKind.ONBOARD, LinkKind.GROUND_STATION),
        )
        client.set_mode(6 << 16 if autopilot == "px4" else 4)
        client.every(0.02, lambda client=client: client.setpoint(q=(0.99, 0.1, 0.05, 0)))
        client.run(4.0)
        frames = client.frames(0) + client.frames(1)
        assert len(frames) > 50
        digests.append(hashlib.sha256(b"".join(frames)).hexdigest())
    assert digests[0] == digests[1]


def same(first, second):
    """Whether nested tuples of floats are the same, NaN included."""
    if isinstance(first, tuple):
        return all(same(a, b) for a, b in zip(first, second, strict=True))
    return first == second or (first != first and second != second)


def attitudes(random):
    roll, pitch, yaw = random.uniform(-math.pi, math.pi, 3)
    return quaternion_from_euler(roll, 0.5 * pitch, yaw)


def test_laws_of_px4_give_the_same_bits(numba, monkeypatch):
    monkeypatch.setenv(VARIABLE, "1")
    attitude_law = compiled(px4.attitude_rates, 7, 4, 4, FLOAT)
    torque_law = compiled(px4.axis_torque, 5, 7, 5, FLOAT, FLOAT, BOOLEAN, FLOAT)
    assert attitude_law is not px4.attitude_rates
    random = np.random.default_rng(1)
    gains = (0.4, 6.5, 6.5, 7.0, 3.8, 3.8, 3.5)
    special = [(0.0,) * 4, (NAN, 0.0, 0.0, 1.0), (1e-5, 0.0, 0.0, 0.0), (math.inf, 0.0, 0.0, 0.0)]
    wanted = special + [attitudes(random) for _ in range(300)]
    for setpoint in wanted:
        case = (gains, attitudes(random), setpoint, random.choice([0.0, 0.3, NAN]))
        assert same(attitude_law(*case), px4.attitude_rates(*case))
    gyro = (1.0, 0.2, 0.4, 0.2, -0.4, 0.2, 0.5)
    for _ in range(300):
        case = (
            (0.15, 0.2, 0.003, 0.1, 0.3),
            gyro,
            tuple(random.standard_normal(5).tolist()),
            float(random.standard_normal()),
            float(random.choice([NAN, 0.0, 3.0, -9.0])),
            bool(random.integers(2)),
            float(random.integers(-1, 2)),
        )
        assert same(torque_law(*case), px4.axis_torque(*case))


def test_laws_of_ardupilot_give_the_same_bits(numba, monkeypatch):
    monkeypatch.setenv(VARIABLE, "1")
    parts = ardupilot.ATTITUDE_PARTS
    follow = compiled(ardupilot.follow_attitude, *(6, 7, 4, 3, 4, 4, 3, BOOLEAN), parts=parts)
    turn = compiled(ardupilot.follow_rates, *(6, 7, 4, 3, 4, 3, BOOLEAN), parts=parts)
    torque_law = compiled(ardupilot.axis_torque, 8, 6, 7, FLOAT, FLOAT, BOOLEAN)
    random = np.random.default_rng(2)
    gains, shape = (4.5, 4.5, 4.5, 10.0, 10.0, 2.0), (19.0, 19.0, 5.0, 0.0, 4.0, 2.0, 0.15)
    for _ in range(2000):
        rate = tuple(random.standard_normal(3).tolist()) if random.integers(2) else (0.0,) * 3
        begin = (gains, shape, attitudes(random), rate, attitudes(random))
        shapes = bool(random.integers(2))
        case = (*begin, attitudes(random), rate, shapes)
        assert same(follow(*case), ardupilot.follow_attitude(*case))
        case = (*begin, rate, shapes)
        assert same(turn(*case), ardupilot.follow_rates(*case))
        case = (
            (0.14, 0.1, 0.004, 0.05, 0.5, 0.4, 1.0, 0.4),
            (1.0, 0.2, 0.4, 0.2, -0.4, 0.2),
            (float(random.integers(2)), *random.standard_normal(6).tolist()),
            float(random.standard_normal()),
            float(random.standard_normal()),
            bool(random.integers(2)),
        )
        assert same(torque_law(*case), ardupilot.axis_torque(*case))


def test_switched_off_equations_are_themselves(monkeypatch):
    monkeypatch.setenv(VARIABLE, "0")
    assert compiled(px4.attitude_rates, 7, 4, 4, FLOAT) is px4.attitude_rates


def test_without_numba_equations_are_themselves(monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    assert compiled(px4.attitude_rates, 7, 4, 4, FLOAT) is px4.attitude_rates


COMPILES = """
from sitl_shim.autopilot.ardupilot.laws import shape_rate
from sitl_shim.compiled import FLOAT, compiled
law = compiled(shape_rate, FLOAT, FLOAT, FLOAT)
assert law is not shape_rate and law(1.0, 2.0, 0.5) == shape_rate(1.0, 2.0, 0.5)
"""


def run_with_cache(folder):
    settings = {**os.environ, "NUMBA_CACHE_DIR": str(folder), VARIABLE: "1"}
    subprocess.run([sys.executable, "-c", COMPILES], check=True, env=settings)


def test_a_second_process_finds_what_the_first_has_compiled(numba, tmp_path):
    run_with_cache(tmp_path)
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nb?")}
    assert len(kept) == 2  # an index, and the code
    run_with_cache(tmp_path)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nb?")} == kept


def test_where_nothing_can_be_kept_it_is_compiled_all_the_same(numba, monkeypatch):
    monkeypatch.setenv(VARIABLE, "1")

    def refuse(*_, **__):
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr("numba.core.dispatcher.FunctionCache", refuse)
    law = compiled(ardupilot.rotation_vector, 4)
    assert law is not ardupilot.rotation_vector
    assert law((0.8, 0.6, 0.0, 0.0)) == ardupilot.rotation_vector((0.8, 0.6, 0.0, 0.0))


def test_another_part_gives_another_name():
    first = module._named_after_its_code(px4.rate_torques, (px4.axis_torque,))
    second = module._named_after_its_code(px4.rate_torques, (ardupilot.axis_torque,))
    again = module._named_after_its_code(px4.rate_torques, (px4.axis_torque,))
    assert first.__qualname__ == again.__qualname__ != second.__qualname__
