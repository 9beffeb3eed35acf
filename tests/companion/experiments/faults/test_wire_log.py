"""What a judge learns from a flight's packets."""

import math
import struct

import pytest

from companion.experiments.faults.wire_log import read_wire
from companion.mavlink.codec import Packer
from companion.mavlink.commands import arm
from companion.mavlink.dialects import dialect_named
from companion.mavlink.messages import COMPONENT_TRUTH, MessageId, Outgoing, Target

PX4 = dialect_named("px4")
LAND = PX4.custom_mode("land")
OFFBOARD, LOITER = PX4.custom_mode("offboard"), PX4.custom_mode("loiter")
ENGAGED_S = 5.0


class Packets:
    """Packets of a flight, each with its time; all of an autopilot's in one sequence."""

    def __init__(self):
        self.found = []
        self.autopilot = Packer(1, 1)
        self.truth = Packer(1, COMPONENT_TRUTH)
        self.companion = Packer(1, 191)

    def heartbeat(self, time_s, mode=OFFBOARD, armed=True):
        payload = struct.pack("<IBBBBB", mode, 2, 12, 0x81 if armed else 0x01, 4, 3)
        self.received(time_s, self.autopilot.pack(Outgoing(MessageId.HEARTBEAT, payload)))

    def state(self, time_s, stamp_s):
        payload = struct.pack("<I6f", round(stamp_s * 1e3), *([0.0] * 6))
        message = Outgoing(MessageId.LOCAL_POSITION_NED, payload)
        self.received(time_s, self.autopilot.pack(message))

    def event(self, time_s, stamp_s, name, value):
        payload = struct.pack("<If10s", round(stamp_s * 1e3), value, name.encode())
        message = Outgoing(MessageId.NAMED_VALUE_FLOAT, payload)
        self.received(time_s, self.truth.pack(message))

    def setpoint(
        self, time_s, quaternion=(1.0, 0.0, 0.0, 0.0), thrust=0.5, mask=7, rates=(0, 0, 0)
    ):
        payload = struct.pack("<I4f3ffBBB", 0, *quaternion, *rates, thrust, 1, 1, mask)
        message = Outgoing(MessageId.SET_ATTITUDE_TARGET, payload)
        self.found.append((time_s, True, self.companion.pack(message)))

    def arm(self, time_s):
        self.found.append((time_s, True, self.companion.pack(arm(Target(1)).as_long())))

    def set_mode(self, time_s, name):
        command = PX4.set_mode(Target(1), name).as_long()
        self.found.append((time_s, True, self.companion.pack(command)))

    def received(self, time_s, raw):
        self.found.append((time_s, False, raw))

    def read(self, engaged_s=ENGAGED_S):
        return read_wire(self.found, PX4, engaged_s)


def test_whoever_leaves_the_mode_of_setpoints_after_engagement_takes_over():
    packets = Packets()
    packets.heartbeat(1.0, OFFBOARD)
    packets.heartbeat(2.0, LOITER)  # the take-off, before engagement
    packets.heartbeat(6.0, LOITER)  # the engagement is asked for, and not obeyed yet
    packets.heartbeat(6.1, OFFBOARD)
    packets.heartbeat(8.0, LOITER)
    packets.heartbeat(9.0, OFFBOARD)
    packets.heartbeat(10.0, LOITER)
    assert packets.read().taken_over_s == 8.0


def test_a_mode_that_the_companion_has_commanded_is_its_own():
    packets = Packets()
    packets.set_mode(5.0, "offboard")
    packets.heartbeat(6.0, OFFBOARD)
    packets.set_mode(7.0, "land")
    packets.heartbeat(7.5, LAND)
    packets.set_mode(7.6, "land")
    packets.heartbeat(8.5, LAND)
    found = packets.read()
    assert (found.taken_over_s, found.others_s) == (7.5, None)
    packets.heartbeat(9.5, LOITER)  # a pilot stops the landing
    found = packets.read()
    assert (found.taken_over_s, found.others_s) == (7.5, 9.5)


