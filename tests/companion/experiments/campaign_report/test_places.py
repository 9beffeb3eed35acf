"""Where a campaign breaks: named where it does, not where chance has it."""

import numpy as np
import pytest

from companion.experiments.campaign_report.influence import sensitivity
from companion.experiments.campaign_report.levels import clusters
from companion.experiments.campaign_report.read import read_campaign
from companion.experiments.campaign_report.statistics import proportion
from companion.experiments.campaign_report.summary import summarise
from companion.experiments.campaign_report.tables import groups
from companion.experiments.campaigns.manifest import read_manifest, write_manifest
from companion.experiments.campaigns.plan import Parameter, load_plan
from tests.companion.experiments.campaign_report.folders import (
    CONTROLLER,
    DELAY,
    DRAG,
    MASS,
    WIND,
    row,
    write_campaign,
)

SEED = Parameter("seed", "number", values=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
FOUR = (MASS, DELAY, DRAG, WIND)


def summary(folder, rows, parameters, **said):
    """What a campaign's report says first."""
    campaign = read_campaign(write_campaign(folder, rows, None, parameters, **said))
    return summarise(campaign, groups(campaign), sensitivity(campaign))


def values(drawn):
    """Of a point."""
    mass, delay, drag = drawn.uniform([0.8, 0.0, 0.5], [1.2, 0.1, 2.0]).tolist()
    return {
        "plant.mass": mass,
        "plant.delay_s": delay,
        "plant.drag": drag,
        "wind": str(drawn.choice(["calm", "fan"])),
    }


def test_losses_by_pure_chance_have_no_place(tmp_path):
    named = 0
    for k in range(12):
        drawn = np.random.default_rng(k)
        made = [
            row(n, values(drawn), 0.01, lost=drawn.random() < 0.15, parameters=FOUR)
            for n in range(100)
        ]
        breaks = summary(tmp_path / str(k), made, FOUR).breaks
        named += "elsewhere." in breaks[1] and "told from chance" not in breaks[1]
    assert named <= 2


FEW = (Parameter("plant.mass", "number", values=(0.8, 1.0, 1.2)), WIND, SEED)


@pytest.mark.parametrize(
    "said", [{"rows_per_point": 6}, {"yaml": "name: robust\neach: {wind: [calm, fan]}\n"}]
)
def test_flights_of_one_sampled_point_are_not_independent(tmp_path, said):
    """Forty points, each flown with two winds and three seeds, none of which matters."""
    made = []
    for point in range(40):
        mass = (0.8, 1.0, 1.2)[point % 3] if "rows_per_point" in said else 0.8 + 0.01 * point
        for wind in ("calm", "fan"):
            for seed in (1.0, 2.0, 3.0):
                told = {"plant.mass": mass, "wind": wind, "seed": seed}
                made.append(row(len(made), told, 0.01, parameters=FEW))
    campaign = read_campaign(write_campaign(tmp_path, made, None, FEW, **said))
    found = clusters(campaign, campaign.flights)
    assert found.tolist() == [k // 6 for k in range(240)]


def test_a_sampled_choice_without_effect_is_not_seen_in_points_flown_with_several_seeds(tmp_path):
    seen = 0
    for k in range(12):
        drawn = np.random.default_rng(k)
        made = []
        for _ in range(40):
            mass, wind = float(drawn.choice([0.8, 1.0, 1.2])), str(drawn.choice(["calm", "fan"]))
            error = 0.01 * float(np.exp(drawn.normal()))
            for seed in (1.0, 2.0, 3.0, 4.0, 5.0, 6.0):
                told = {"plant.mass": mass, "wind": wind, "seed": seed}
                own = error * float(np.exp(0.2 * drawn.normal()))
                made.append(row(len(made), told, own, parameters=FEW))
        folder = write_campaign(tmp_path / str(k), made, None, FEW, rows_per_point=6)
        found = sensitivity(read_campaign(folder)).of("all", "error")
        seen += any(one.seen for one in found if one.parameter != "seed")
    assert seen <= 2


def test_a_campaigns_folder_says_how_often_each_point_is_flown(tmp_path):
    text = "name: a\nsample: {method: sobol, points: 4}\nparameters:\n"
    text += "  plant.mass: {low: 0.8, high: 1.2}\neach: {controller: [mpc-l1, pid-l1]}\nseeds: 3\n"
    (tmp_path / "a.yaml").write_text(text, encoding="utf-8")
    plan = load_plan(str(tmp_path / "a.yaml"))
    write_manifest(tmp_path, plan, "companion campaign a.yaml")
    manifest = read_manifest(tmp_path)
    assert manifest.said["rows_per_point"] == 6
    masses = [flight.values["plant.mass"] for flight in plan.flights]
    assert masses == [masses[k // 6 * 6] for k in range(24)]


def test_what_decides_is_seen_among_many_parameters(tmp_path):
    many = tuple(Parameter(f"controller.p{k}", "number", low=0.0, high=1.0) for k in range(24))
    drawn = np.random.default_rng(1)
    made = []
    for n in range(60):
        told = {p.name: float(value) for p, value in zip(many, drawn.random(24), strict=True)}
        made.append(row(n, told, 0.01 + 0.05 * told["controller.p7"], parameters=many))
    campaign = read_campaign(write_campaign(tmp_path, made, None, many))
    found = sensitivity(campaign).of("all", "error")
    assert [one.parameter for one in found if one.seen] == ["controller.p7"]


@pytest.mark.parametrize("steps", [None, 11])
def test_neighbouring_values_at_which_all_is_lost_are_one_place(tmp_path, steps):
    """Every flight above 70 ms is lost: from a range, and from a list."""
    drawn, made = np.random.default_rng(3), []
    for n in range(300):
        told = values(drawn)
        if steps is not None:
            told["plant.delay_s"] = 0.01 * int(drawn.integers(0, steps))
        lost = told["plant.delay_s"] > 0.0695
        made.append(row(n, told, 0.01 * (1.0 + drawn.random()), lost=lost, parameters=FOUR))
    folder = write_campaign(tmp_path, made, None, FOUR)
    campaign = read_campaign(folder)
    found = sensitivity(campaign)
    place = "0.07\u00a0s or more" if steps else "more than 0.074\u00a0s"
    assert f"at plant.delay_s {place} (" in summarise(campaign, groups(campaign), found).breaks[1]
    worst = {one.outcome: one.worst for one in found.influences if one.parameter == DELAY.name}
    in_bins = {"error": "more than 0.066\u00a0s", "lost": "more than 0.079\u00a0s"}
    assert worst == (dict.fromkeys(in_bins, place) if steps else in_bins)


def test_where_all_is_lost_milder_conditions_are_asked_for(tmp_path):
    drawn = np.random.default_rng(4)
    made = [row(n, values(drawn), 0.01, lost=True, parameters=FOUR) for n in range(60)]
    said = summary(tmp_path / "all", made, FOUR)
    told = "all 60 flights were lost. Fly milder conditions to see where it begins."
    assert said.breaks == (f"Everywhere: {told}",)
    assert said.hurts[0] == "All flights: nothing can be told, all were lost."

    five, made = (*FOUR, CONTROLLER), []
    for n in range(80):
        told = {**values(drawn), "controller": CONTROLLER.values[n % 2]}
        made.append(row(n, told, 0.01, lost=bool(n % 2), parameters=five))
    said = summary(tmp_path / "one", made, five, rows_per_point=1)
    told = "PID-L1: all 40 flights were lost. Fly milder conditions to see where it begins."
    assert said.breaks[1:] == (told,)
    assert "PID-L1: nothing can be told, all were lost." in said.hurts


def test_shares_of_flights_that_share_their_fate_have_the_intervals_of_their_points(tmp_path):
    made = []
    for n in range(80):
        told = {**values(np.random.default_rng(n // 2)), "controller": CONTROLLER.values[n % 2]}
        made.append(row(n, told, 0.01, lost=n // 2 % 4 == 0, parameters=(*FOUR, CONTROLLER)))
    folder = write_campaign(tmp_path, made, None, (*FOUR, CONTROLLER), rows_per_point=2)
    first = groups(read_campaign(folder))[0].lost
    assert (first.count, first.of) == (20, 80)
    alone = proportion(10, 40)
    assert (first.low, first.high) == pytest.approx((alone.low, alone.high), abs=0.003)
