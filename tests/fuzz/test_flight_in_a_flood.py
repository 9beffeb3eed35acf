"""A vehicle that babbles flies as well as one that does not."""

import math

import pytest

from tests.flights.bench import Bench

BABBLE = 20_000


def fly(folder, **link):
    folder.mkdir()
    flown = Bench(folder).fly(airborne=True, faults={"link": [link]} if link else None)
    errors = [
        math.dist(r.values["position_enu_m"], r.values["desired_enu_m"])
        for r in flown.records("control")
        if r.values["phase"] == "track"
    ]
    return flown, sum(errors) / len(errors)


@pytest.mark.faults
def test_twenty_thousand_useless_packets_a_second_change_nothing_of_the_flight(tmp_path):
    _, quiet_m = fly(tmp_path / "quiet")
    flown, error_m = fly(tmp_path / "flooded", way="telemetry", from_s=4.0, until_s=6.0,
                        babble_packets_s=BABBLE)  # fmt: skip

    assert flown.outcome.completed
    assert flown.outcome.outcome == "tracked"
    assert error_m < 1.1 * quiet_m + 1e-3
    assert len(flown.told("more comes over the link than there is time for")) == 1
    (counted,) = [text for _, _, text in flown.seen.messages if "were dropped" in text]
    assert int(counted.split("link, ")[1].split()[0]) > BABBLE
