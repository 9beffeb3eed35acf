"""The autopilot's clock does not run as ours does."""

import pytest

from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures


@pytest.mark.parametrize("speed", [0.95, 1.05, 0.3, 3.0])
def test_a_boot_clock_of_another_rate_changes_nothing(bench, speed):
    flown = bench.fly(speed=speed, check=speed > 0.9)
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.outcome.missed_deadlines == 0
    assert flown.outcome.fallbacks == 0
    # The reference begins where the vehicle is and never jumps against it.
    error = tracking_figures(read_flight(flown.folder), flown.outcome.scored_s).against_truth
    assert error.mean_m < 0.08
    delays = [r.values["loop_delay_s"] for r in flown.records("control")]
    assert max(delays) < 0.06  # 30 ms of transport, of the autopilot's time, and the tick
    assert min(delays) > 0.02
    ladder = flown.told("level") + flown.told("fallback")
    assert ladder == []


def test_the_ladder_goes_by_the_autopilots_clock(bench):
    """Three times as fast: the state's limits pass in a third of our time."""
    bench.after("track", 0.5, lambda: bench.wire.cut(None, (331,)))
    flown = bench.fly(speed=3.0, check=False)
    cut = flown.began("track") + 0.5
    (over,) = flown.told("handing over: no usable state")
    assert over - cut == pytest.approx(0.9 / 3.0, abs=0.05)
