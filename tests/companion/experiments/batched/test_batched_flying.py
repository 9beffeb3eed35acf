"""Batches fly as single flights do, or are refused."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from companion.config.yaml_source import ConfigError
from companion.experiments.batched.flying import fly_batch, fly_batch_told
from companion.experiments.batched.task import BatchTask, check_batch
from companion.experiments.flight_task import FlightTask
from companion.experiments.fly_task import fly_task


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> FlightTask:
    """Three seconds after a hover of one."""
    path = tmp_path_factory.mktemp("short") / "path.csv"
    rows = [f"{t},{0.3 - 0.3 * math.cos(2 * math.pi * t / 3):.6f},0,1" for t in range(4)]
    path.write_text("t,x,y,z\n" + "\n".join(rows) + "\n")
    return FlightTask("mpc-l1", str(path), settings=(("hover_s", "1.0"),))


@pytest.mark.parametrize(("controller", "within"), [("mpc-l1", 0.2), ("lqr-l1", 0.02)])
def test_errors_are_those_of_single_flights(
    short: FlightTask, controller: str, within: float
) -> None:
    # Of one seed trim and noise differ, which counts where the error is small.
    tasks = [replace(short, controller=controller, seed=seed) for seed in (1, 2)]
    rows = fly_batch([BatchTask(task) for task in tasks])
    flown = [fly_task(task) for task in tasks]
    for row, one in zip(rows, flown, strict=True):
        assert row.outcome == one.outcome == "tracked"
        assert (row.flown_s, row.scored_s, row.fallbacks) == (3.0, 3.0, one.fallbacks)
        assert row.tilt_slew_rms_g_s == pytest.approx(one.tilt_slew_rms_g_s, rel=0.1)
    for name in ("mean_error_m", "rms_error_m", "max_error_m", "reported_mean_error_m"):
        mean = sum(getattr(row, name) for row in rows)
        assert mean == pytest.approx(sum(getattr(one, name) for one in flown), rel=within)


def test_rows_are_in_order_and_do_not_hang_on_who_is_beside(short: FlightTask) -> None:
    tasks = [
        BatchTask(replace(short, controller=controller, seed=seed), (("plant.mass", mass),))
        for controller in ("mpc-l1", "lqr-l1", "pid-l1", "l1", "mpc-pid")
        for seed, mass in ((1, 1.0), (2, 0.9))
    ]
    rows = fly_batch(tasks)
    assert [row.key for row in rows] == [task.key for task in tasks]
    assert len({row.key for row in rows}) == len(tasks)
    assert [row.outcome for row in rows] == ["tracked"] * len(tasks)
    for task, row in list(zip(tasks, rows, strict=True))[::3]:
        [alone] = fly_batch([task])
        assert alone.mean_error_m == pytest.approx(row.mean_error_m, rel=1e-6)
    assert rows[0].mean_error_m < 0.5 * rows[2].mean_error_m


def test_a_vehicle_that_is_lost_is_a_result_and_disturbs_no_other(short: FlightTask) -> None:
    unlike = [(), (("plant.delay_s", 0.2),), (("plant.attitude_lag", 9.0),)]
    good, slow, unstable = fly_batch([BatchTask(short, plant) for plant in unlike])
    assert (good.outcome, slow.outcome) == ("tracked", "aborted")
    assert "loop_delay_limit_s" in slow.note
    assert math.isinf(slow.mean_error_m)
    assert unstable.outcome == "aborted" or unstable.mean_error_m > 3.0 * good.mean_error_m


def test_a_trajectory_that_does_not_fit_is_refused_as_in_flight(short: FlightTask) -> None:
    task = replace(short, settings=(("geofence.high_m", "[0.2, 3, 4]"),))
    [row] = fly_batch([BatchTask(task)])
    assert row.outcome == fly_task(task).outcome == "refused"
    assert row.note == fly_task(task).note


def test_the_share_of_solved_plans_is_told(short: FlightTask) -> None:
    calm, tight = (
        replace(short, settings=(*short.settings, ("controller.mpc.r_max_m_s2", said)))
        for said in ("6000.0", "30.0")
    )
    told = fly_batch_told([BatchTask(calm), BatchTask(tight)])
    assert told.constrained_share[0] == 0.0
    assert told.constrained_share[1] > 0.3
    assert [row.r_max_share for row in told.rows] == list(told.constrained_share)


@pytest.mark.parametrize(
    ("changes", "plant", "says"),
    [
        ({"controller": "mpc-l1-plus"}, (), "controller: mpc-l1-plus.*Take mpc-l1"),
        ({"faults": "{link: [{loss: 0.1}]}"}, (), "faults: .*Leave it out"),
        ({"sensors": "exact"}, (), "sensors: exact.*Leave it out"),
        ({"vehicle": "sih_quadx"}, (), "vehicle: sih_quadx.*Take bebop2"),
        ({"wind": "gust-front"}, (), "wind: gust-front .front.*Take calm"),
        ({"wind": "payload-drop"}, (), "wind: payload-drop .*Take calm"),
        ({"airborne": False}, (), "flights: whole.*airborne"),
        ({"settings": (("autopilot", "ardupilot"),)}, (), "autopilot: ardupilot.*Take px4"),
        ({"settings": (("setpoint", "rates"),)}, (), "setpoint: rates.*Leave it out"),
        ({"shim_vehicle": "plant.yaml"}, (), "shim_vehicle: plant.yaml.*plant.mass"),
        ({}, (("plant.colour", 1.0),), "plant.colour.*plant.mass.*engine: flights"),
        ({}, (("plant.mass", 0.0),), "plant.mass: 0 is no vehicle. Give 0.1"),
    ],
)
def test_what_is_not_modelled_is_refused_with_key_and_remedy(
    changes: dict[str, Any], plant: tuple[tuple[str, float], ...], says: str, tmp_path: Path
) -> None:
    task = BatchTask(replace(FlightTask("mpc-l1", 4), **changes), plant)
    with pytest.raises(ConfigError, match=says):
        check_batch([BatchTask(FlightTask("mpc-l1", 4)), task])
