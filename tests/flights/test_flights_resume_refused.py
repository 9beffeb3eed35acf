"""A person's word to fly on is refused where it could not be: before anything is taken over."""

import asyncio
import struct

import pytest

from companion.flight.inbox import PilotCommand
from companion.mavlink.messages import MessageId
from tests.flights.wire import AUTOPILOT

pytestmark = pytest.mark.faults

REFUSED = "outside the geofence; fly it inside first"
STEP_S = 4.0
_POSITION = struct.Struct("<Q3f")
"""Time and place in an ODOMETRY, NED."""


def step(by_m, at_s):
    """The estimate steps by so much, east."""
    keys = {"fault": "estimator_reset", "at_s": at_s, "since": "setpoints"}
    return keys | {"position_enu_m": [by_m, 0.0, 0.0]}


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_outside_the_geofence_nothing_is_taken_over_and_inside_it_is_flown_on(bench, autopilot):
    """What is outside after a step of the estimate is inside again after another one."""
    bench.flies = autopilot
    for delay_s in (1.0, 3.0):
        bench.after("handed over", delay_s, lambda: bench.inbox.put(PilotCommand.RESUME))
    faults = {"vehicle": [step(5.0, STEP_S), step(-5.0, STEP_S + 2.5)]}
    flown = bench.fly(faults=faults)

    over = flown.began("handed over")
    (refused,) = flown.told(REFUSED)
    assert refused - over == pytest.approx(1.0, abs=0.05)
    between = [t for t, _, _ in flown.wire.mode_requests() if over + 0.5 < t < over + 2.9]
    assert between == []
    setpoints = [s.time_s for s in flown.wire.setpoints if over + 0.5 < s.time_s < over + 2.9]
    assert setpoints == []
    assert len(flown.told("handing over")) == 1
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed


def test_who_leaves_the_geofence_while_parameters_are_read_again_keeps_the_vehicle(bench):
    """The word was taken inside; before the mode would be asked for, the vehicle is outside."""
    began = []

    def tamper(packet):
        loop_s = asyncio.get_running_loop().time() - began[0]
        if packet.component_id != AUTOPILOT:
            return packet.raw
        if packet.message_id == MessageId.PARAM_VALUE and loop_s < 0.4:
            return b""
        if packet.message_id == MessageId.ODOMETRY and loop_s > 0.2:
            time_us, north, east, down = packet.fields(_POSITION)
            rest = packet.payload.ljust(_POSITION.size, b"\0")[_POSITION.size :]
            return packet.with_payload(_POSITION.pack(time_us, north, east + 5.0, down) + rest)
        return packet.raw

    def resume():
        began.append(asyncio.get_running_loop().time())
        bench.wire.from_shim = tamper
        bench.inbox.put(PilotCommand.RESUME)

    bench.after("track", 1.0, lambda: bench.wire.change_mode("loiter"))
    bench.after("handed over", 1.0, resume)
    flown = bench.fly(settings={"timeouts.handed_over_s": "3.0"}, check=False)

    over = flown.began("handed over")
    (refused,) = flown.told("handed over: not resumed")
    assert refused - over > 1.2
    assert REFUSED in flown.outcome.note
    assert [t for t, _, _ in flown.wire.mode_requests() if t > over] == []
    assert flown.wire.setpoints_after(over) == []
    assert flown.outcome.outcome == "aborted"
    assert flown.wire.modes[-1][1] == "loiter"
