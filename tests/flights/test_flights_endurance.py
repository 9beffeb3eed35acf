"""A flight that lasts does not collect anything: what is alive is counted, not measured."""

from companion.flight.errors import LinkLostError
from tools.soak.figure_eight import write_figure_eight
from tools.soak.fly import fly
from tools.soak.growth import census, types_more
from tools.soak.plans import FlightPlan

INTERVAL_S = 50.0


def test_a_flight_of_minutes_holds_no_more_at_its_end_than_after_its_first_minute(tmp_path):
    """5000 ticks, 500 of PX4's log rows, 250 chunks of ours, 50 heartbeats lie in between."""
    file = tmp_path / "figure-eight.csv"
    write_figure_eight(file, 95.0)
    seen = []

    def take(glance):
        if glance.phase == "track":
            seen.append((census(glance.time_s), glance.tasks))

    outcome = fly(
        FlightPlan("px4", str(file)), tmp_path / "log", take, lockstep=True, interval_s=INTERVAL_S
    )
    assert outcome.outcome == "landed"
    (before, tasks_before), (after, tasks_after) = seen
    assert tasks_after == tasks_before
    more = after.by_type - before.by_type
    assert after.ours - before.ours <= 15, more
    assert after.objects - before.objects <= 40, more
    # Noise is drawn in stocks of some hundred numbers, of which more or fewer may be left.
    assert after.items - before.items <= 1000, more
    assert after.blocks - before.blocks <= 1000, more


def test_growth_would_be_seen():
    """Objects of ours count, and what lists hold of anything."""
    held = []
    before = census(0.0)
    held += [0.5] * 1000
    held += [LinkLostError("one") for _ in range(30)]
    after = census(1.0)
    assert after.items - before.items >= 1030
    assert after.ours - before.ours == 30
    assert (
        "+30.0 a minute  companion.flight.errors.LinkLostError" in types_more(before, after, 1.0)[0]
    )
