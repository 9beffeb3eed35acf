"""Controllers, trajectories, winds and vehicles of one's own in lockstep flights."""

import math
import os
import signal
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from companion.api import (
    AccelerationSetpoint,
    ControllerError,
    ControlSample,
    InputError,
    Motion,
    VehicleState,
    fly,
    make_trajectory,
    plant_of,
    read_flight,
    vehicle_of,
    write_yaml,
)
from companion.flight.conduct import conduct
from companion.flight.own_parts import OwnController
from companion.flight.replay import recorded
from companion.flight.replay.recorded import ReplayError

SHORT = make_trajectory(
    lambda s: (0.3 * math.sin(s), 0.3 * math.cos(s), 1.2), 4.0, name="short circle"
)


class Springs:
    """Springs and dampers towards the desired motion; goes wrong on request."""

    def __init__(self, fails_at_s: float = math.inf, gives_nan_at_s: float = math.inf) -> None:
        self.fails_at_s, self.gives_nan_at_s = fails_at_s, gives_nan_at_s

    def start(self, state: VehicleState) -> None:
        pass

    def step(self, sample: ControlSample) -> AccelerationSetpoint:
        if sample.track_s > self.fails_at_s:
            raise KeyError("a mistake")
        if sample.track_s > self.gives_nan_at_s:
            return AccelerationSetpoint((math.nan, 0.0, 0.0))
        motion = sample.reference.motion(np.array([0.0, sample.loop_delay_s + 0.11]))
        x, y, z = (
            motion.acceleration_enu_m_s2[1]
            + 9.0 * (motion.position_enu_m[0] - sample.state.position_enu_m)
            + 4.5 * (motion.velocity_enu_m_s[0] - sample.state.velocity_enu_m_s)
        )
        return AccelerationSetpoint((x, y, z))


@pytest.mark.parametrize(
    "how", [{"autopilot": "px4", "setpoint": "rates"}, {"autopilot": "ardupilot"}]
)
def test_a_controller_flies_whatever_the_autopilot_and_the_setpoint_are(how):
    flight = fly(SHORT, Springs(), seed=1, **how)
    assert flight.completed
    assert flight.controller == "Springs"
    assert flight.mean_error_m < 0.04


def test_it_takes_off_and_lands_too():
    flight = fly(SHORT, Springs(), seed=1, whole=True)
    assert flight.outcome == "landed"
    assert flight.mean_error_m < 0.04


def test_a_controller_that_raises_ends_the_call_with_its_own_exception():
    with pytest.raises(ControllerError, match="Springs failed in flight") as caught:
        fly(SHORT, Springs(fails_at_s=2.0))
    assert isinstance(caught.value.__cause__, KeyError)


def test_a_controller_that_raises_is_relieved_by_its_fallback():
    flight = fly(SHORT, Springs(fails_at_s=2.0), fallback="mpc-l1")

    assert flight.completed
    ticks = flight.ticks
    assert set(ticks.controller[(ticks.track_s > 0.5) & (ticks.track_s < 1.9)]) == {"Springs"}
    assert set(ticks.controller[ticks.track_s > 2.1]) == {"mpc-l1"}
    assert any("Springs → mpc-l1" in text and "KeyError" in text for text in flight.warnings)


def test_what_is_not_finite_never_leaves_and_the_vehicle_is_handed_over():
    flight = fly(SHORT, Springs(gives_nan_at_s=2.0))

    assert (flight.outcome, flight.completed) == ("aborted", False)
    assert "not finite" in flight.note
    assert math.isinf(flight.mean_error_m)
    sent = flight.ticks.thrust[np.isfinite(flight.ticks.thrust)]
    assert ((sent >= 0.0) & (sent <= 1.0)).all()
    late = flight.ticks.track_s > 2.02
    assert flight.ticks.on_fallback[late].all()