def test_a_mode_that_somebody_else_has_chosen_is_not():
    packets = Packets()
    packets.set_mode(5.0, "offboard")
    packets.heartbeat(6.0, OFFBOARD)
    packets.heartbeat(7.5, LOITER)
    packets.set_mode(8.0, "offboard")
    packets.heartbeat(8.5, OFFBOARD)
    found = packets.read()
    assert (found.taken_over_s, found.others_s) == (7.5, 7.5)
    assert [c.time_s for c in found.commands if c.moves] == [5.0, 8.0]


def test_a_flight_that_never_engaged_is_taken_over_by_nobody():
    packets = Packets()
    packets.heartbeat(1.0, OFFBOARD)
    packets.heartbeat(2.0, LOITER)
    assert packets.read(engaged_s=None).taken_over_s is None


def test_a_heartbeat_that_was_overtaken_tells_nothing():
    packets = Packets()
    packets.heartbeat(6.0, LOITER)
    early = packets.found.pop()
    packets.heartbeat(6.1, OFFBOARD)
    packets.found.append((6.12, *early[1:]))
    assert packets.read().taken_over_s is None


def test_the_first_word_after_a_long_silence_is_news_whatever_its_number():
    packets = Packets()
    packets.heartbeat(6.0, OFFBOARD)
    for _ in range(200):
        packets.heartbeat(6.5, OFFBOARD)
    packets.found[1:] = []
    packets.heartbeat(9.0, LOITER)
    assert packets.read().taken_over_s == 9.0


def test_disarming_counts_after_arming_alone():
    packets = Packets()
    packets.heartbeat(1.0, armed=False)
    packets.arm(1.5)
    packets.heartbeat(2.0, armed=True)
    packets.heartbeat(3.0, armed=False)
    packets.arm(4.0)
    found = packets.read()
    assert (found.armed_s, found.disarmed_s) == (2.0, 3.0)
    assert [(c.time_s, c.label) for c in found.commands] == [
        (1.5, "COMPONENT_ARM_DISARM"),
        (4.0, "COMPONENT_ARM_DISARM"),
    ]


def test_a_state_is_as_old_as_the_newest_stamp():
    packets = Packets()
    packets.state(1.00, 0.98)
    packets.setpoint(1.01)
    packets.state(1.05, 0.98)  # frozen
    packets.state(1.06, 0.90)  # overtaken
    packets.setpoint(1.07)
    packets.state(1.10, 0.99)
    packets.setpoint(1.10)
    ages = [s.state_age_s for s in packets.read().setpoints]
    assert ages == pytest.approx([0.01, 0.07, 0.0])


def test_a_clock_that_began_anew_brings_new_states():
    packets = Packets()
    packets.state(1.00, 50.0)
    packets.state(2.00, 0.5)
    packets.setpoint(2.01)
    assert packets.read().setpoints[0].state_age_s == pytest.approx(0.01)


def test_setpoints_are_read_as_they_are():
    tilt = math.radians(20.0)
    packets = Packets()
    packets.setpoint(1.0, (math.cos(tilt / 2), math.sin(tilt / 2), 0.0, 0.0), 0.6)
    packets.setpoint(2.0, mask=128, rates=(3.0, 0.0, 4.0), thrust=0.4)
    packets.setpoint(3.0, (math.nan, 0.0, 0.0, 0.0))
    packets.setpoint(4.0, mask=128, thrust=math.inf)
    first, second, *bad = packets.read().setpoints
    assert (first.finite, first.thrust) == (True, pytest.approx(0.6))
    assert math.degrees(first.tilt_rad) == pytest.approx(20.0, abs=1e-3)
    assert (second.rate_rad_s, second.tilt_rad) == (pytest.approx(5.0), 0.0)
    assert [s.finite for s in bad] == [False, False]


def test_an_event_of_the_truth_is_known_once_however_often_it_is_told():
    packets = Packets()
    packets.event(7.2, 7.0, "jump", 3.0)
    packets.event(7.4, 7.0, "jump", 3.0)
    packets.event(7.6, 7.5, "clock", 5.0)
    assert [(t, e.name) for t, e in packets.read().events] == [(7.2, "jump"), (7.6, "clock")]
