import math
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from companion.commands.tune import TuneRequest, _family
from companion.experiments import tuning_flights
from companion.experiments.flight_task import FlightTask, load_task
from companion.experiments.perturbed_plant import write_plant
from companion.experiments.tuning import Evaluation
from companion.experiments.tuning_flights import FlownCosts, flight_cost
from companion.experiments.workers import Workers
from tests.companion.experiments.stand_ins import table_of
from tests.flights.bench import SHORT

TASK = FlightTask("pid", 4)


@pytest.fixture
def flown(monkeypatch):
    """Lets flights end as they are told to."""

    def end(**changes):
        table = table_of(TASK, scored_s=20.0, **changes)
        monkeypatch.setattr(tuning_flights, "fly_task", lambda _: table)
        return flight_cost(TASK).cost_m

    return end


def test_a_flight_that_tracked_costs_its_mean_error(flown):
    assert flown(mean_error_m=0.031, flown_s=20.0) == 0.031


def test_a_lost_flight_costs_more_than_any_that_was_not_and_the_more_the_earlier(flown):
    lost = {"outcome": "aborted", "mean_error_m": math.inf}
    costs = [
        flown(mean_error_m=500.0, flown_s=20.0),
        flown(**lost, flown_s=19.0),
        flown(**lost, flown_s=3.0),
        flown(**lost, flown_s=0.0),
    ]
    never = flown(outcome="refused", mean_error_m=math.inf, flown_s=0.0)

    assert costs == sorted(costs)
    assert len(set(costs)) == 4
    assert math.isfinite(costs[-1])
    assert never == costs[-1]


def test_gains_that_can_not_be_flown_cost_most_and_say_why_and_the_others_are_flown(tmp_path):
    path = tmp_path / "short.csv"
    path.write_text(SHORT)
    task = FlightTask("pid", str(path), settings=(("hover_s", "0.2"),))
    told = []
    batch = [{"inner_pid.kp": (-1.0, 0.5, 1.0)}, {"inner_pid.kp": (0.5, 0.5, 1.0)}]

    with Workers(flight_cost, 1) as workers:
        bad, good = FlownCosts(workers, (task,), told.append)(batch)

    assert (bad.outcome, bad.cost_m) == ("failed", 30.0)
    assert "kp" in bad.note
    assert good.outcome == "tracked"
    assert 0.0 < good.cost_m < 1.0
    assert told == [bad, good]
    assert isinstance(good, Evaluation)


def test_the_worst_vehicle_decides_what_a_set_of_gains_is_worth():
    class Workers:
        def run(self, tasks, on_done):
            return [Evaluation(cost, "tracked", "") for cost in (0.1, 0.3, 0.4, 0.2)]

    costs = FlownCosts(Workers(), (TASK, TASK), lambda _: None)
    assert [e.cost_m for e in costs([{"inner_pid.kp": (1.0, 1.0, 1.0)}] * 2)] == [0.3, 0.4]


def test_a_plant_with_more_attitude_lag_differs_by_that_alone(tmp_path):
    tasks = _family(TuneRequest("pid"), TASK, load_task(TASK).config, tmp_path)
    assert [replace(task, shim_vehicle=None) for task in tasks] == [TASK, TASK]
    changed = yaml.safe_load(Path(tasks[1].shim_vehicle).read_text())
    same = yaml.safe_load(write_plant("bebop2", (), tmp_path / "same.yaml").read_text())
    gains = {
        "autopilot_parameters": ("MC_ROLL_P", "MC_PITCH_P"),
        "ardupilot_parameters": ("ATC_ANG_RLL_P", "ATC_ANG_PIT_P"),
    }
    for section, names in gains.items():
        for name in names:
            gain = same[section].pop(name)
            assert changed[section].pop(name) == pytest.approx(gain / 1.25)
    assert changed == same