def test_a_planned_hand_over_relieves_it_too():
    flight = fly(SHORT, Springs(), settings={"switch": ["t=2:mpc-l1"]})

    assert flight.completed
    late = flight.ticks.track_s > 2.1
    assert set(flight.ticks.controller[late]) == {"mpc-l1"}


async def test_it_never_flies_in_real_time():
    own = OwnController(Springs(), "Springs", None)
    nothing: Any = None
    with pytest.raises(ValueError, match="only a simulated vehicle"):
        await conduct(nothing, nothing, nothing, nothing, nothing, nothing, real_time=True, own=own)


def test_its_log_says_that_it_cannot_be_replayed(tmp_path):
    fly(SHORT, Springs(), folder=tmp_path)

    with pytest.raises(ReplayError):
        recorded.read_flight(tmp_path)
    read = read_flight(tmp_path)
    assert (read.controller, read.completed) == ("Springs", True)


@pytest.mark.parametrize("given", [Springs, object(), 4.0])
def test_what_is_no_controller_is_refused(given):
    with pytest.raises(InputError, match=r"is a class|is no controller"):
        fly(SHORT, given)


def test_a_wind_pushes_the_vehicle_where_it_blows():
    def gale(time_s: float, position_enu_m: tuple[float, float, float]):
        return (0.0, 8.0 if time_s > 1.0 else 0.0, 0.0)

    flight = fly(SHORT, wind=gale, seed=1)
    assert flight.wind == "gale"
    assert flight.figures.wind_peak_m_s2 > 2.0


@pytest.mark.parametrize(
    ("given", "says"),
    [((0.0, math.nan, 0.0), "finite ones"), ((0.0, 0.0), "three numbers"), (None, "three numbers")],
)
@pytest.mark.parametrize("from_s", [0.0, 3.0])
def test_a_wind_that_is_none_is_told(given, says, from_s):
    def wind(time_s: float, position_enu_m: tuple[float, float, float]):
        return given if time_s >= from_s else (0.0, 0.0, 0.0)

    with pytest.raises(ValueError, match=says):
        fly(SHORT, wind=wind)


def test_an_exception_of_a_wind_reaches_the_caller_and_leaves_no_folder(tmp_path):
    def wind(time_s: float, position_enu_m: tuple[float, float, float]):
        if time_s > 5.0:
            raise ZeroDivisionError
        return (0.0, 0.0, 0.0)

    with pytest.raises(ZeroDivisionError):
        fly(SHORT, wind=wind, folder=tmp_path / "flight")
    assert list(tmp_path.iterdir()) == []


def test_own_parts_give_the_same_flight_each_time():
    def gusty(seed: int):
        generator = np.random.default_rng(seed)

        def gusts(time_s: float, position_enu_m: tuple[float, float, float]):
            return tuple(generator.normal(0.0, 1.0, 3))

        return gusts

    one, other = (fly(SHORT, Springs(), wind=gusty(seed=5), seed=1) for _ in range(2))
    assert np.array_equal(one.ticks.thrust, other.ticks.thrust, equal_nan=True)
    assert np.array_equal(one.truth.position_enu_m, other.truth.position_enu_m)
    assert one.figures.wind_peak_m_s2 > 0.2


def test_ctrl_c_lands_the_simulated_vehicle_and_ends_the_call():
    asked: list[float] = []

    def wind(time_s: float, position_enu_m: tuple[float, float, float]):
        if time_s > 5.0 and not asked:
            os.kill(os.getpid(), signal.SIGINT)
            asked.append(position_enu_m[2])
        return (0.0, 0.0, 0.0)

    with pytest.raises(KeyboardInterrupt):
        fly(SHORT, wind=wind)
    assert asked[0] > 0.5


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_other_signals_land_it_and_then_do_what_they_did_before(number, monkeypatch):
    came: list[tuple[int, str]] = []
    before = signal.signal(number, lambda given, _: came.append((given, "mine")))
    interrupts = signal.getsignal(signal.SIGINT)

    def wind(time_s: float, position_enu_m: tuple[float, float, float]):
        if time_s > 5.0 and not asked:
            asked.append(time_s)
            os.kill(os.getpid(), number)
        return (0.0, 0.0, 0.0)

    asked: list[float] = []
    try:
        flight = fly(SHORT, wind=wind)
        assert not flight.completed
        assert came == [(number, "mine")]
        assert signal.getsignal(number)(number, None) is None
        assert signal.getsignal(signal.SIGINT) is interrupts
    finally:
        signal.signal(number, before)


