"""The autopilot's clock jumps, or begins anew."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.faults.vehicle_clock import BootClock
from sitl_shim.mavlink.messages_truth import TRUTH_COMPONENT_ID
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import dialect
from tests.sitl_shim.faults.vehicle_flights import (
    copter,
    options_of,
    px4,
    px4_in_offboard,
    told,
)
from tests.sitl_shim.mavlink.shim_client import OFFBOARD, ShimClient

_REBOOT = {"fault": "reboot", "at_s": 2.0}


@settings(deadline=None, derandomize=True)
@given(st.lists(st.tuples(st.floats(0.1, 3.0), st.floats(-1e6, 1e6) | st.none()), max_size=8))
def test_a_clock_runs_between_jumps_is_never_negative_and_remembers(course):
    clock, now_us, shown = BootClock(), 0, []
    for wait_s, by_s in course:
        now_us += round(wait_s * 250) * 4000
        before_us = now_us - clock.boot_us + clock.jump_us
        if by_s is None:
            clock.reboot(now_us)
            assert now_us - clock.boot_us + clock.jump_us == 0
        else:
            clock.jump(round(by_s * 1e6), now_us)
            after_us = now_us - clock.boot_us + clock.jump_us
            assert after_us == max(0, before_us + round(by_s * 1e6))
        later_s = (now_us + 4000) * 1e-6
        shown.append((later_s, clock.stamp_s(later_s)))
    for time_s, stamp_s in shown:
        assert clock.stamp_s(time_s) == pytest.approx(stamp_s, abs=1e-6) or (
            # Two changes at one moment: the second one counts.
            sum(abs(time_s - other) < 0.005 for other, _ in shown) > 1
        )


@pytest.mark.parametrize(("by_s", "after_s"), [(5.0, 6.5), (-0.7, 0.8), (-5.0, 0.0)])
@pytest.mark.parametrize("fly", [px4, copter], ids=["px4", "ardupilot"])
def test_all_stamps_jump_together_and_go_on(fly, by_s, after_s):
    client = fly({"fault": "clock_jump", "at_s": 1.5, "by_s": by_s})
    client.run_until(1.9)
    client.send(dialect.MAVLink_timesync_message(0, 12345))
    client.run_until(3.0)
    jumped_s = after_s - 1.5
    stamps = [
        (arrived_s, m.time_boot_ms / 1e3)
        for name in ("LOCAL_POSITION_NED", "ATTITUDE_QUATERNION")
        for arrived_s, m in client.received(name)
    ]
    stamps += [
        (arrived_s, m.time_usec / 1e6)
        for arrived_s, m in client.received("ODOMETRY", component=TRUTH_COMPONENT_ID)
    ]
    for arrived_s, stamp_s in stamps:
        expected_s = arrived_s + (jumped_s if arrived_s > 1.52 else 0.0)
        if not 1.499 < arrived_s < 1.56:
            assert stamp_s == pytest.approx(expected_s, abs=0.04)
    (answer,) = [(at, m.tc1 / 1e9) for at, m in client.received("TIMESYNC") if m.ts1 == 12345]
    assert answer[1] == pytest.approx(answer[0] + jumped_s, abs=0.04)
    assert told(client) == [(after_s, "clock", pytest.approx(by_s))]


def test_the_unix_time_does_not_jump_and_nothing_that_waits_is_upset():
    client = px4_in_offboard({"fault": "clock_jump", "at_s": 1.5, "by_s": 3600.0})
    client.run_until(4.0)
    before, *_, after = client.messages("SYSTEM_TIME")
    assert (after.time_unix_usec - before.time_unix_usec) / 1e6 == pytest.approx(2.0, abs=1.01)
    assert after.time_boot_ms > 3_600_000
    beat = client.simulation.autopilot.heartbeat
    assert (beat.custom_mode, beat.system_status) == (OFFBOARD, 4), "no stream was missed"


def test_a_clock_that_passes_the_32_bits_of_a_stamp_goes_round():
    client = px4({"fault": "clock_jump", "at_s": 1.5, "by_s": 4_294_967.296})
    client.run_until(2.5)
    assert client.last("ATTITUDE").time_boot_ms < 3000
    assert client.last("HIGHRES_IMU").time_usec > 4e12


def test_px4_that_reboots_in_flight_falls_and_begins_anew():
    client = px4_in_offboard(_REBOOT)
    client.set_interval(331, 10_000)
    client.run_until(2.0)
    client.forget()
    client.run_until(7.0)
    simulation = client.simulation
    assert not simulation.autopilot.armed
    assert simulation.state.on_ground
    quiet = [m for at_s, m in client.received("HEARTBEAT") if at_s < 2.44]
    assert quiet == []
    beats = client.received("HEARTBEAT")
    assert {m.base_mode & 0x80 for _, m in beats} == {0}
    assert beats[-1][1].system_status == 3, "it can be armed again"
    stamps = [m.time_boot_ms for m in client.messages("ATTITUDE")]
    assert stamps == sorted(stamps)
    assert 400 < stamps[0] < 600
    odometry = [at_s for at_s, _ in client.received("ODOMETRY") if at_s > 4.0]
    assert len(odometry) / 3.0 == pytest.approx(30.0, abs=2.0), "the default again"
    assert told(client) == [(0.0, "reboot", 1.0)]


def test_the_truth_goes_on_through_a_reboot():
    client = px4(_REBOOT)
    client.run_until(2.7)
    times = [at_s for at_s, _ in client.received("ODOMETRY", component=TRUTH_COMPONENT_ID)]
    assert max(b - a for a, b in pairwise(times)) < 0.03


def test_ardupilot_that_reboots_boots_as_it_always_does():
    client = copter(_REBOOT, boot_scale=0.1)
    client.run_until(2.05)
    client.forget()
    client.run_until(7.0)
    assert "EKF3 IMU0 is using GPS" in client.texts()
    assert client.mode == 0
    assert not client.copter.armed
    assert client.simulation.state.on_ground
    assert client.messages("LOCAL_POSITION_NED") == []
    client.set_interval(dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 20_000)
    client.run_until(8.0)
    assert client.last("LOCAL_POSITION_NED").time_boot_ms == pytest.approx(6000, abs=60)


def test_parameters_that_were_set_outlive_a_reboot():
    client = px4(_REBOOT)
    client.send(dialect.MAVLink_param_set_message(1, 1, b"MPC_Z_P", 0.75, 9))
    client.run_until(3.0)
    assert client.simulation.boots == 1
    assert client.simulation.autopilot.parameters["MPC_Z_P"] == 0.75
    client.send(dialect.MAVLink_param_request_read_message(1, 1, b"MPC_Z_P", -1))
    client.run(0.2)
    assert client.last("PARAM_VALUE").param_value == 0.75


def test_every_link_begins_anew_and_none_is_lost():
    kinds = (LinkKind.ONBOARD, LinkKind.GROUND_STATION)
    client = ShimClient(options_of("px4", {**_REBOOT, "at_s": 1.0}), kinds)
    client.run_until(3.0)
    for link in range(2):
        after = [m for at_s, m in client.received("HEARTBEAT", link=link) if at_s > 1.1]
        assert len(after) == 1
    assert client.simulation.elapsed_us == 3_000_000
    assert client.simulation.time_us == 2_000_000


def test_jumps_of_any_size_that_a_file_can_hold_leave_stamps_that_messages_can_hold():
    jumps = [{"fault": "clock_jump", "at_s": 0.6 + 0.1 * i, "by_s": 1e9} for i in range(12)]
    client = px4(*jumps)
    client.run_until(2.0)
    assert client.last("TIMESYNC").ts1 > 7.9e18
    assert client.last("ODOMETRY").time_usec > 7.9e15
