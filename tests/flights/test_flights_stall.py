"""The companion's own process stands still: it must not take back what a failsafe has taken."""

import asyncio

import pytest

from companion.mavlink.messages import MessageId

MODE_REPORTS = (MessageId.CURRENT_MODE, MessageId.HEARTBEAT)


def stall(bench, duration_s):
    """Stand still, and lose what would have told of a failsafe, as a full receive buffer does."""
    bench.wire.cut(duration_s + 1.0, only=MODE_REPORTS)
    asyncio.get_running_loop().stall(duration_s)


@pytest.mark.parametrize("duration_s", [0.7, 1.5, 2.5])
def test_a_long_stall_hands_over_and_nothing_is_sent_after_it(bench, duration_s):
    bench.after("track", 1.0, lambda: stall(bench, duration_s))
    flown = bench.fly(settings={"timeouts.handed_over_s": "20.0"})
    assert flown.outcome.outcome == "aborted"
    (said,) = flown.told("handing over: the companion itself stood still")
    assert said - flown.began("track") > 1.0 + duration_s - 1e-6
    begin = flown.began("track") + 1.0
    assert flown.wire.setpoints_after(begin + 0.02) == []


def test_a_short_stall_is_flown_through(bench):
    bench.after("track", 1.0, lambda: stall(bench, 0.3))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
