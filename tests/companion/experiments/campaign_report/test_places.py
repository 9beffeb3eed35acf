"""Where a campaign breaks: named where it does, not where chance has it."""

import numpy as np

from companion.experiments.campaign_report.influence import sensitivity
from companion.experiments.campaign_report.read import read_campaign
from companion.experiments.campaign_report.summary import summarise
from companion.experiments.campaign_report.tables import groups
from tests.companion.experiments.campaign_report.folders import (
    DELAY,
    DRAG,
    MASS,
    WIND,
    row,
    write_campaign,
)

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
