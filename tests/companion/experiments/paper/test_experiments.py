"""The paper's experiments with real flights: those that make one figure each."""

import numpy as np
import pytest

from companion.config.resolve import load_flight
from companion.experiments.campaign import run_campaign
from companion.experiments.flight_store import Summary
from companion.experiments.paper import (
    adaptation_rate,
    bounds,
    changing_dynamics,
    origin,
    reference_system,
)
from companion.experiments.paper.flights import Flights
from companion.experiments.paper.guarantees import theory_of
from companion.experiments.paper.scale import Scale
from companion.flight.assemble import position_model

SCALE = Scale(
    "few",
    seeds=(1,),
    adaptation_rates=(500.0, 1000.0),
    origin_trajectories=(4,),
    mpc_ticks=10,
)
FLOWN = (bounds, reference_system, origin, changing_dynamics, adaptation_rate)


@pytest.fixture(scope="module")
def config():
    return load_flight(None, {}, {})


@pytest.fixture(scope="module")
def theory(config):
    return theory_of(config)


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    tasks = [task for module in FLOWN for task in module.tasks(SCALE)]
    summaries = run_campaign(tasks, folder, jobs=1)
    assert all(summary.outcome == "tracked" for summary in summaries.values())
    return Flights(folder, summaries)


def test_the_prediction_error_stays_far_below_its_bound_without_noise(flights, config, theory):
    model = position_model(config.controller)
    found = bounds.evaluate(flights, SCALE, model, theory.gains)
    exact, noisy = found["exact"], found["noisy"]
    assert (exact.largest_y_tilde_m_s < theory.guarantees.gamma_0_m_s).all()
    assert (exact.largest_y_tilde_m_s > 0.0).all()
    assert (
        noisy.largest_y_tilde_m_s
        < theory.guarantees.gamma_0_m_s + theory.guarantees.noise_extra_m_s
    ).all()
    assert exact.times_s[0] == pytest.approx(0.0, abs=0.02)
    assert exact.times_s[-1] >= 15.0


def test_the_vehicle_stays_close_to_the_ideal_system_which_is_not_the_reference(
    flights, config, theory
):
    model = position_model(config.controller)
    found = bounds.evaluate(flights, SCALE, model, theory.gains)["exact"]
    assert found.mean_distance_m < 0.1
    lag = np.linalg.norm(found.ideal_m - found.r2_m, axis=1).max()
    assert lag > 5.0 * found.mean_distance_m


def test_the_velocity_follows_the_closed_loop_reference_system(flights, theory):
    for comparison in reference_system.evaluate(flights, SCALE, theory):
        moved = np.abs(comparison.y1_m_s).max(axis=0)
        assert (comparison.largest_m_s < theory.guarantees.gamma_1_m_s).all()
        assert (comparison.rms_m_s < 0.1 * moved.max()).all()


def test_moving_the_origin_changes_nothing_but_under_the_papers_literal_cost(flights):
    costs = origin.evaluate(flights, SCALE)
    assert costs["r_minus_target"].change < 0.01
    assert costs["r_minus_target"].largest_change == costs["r_minus_target"].change
    assert costs["r_minus_target"].hover_offset_m < 0.005
    assert costs["absolute_r"].change > 0.1
    assert costs["absolute_r"].hover_offset_m > 0.02


def test_the_estimate_finds_the_push_of_the_wind_while_nothing_moves(flights, config):
    model = position_model(config.controller)
    hover = changing_dynamics.evaluate(flights, SCALE, model).hover
    assert hover.settled_noisy_sine == pytest.approx(hover.expected_sine, rel=0.25)
    assert hover.settled_offset_m < 0.001
    assert hover.settled_sine == pytest.approx(hover.expected_sine, rel=0.05)
    assert hover.largest_speed_m_s < 0.01
    assert 0.0 < hover.settling_s < 15.0


def test_a_load_is_taken_up_and_its_error_dies_out(flights, config):
    model = position_model(config.controller)
    load = changing_dynamics.evaluate(flights, SCALE, model).load["mpc-l1"]
    assert load.from_ideal.mean < 1.25 * load.from_ideal_without.mean
    assert load.largest_sag_m > 0.02
    assert load.settled.mean < 1.25 * load.settled_without.mean
    after = load.height_error_m[load.times_s > changing_dynamics.LOAD_AT_S]
    before = load.height_error_m[load.times_s < changing_dynamics.LOAD_AT_S]
    assert -after.min() > 2.0 * -before.min()


def test_the_prediction_error_falls_with_the_adaptation_rate_until_noise_rules(flights, theory):
    sweep = adaptation_rate.evaluate(flights, SCALE, theory)
    assert sweep.fitted.all()
    assert sweep.slope <= -0.5
    assert sweep.step_model_slope == pytest.approx(-0.5, abs=0.03)
    assert sweep.noise_decides_from == 500.0
    assert sweep.noise_floor_m_s > 10.0 * sweep.exact_m_s[:, :2].max()


def test_a_flight_that_was_lost_is_left_out(tmp_path, config, theory):
    """It has a file, but was not flown to its end."""
    tasks = bounds.tasks(SCALE)
    lost = {str(k): Summary(str(k), task, "aborted", "") for k, task in enumerate(tasks)}
    found = bounds.evaluate(
        Flights(tmp_path, lost), SCALE, position_model(config.controller), theory.gains
    )
    assert found == {}