@dataclass(frozen=True)
class Bob:
    """A trajectory of a class of one's own."""

    name: str = "bob"
    scored_s: float = 4.0
    end_s: float = 4.0
    lift_m: float = 0.3
    jolt_m_s: float = 0.0
    offset_m: float = 0.0

    def _height(self, times_s):
        return 1.2 + self.lift_m * (1.0 - np.cos(np.pi * times_s / 2.0))

    def position(self, times_s):
        times = np.clip(times_s, 0.0, self.end_s)
        zero = np.zeros_like(times)
        return np.stack([zero + self.jolt_m_s * times, zero, self._height(times)], axis=1)

    def position_at(self, time_s):
        x, y, z = self.position(np.array([time_s]))[0].tolist()
        return x, y + self.offset_m, z

    def motion(self, times_s):
        inside = (times_s >= 0.0) & (times_s <= self.end_s)
        speed, bend = np.zeros((len(times_s), 3)), np.zeros((len(times_s), 3))
        rate = np.pi / 2.0
        speed[:, 0] = np.where(inside, self.jolt_m_s, 0.0)
        speed[:, 2] = np.where(inside, self.lift_m * rate * np.sin(rate * times_s), 0.0)
        bend[:, 2] = np.where(inside, self.lift_m * rate**2 * np.cos(rate * times_s), 0.0)
        return Motion(self.position(times_s), speed, bend)


def test_an_object_with_the_protocol_is_a_trajectory():
    flight = fly(Bob())
    assert (flight.trajectory, flight.completed) == ("bob", True)
    assert flight.mean_error_m < 0.05


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (Bob(jolt_m_s=0.2), "must begin and end at rest"),
        (Bob(offset_m=0.1), "position_at and position differ"),
        (Bob(lift_m=math.nan), "not finite"),
        (Bob(end_s=3.0), "scored_s ≤ end_s"),
        (Bob(lift_m=2.0), "needs"),
        (Bob(scored_s="5"), "'bob': TypeError"),
        (Bob(end_s=math.inf), "end_s < ∞"),
    ],
)
def test_a_trajectory_that_contradicts_itself_is_refused(given, says):
    with pytest.raises(InputError, match=says):
        fly(given)


def test_a_function_may_bring_its_derivatives_and_wrong_ones_are_told():
    def position(s):
        return np.array([math.sin(s), 0.0, 1.2])

    def velocity(s):
        return np.array([math.cos(s), 0.0, 0.0])

    def acceleration(s):
        return np.array([-math.sin(s), 0.0, 0.0])

    times = np.linspace(-1.0, 12.0, 400)
    plain = make_trajectory(position, 8.0).motion(times)
    given = make_trajectory(position, 8.0, velocity=velocity, acceleration=acceleration)
    for by_formula in (given, make_trajectory(position, 8.0, velocity=velocity)):
        motion = by_formula.motion(times)
        assert motion.velocity_m_s == pytest.approx(plain.velocity_m_s, abs=1e-5)
        assert motion.acceleration_m_s2 == pytest.approx(plain.acceleration_m_s2, abs=1e-4)
    with pytest.raises(InputError, match="the velocity of 'own' is not what its positions say"):
        make_trajectory(position, 8.0, velocity=acceleration)
    with pytest.raises(InputError, match="the acceleration of 'own' is not"):
        make_trajectory(position, 8.0, velocity=velocity, acceleration=velocity)


