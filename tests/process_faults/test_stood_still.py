"""The companion's process is stopped and goes on: a failsafe that has acted is not taken back."""

import pytest

from tests.process_faults.harness import (
    ACTIVE,
    BRAKE,
    GUIDED,
    PX4_OFFBOARD,
    TILT_LIMIT_DEG,
    assert_logs_reach,
    sent_tilts_deg,
)

pytestmark = [pytest.mark.realtime, pytest.mark.faults, pytest.mark.timeout(150)]

ABORTED = 4


def test_what_px4s_failsafe_took_in_three_seconds_is_left_to_it(tracking):
    vehicle, companion = tracking("px4")
    vehicle.wait(0.5)
    stopped_s = vehicle.clock_s
    woken_unix_s = companion.stop(3.0)
    woken_s = vehicle.clock_s
    assert vehicle.said("Failsafe activated")
    assert stopped_s < vehicle.said("Failsafe activated")[0] < woken_s
    assert companion.tells("the autopilot has landed and disarmed the vehicle")
    heard_s = vehicle.clock_s
    status, result = companion.end()
    assert status == ABORTED
    assert sent_tilts_deg(companion, woken_unix_s) == []
    assert (PX4_OFFBOARD, ACTIVE) not in vehicle.modes_after(woken_s)
    assert result["outcome"] == "aborted"
    assert "handed over: " in companion.told()
    assert vehicle.worst_tilt_deg < TILT_LIMIT_DEG
    assert_logs_reach(companion, stopped_s, heard_s)


def test_after_three_seconds_of_ardupilots_drifting_the_companion_gives_up(tracking):
    vehicle, companion = tracking("ardupilot", "--set=timeouts.handed_over_s=5")
    vehicle.wait(0.5)
    stopped_s = vehicle.clock_s
    woken_unix_s = companion.stop(3.0)
    assert vehicle.mode == GUIDED, "nothing of its own has acted"
    vehicle.wait_until(lambda: vehicle.mode == BRAKE)
    assert companion.tells("nobody resumed")
    heard_s = vehicle.clock_s
    status, result = companion.end()
    assert status == ABORTED
    assert "handing over: " in companion.told()
    assert result["outcome"] == "aborted"
    # Level, until it brakes.
    assert max(sent_tilts_deg(companion, woken_unix_s), default=0.0) < 0.1
    assert vehicle.worst_tilt_deg < TILT_LIMIT_DEG
    assert_logs_reach(companion, stopped_s, heard_s)
