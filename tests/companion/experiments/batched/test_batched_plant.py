"""Of a simplified vehicle what its file says of the real one can be seen again."""

import math
from typing import Any

import numpy as np
import pytest

from companion.experiments.batched.air import Air
from companion.experiments.batched.draws import Draws
from companion.experiments.batched.plant import STEP_S, Fleet, Plants, make_plants
from companion.experiments.batched.task import BatchTask, read_tasks
from companion.experiments.flight_task import FlightTask

Plant = tuple[tuple[str, float], ...]


def plants_of(*plants: Plant) -> Plants:
    tasks = [BatchTask(FlightTask("mpc-l1", 4), plant) for plant in plants]
    [(laws, members)] = read_tasks(tasks)
    return make_plants(laws, [vehicle for _, vehicle in members])


def still(plants: Plants) -> Fleet:
    count = len(plants.link_delay_s)
    position = np.tile([[0.0], [0.0], [1.0]], count)
    return Fleet(plants, Air([()] * count, range(count), STEP_S), position)


def test_attitude_answers_after_its_delay_with_the_stated_lag() -> None:
    plants = plants_of((), (("plant.attitude_lag", 1.5),), (("plant.delay_s", 0.05),))
    fleet = still(plants)
    asked = np.tile([[0.1], [-0.05]], 3)
    answers = []
    for _ in range(500):
        fleet.step(asked, fleet.hover_field)
        answers.append(fleet.tilt_rad.copy())
    roll = np.array(answers)[:, 0]
    assert roll[-1] == pytest.approx([0.1] * 3, rel=1e-3)
    lag_s = (1.0 - roll / 0.1).sum(axis=0) * STEP_S  # dead time and 2 ζ / ωn
    response = 2.0 * 0.81 / 12.0
    wanted = [0.04 + response, 0.04 + 1.5 * response + 0.5 * 0.01, 0.09 + response]
    assert lag_s == pytest.approx(wanted, abs=0.5 * STEP_S + 1e-4)
    assert roll[: math.floor(0.04 / STEP_S), 0].tolist() == [0.0] * 10


def test_a_part_of_a_step_of_delay_counts() -> None:
    plants = plants_of(*((("plant.delay_s", 0.0005 * k),) for k in range(9)))
    fleet = still(plants)
    for _ in range(25):
        fleet.step(np.full((2, 9), 0.1), fleet.hover_field)
    assert (np.diff(fleet.tilt_rad[0]) < 0.0).all()


def test_it_hovers_and_falls_with_less_thrust() -> None:
    plants = plants_of((), (("plant.mass", 1.2),))
    fleet = still(plants)
    level = -plants.trim_rad  # reported, so that it is level in truth
    field = fleet.hover_field.copy()
    assert field[1] == pytest.approx(1.2 * field[0])
    field[1] *= 0.9
    for _ in range(250):
        fleet.step(level, field)
    assert fleet.velocity_m_s[2, 0] == pytest.approx(0.0, abs=1e-3)
    assert -1.0 < fleet.velocity_m_s[2, 1] < -0.8


def test_drag_is_the_stated_one_and_goes_with_the_relative_air() -> None:
    plants = plants_of((), (("plant.drag", 2.0),))
    steady = [{"kind": "steady", "velocity_enu_m_s": [3.0, 0.0, 0.0]}]
    fleet = Fleet(plants, Air([steady] * 2, [1, 2], STEP_S), np.zeros((3, 2)))
    fleet.step(np.zeros((2, 2)), fleet.hover_field)
    push = 0.15 * 3.0 + 0.02 * 9.0
    assert fleet.wind_m_s2 == pytest.approx([push, 2.0 * push])


def test_gusts_have_the_stated_size_and_jets_their_profile() -> None:
    gusts: dict[str, Any] = {
        "kind": "dryden",
        "intensity_m_s": 1.0,
        "altitude_m": 3.0,
        "passing_speed_m_s": 3.5,
        "direction_enu": [2.8, 2.1, 0.0],
    }
    air = Air([[gusts]] * 400, range(400), 0.5)
    seen = np.array([air.velocity(np.zeros((3, 400))) for _ in range(40)])
    assert seen[:, :2].std() == pytest.approx(1.0, rel=0.1)
    assert seen.mean() == pytest.approx(0.0, abs=0.05)
    jet: dict[str, Any] = {
        "kind": "jet",
        "crossing_enu_m": [0.0, 0.0, 1.0],
        "direction_enu": [2.0, 0.0, 0.0],
        "fan_distance_m": 1.5,
        "peak_m_s": 4.0,
        "width_m": 0.4,
        "turbulence": 0.0,
        "correlation_time_s": 0.1,
    }
    places = np.array([[0.0, 0.0, 1.0], [5.0, 0.4, 1.0], [-2.0, 0.0, 1.0]]).T
    blown = Air([[jet]] * 3, [1, 2, 3], STEP_S).velocity(places)
    assert blown[0] == pytest.approx([4.0, 4.0 * math.exp(-0.5), 0.0])
    assert not blown[1:].any()


def test_a_vehicle_draws_the_same_whoever_is_beside_it() -> None:
    alone, among = Draws([7], 0, 2), Draws([1, 7, 3], 0, 2)
    for _ in range(300):
        assert alone.next()[:, 0].tolist() == among.next()[:, 1].tolist()