def test_the_derivatives_of_a_function_are_those_of_its_positions_also_in_the_ramps():
    made = make_trajectory(lambda s: (math.sin(2.0 * s), s * s / 50.0, 1.2), 6.0)
    times = np.linspace(-0.5, 8.5, 301)
    h = 1e-4
    before, now, after = (made.position(times + k * h) for k in (-1.0, 0.0, 1.0))
    motion = made.motion(times)
    assert motion.velocity_m_s == pytest.approx((after - before) / (2 * h), abs=1e-5)
    assert motion.acceleration_m_s2 == pytest.approx((after - 2 * now + before) / h**2, abs=2e-3)
    assert np.array_equal([made.position_at(t) for t in times.tolist()], now)


@pytest.mark.parametrize(
    ("function", "duration_s", "says"),
    [
        (lambda s: (0.0, 0.0), 8.0, r"gives \(x, y, z\)"),
        (lambda s: (0.0, 0.0, math.nan if s > 7.9 else 1.0), 8.0, "not finite"),
        (lambda s: (0.0, 0.0, 1.0), 3.0, "takes 4 to 3600 s"),
        (lambda s: (0.0, 0.0, 1.0), math.nan, "takes 4 to 3600 s"),
        (lambda s: (0.0, 0.0, 1.0), "10", "10|str"),
        (5, 8.0, "not callable"),
    ],
)
def test_a_function_that_makes_no_trajectory_is_refused(function, duration_s, says):
    with pytest.raises(InputError, match=says):
        make_trajectory(function, duration_s)


def test_a_plant_of_ones_own_flies_from_the_command_too(tmp_path):
    from companion.config.resolve import load_flight
    from companion.flight.embedded_shim import embedded_shim

    plant = plant_of("bebop2")
    plant["mass_kg"] *= 1.2
    file = write_yaml(tmp_path / "plant.yaml", plant)
    vehicle = vehicle_of("bebop2") | {"hover_thrust": 0.6}
    known = write_yaml(tmp_path / "vehicle.yaml", vehicle)
    (tmp_path / "mission.yaml").write_text("plant: plant.yaml\nvehicle: vehicle.yaml\n")

    flight = fly(SHORT, vehicle=known, plant=file, seed=1)
    assert flight.completed
    hovers_at = flight.ticks.hover_thrust[flight.ticks.track_s > 1.0].mean()
    assert hovers_at == pytest.approx(0.49 * 1.2, rel=0.05)
    config = load_flight(tmp_path / "mission.yaml", {}, {})
    assert embedded_shim(config).vehicle == str(file)


def test_a_plant_is_refused_for_a_real_vehicle(tmp_path):
    from companion.config.resolve import load_flight
    from companion.config.yaml_source import ConfigError
    from companion.flight.beginning import shim_options

    given = {"connect": "udpin://127.0.0.1:14540", "plant": "plant.yaml"}
    with pytest.raises(ConfigError, match="`plant` belongs to the embedded shim"):
        shim_options(load_flight(None, given, {}), lockstep=False)


def test_a_shipped_vehicles_data_is_a_copy():
    plant_of("bebop2")["mass_kg"] = 0.0
    vehicle_of("bebop2")["hover_thrust"] = 0.0
    assert plant_of("bebop2")["mass_kg"] == 0.5
    assert vehicle_of("bebop2")["hover_thrust"] == 0.5
    for read in (plant_of, vehicle_of):
        with pytest.raises(InputError, match="bebop2"):
            read("bebop3")


def test_only_plain_values_are_written(tmp_path):
    with pytest.raises(InputError, match="only numbers, texts, lists and mappings"):
        write_yaml(tmp_path / "plant.yaml", {"mass_kg": np.float64(0.5)})
    assert not (tmp_path / "plant.yaml").exists()
