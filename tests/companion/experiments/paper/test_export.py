"""results.json: strict JSON that holds what the study found."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from companion.experiments.paper.export import results_object, write_results
from companion.experiments.paper.scale import FULL, QUICK
from tests.companion.experiments.paper.factory import make_claims, make_results, with_losses


def _read(results, folder):
    def refuse(constant):
        raise AssertionError(f"{constant} is no JSON")

    path = write_results(results, make_claims(), folder)
    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


@pytest.mark.parametrize("scale", [FULL, QUICK])
@pytest.mark.parametrize("losses", [False, True])
def test_it_is_strict_json_and_comes_back_as_it_was(scale, losses, tmp_path):
    results = make_results(scale)
    if losses:
        results = with_losses(results)
    assert _read(results, tmp_path) == results_object(results, make_claims())


def test_each_controller_trajectory_and_wind_has_mean_spread_and_seeds(tmp_path):
    results = make_results(FULL)
    errors = _read(results, tmp_path)["tracking"]["errors"]
    assert set(errors) == set(results.tracking.errors)
    for controller, by_wind in errors.items():
        assert set(by_wind) == {"calm", "fan"}
        for wind, of_wind in by_wind.items():
            ours = results.tracking.errors[controller][wind]
            assert set(of_wind["by_trajectory"]) == {"1", "2", "3", "4", "5"}
            for number, cell in of_wind["by_trajectory"].items():
                assert cell["mean_m"] == ours.by_trajectory[int(number)].mean
                assert cell["std_m"] == ours.by_trajectory[int(number)].std
                assert cell["values_m"] == list(ours.by_trajectory[int(number)].values)
                assert (cell["seeds"], cell["lost"]) == (5, 0)
            assert of_wind["mean_of_five"]["mean_m"] == ours.mean.mean


def test_one_seed_claims_no_spread(tmp_path):
    cell = _read(make_results(QUICK), tmp_path)["tracking"]["errors"]["mpc-l1"]["calm"]
    assert cell["mean_of_five"]["std_m"] is None
    assert cell["mean_of_five"]["seeds"] == 1


def test_a_lost_flight_is_counted_and_has_no_figure(tmp_path):
    errors = _read(with_losses(make_results(FULL)), tmp_path)["tracking"]["errors"]
    lost = errors["mpc-l1"]["fan"]["by_trajectory"]["5"]
    assert lost == {"mean_m": None, "std_m": None, "seeds": 5, "lost": 5, "values_m": [None] * 5}


def test_claims_and_their_count_are_in_it(tmp_path):
    content = _read(make_results(), tmp_path)
    assert [claim["quote"] for claim in content["claims"]] == [c.quote for c in make_claims()]
    assert content["verdicts"] == {
        "reproduced": 1,
        "partly": 1,
        "not reproduced": 1,
        "not tested": 1,
    }


def test_every_experiment_is_in_it(tmp_path):
    results = make_results(FULL)
    content = _read(results, tmp_path)
    assert content["provenance"]["commit"] == results.provenance.commit
    assert content["study"]["seeds"] == [1, 2, 3, 4, 5]
    assert content["bounds"]["exact"]["largest_y_tilde_m_s"]["x"] == pytest.approx(0.02, rel=0.01)
    assert content["guarantees"]["gamma_0_m_s"] == {"x": 0.9, "y": 0.9, "z": 1.3}
    rates = content["adaptation_rate"]["rates"]
    assert [rate["gamma_1_s2"] for rate in rates] == list(FULL.adaptation_rates)
    assert (rates[0]["stable"], rates[0]["fitted"]) == (False, False)
    assert [r["fitted"] for r in rates] == [100.0 < r["gamma_1_s2"] <= 1000.0 for r in rates]
    assert [one["flight"] for one in content["reference_system"]] == [
        comparison.name for comparison in results.reference
    ]
    transfer = content["model_transfer"]
    assert transfer["seeds"] == [1, 2, 3, 4, 5]
    assert transfer["tuned_for"]["2"]["2"] == {"mean_m": 0.04, "seeds": 5}
    assert content["load_step"]["mpc-pid"]["settled"]["seeds"] == 5
    assert content["hover_convergence"]["settling_s"] == 4.6
    assert content["origin"]["absolute_r"]["change"] == pytest.approx(0.0303 / 0.0127 - 1.0)
    assert content["computing_time"]["methods"][0]["name"] == "linear"


@pytest.mark.parametrize("name", ["exact", "noisy"])
def test_the_error_is_given_as_a_share_of_its_bound_on_each_axis(name, tmp_path):
    results = make_results(FULL)
    content = _read(results, tmp_path)
    for axis, bound in {"x": 0.9, "y": 0.9, "z": 1.3}.items():
        told = content["bounds"][name]
        assert told["largest_y_tilde_over_gamma_0"][axis] == pytest.approx(
            told["largest_y_tilde_m_s"][axis] / bound
        )


def test_a_share_of_no_bound_is_null(tmp_path):
    results = make_results(FULL)
    guarantees = replace(results.guarantees, gamma_0_m_s=np.array([0.9, np.inf, 1.3]))
    told = _read(replace(results, guarantees=guarantees), tmp_path)["bounds"]["exact"]
    assert told["largest_y_tilde_over_gamma_0"]["y"] is None
    assert told["largest_y_tilde_over_gamma_0"]["x"] > 0.0


def test_what_was_not_measured_is_null(tmp_path):
    content = _read(with_losses(make_results()), tmp_path)
    assert content["computing_time"] is None
    assert content["hover_convergence"] is None
    assert content["guarantees"]["gamma_1_m_s"]["x"] is None
    assert content["adaptation_rate"]["noise_decides_from_1_s2"] is None


def test_series_over_time_are_left_out(tmp_path):
    results = make_results(FULL)
    write_results(results, make_claims(), tmp_path)
    assert (tmp_path / "results.json").stat().st_size < 100_000


def test_ratios_are_to_mpc_l1(tmp_path):
    results = make_results(FULL)
    content = _read(results, tmp_path)["mean_of_five"]
    assert next(iter(content)) == "mpc-l1"
    assert content["mpc-l1"]["calm_over_mpc_l1"] == 1.0
    errors = results.tracking.errors
    expected = errors["pid-l1"]["fan"].mean.mean / errors["mpc-l1"]["fan"].mean.mean
    assert math.isclose(content["pid-l1"]["fan_over_mpc_l1"], expected)
