"""Arming, modes, acknowledgements and auto-disarm, as PX4 v1.17 was measured."""

import pytest

from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import (
    ALTCTL,
    ARM,
    AUTO_LAND,
    AUTO_LOITER,
    AUTO_RTL,
    AUTO_TAKEOFF,
    LAND,
    NAN,
    OFFBOARD,
    POSCTL,
    SET_MODE,
    TAKEOFF,
    ShimClient,
    airborne,
)

_FORCE = 21196
_ARMED = 0x80


@pytest.fixture
def grounded() -> ShimClient:
    return ShimClient(ShimOptions(seed=1))


def _mode(client: ShimClient) -> int:
    return client.simulation.autopilot.heartbeat.custom_mode


def _armed(client: ShimClient) -> bool:
    return client.simulation.autopilot.armed


def test_arming_is_denied_until_the_estimator_is_up(grounded: ShimClient) -> None:
    grounded.run_until(4.0)
    grounded.heartbeat(6)
    grounded.command(ARM, 1)
    grounded.run_until(4.15)
    assert grounded.acks(ARM) == [1]
    assert "".join(grounded.texts()) == "Arming denied: Resolve system health failures first\t"
    grounded.run_until(4.25)
    grounded.command(ARM, 1)
    grounded.run_until(4.4)
    assert grounded.acks(ARM) == [1, 0]


def test_a_forced_arming_passes_the_checks(grounded: ShimClient) -> None:
    grounded.run_until(2.0)
    grounded.command(ARM, 1, _FORCE)
    grounded.run(0.1)
    assert grounded.acks(ARM) == [0]
    assert _armed(grounded)


def test_arming_what_is_armed_is_accepted(grounded: ShimClient) -> None:
    grounded.boot()
    grounded.command(ARM, 1)
    grounded.command(ARM, 1)
    grounded.run(0.1)
    assert grounded.acks(ARM) == [0, 0]


def test_the_prearm_bit_says_when_arming_will_work(grounded: ShimClient) -> None:
    prearm = 0x10000000
    grounded.run_until(3.9)
    assert not grounded.last("SYS_STATUS").onboard_control_sensors_health & prearm
    grounded.run_until(5.0)
    status = grounded.last("SYS_STATUS")
    assert status.onboard_control_sensors_present == 0x0300402F
    assert status.onboard_control_sensors_enabled == 0x0301402F
    assert status.onboard_control_sensors_health == 0x1320C83F


def test_an_armed_vehicle_that_does_not_take_off_disarms_after_ten_seconds(
    grounded: ShimClient,
) -> None:
    grounded.boot()
    grounded.command(ARM, 1)
    grounded.run(9.9)
    assert _armed(grounded)
    grounded.run(0.3)
    assert not _armed(grounded)


def test_disarming_in_the_air_is_refused_unless_forced() -> None:
    client = airborne()
    client.command(ARM, 0)
    client.run(0.1)
    assert client.acks(ARM) == [1]
    assert _armed(client)
    client.command(ARM, 0, _FORCE)
    client.run(0.5)
    assert client.acks(ARM) == [1, 0]
    assert client.simulation.state.velocity_enu_m_s[2] < -3.0


def test_take_off_climbs_to_the_parameter_and_then_holds(grounded: ShimClient) -> None:
    grounded.boot()
    grounded.command(ARM, 1)
    grounded.take_off()
    grounded.run(1.0)
    assert _mode(grounded) == AUTO_TAKEOFF
    since_s = grounded.time_s
    held_s = grounded.wait_for(lambda: _mode(grounded) == AUTO_LOITER, 9.0)
    assert 4.5 <= held_s - since_s <= 7.5
    grounded.run(4.0)
    assert grounded.simulation.state.position_enu_m[2] == pytest.approx(2.5, abs=0.15)


def test_take_off_to_an_altitude_below_the_ground_stays_there_and_says_why(
    grounded: ShimClient,
) -> None:
    grounded.boot()
    grounded.heartbeat(6)
    grounded.command(ARM, 1)
    grounded.command(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 3.0)  # above the sea, like the ground's 489
    heading = grounded.attitude()
    grounded.run(6.0)
    assert grounded.acks(TAKEOFF) == [0]
    assert grounded.texts().count("Already higher than takeoff altitude\t") == 1
    assert _mode(grounded) == AUTO_TAKEOFF
    assert _armed(grounded)
    assert grounded.simulation.state.on_ground
    assert grounded.attitude() == pytest.approx(heading, abs=0.02)
    grounded.run(4.5)
    assert not _armed(grounded)


def test_take_off_in_the_air_to_an_altitude_below_holds_the_present_one() -> None:
    client = airborne()
    client.command(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 500.0)  # 11 m above the ground
    client.run(3.0)
    assert _mode(client) == AUTO_LOITER
    assert client.simulation.state.position_enu_m[2] == pytest.approx(30.0, abs=0.3)


def test_take_off_to_an_altitude_above_the_sea_goes_there(grounded: ShimClient) -> None:
    grounded.boot()
    grounded.command(ARM, 1)
    altitude_m = grounded.simulation.origin.altitude_amsl_m + 4.0
    grounded.command(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, altitude_m)
    grounded.run(1.0)
    grounded.wait_for(lambda: _mode(grounded) == AUTO_LOITER, 12.0)
    grounded.run(3.0)
    assert grounded.simulation.state.position_enu_m[2] == pytest.approx(4.0, abs=0.2)


def test_take_off_of_a_disarmed_vehicle_only_changes_the_mode(grounded: ShimClient) -> None:
    grounded.boot()
    grounded.take_off()
    grounded.run(3.0)
    assert _mode(grounded) == AUTO_TAKEOFF
    assert not _armed(grounded)
    assert grounded.simulation.state.on_ground
    grounded.command(ARM, 1)
    grounded.run(8.0)
    assert grounded.simulation.state.position_enu_m[2] > 1.5


def test_landing_ends_disarmed_in_hold_two_seconds_after_touch_down() -> None:
    client = ShimClient(ShimOptions(airborne_at_enu_m=(0.0, 0.0, 2.0), seed=1))
    client.run(1.0)
    client.every(1.0, lambda: client.heartbeat(6))
    client.command(LAND)
    client.run(0.5)
    assert client.last("EXTENDED_SYS_STATE").landed_state == 4
    touched_s = client.wait_for(lambda: client.simulation.state.on_ground, 6.0)
    disarmed_s = client.wait_for(lambda: not _armed(client), 6.0)
    assert 2.5 <= disarmed_s - touched_s <= 3.6
    client.run(1.0)
    assert _mode(client) == AUTO_LOITER
    assert client.texts()[-2:] == ["Landing detected\t", "Disarmed by landing\t"]


def test_set_mode_is_acknowledged_twice_and_only_the_second_counts() -> None:
    client = airborne()
    client.heartbeat(6)
    client.set_mode(OFFBOARD)
    client.run(0.3)
    assert client.acks(SET_MODE) == [0, 1]
    assert _mode(client) == AUTO_LOITER
    assert client.texts() == ["Switching to Offboard is currently not available\t"]
    times = [t for t, m in client.received("COMMAND_ACK") if m.command == SET_MODE]
    assert 0.0 <= times[1] - times[0] <= 0.14


def test_modes_for_sticks_are_refused_in_the_air() -> None:
    client = airborne()
    for mode in (POSCTL, ALTCTL):
        client.set_mode(mode)
        client.run(0.3)
    assert client.acks(SET_MODE) == [0, 1, 0, 1]


def test_disarmed_any_mode_may_be_chosen_but_arming_then_fails(grounded: ShimClient) -> None:
    grounded.boot()
    for mode in (OFFBOARD, POSCTL, AUTO_LAND, AUTO_RTL):
        grounded.set_mode(mode)
        grounded.run(0.3)
        assert _mode(grounded) == mode
        assert grounded.simulation.autopilot.heartbeat.system_status == 0
        grounded.command(ARM, 1)
        grounded.run(0.3)
        assert not _armed(grounded)
    assert grounded.acks(SET_MODE) == [0] * 8
    assert grounded.acks(ARM) == [1] * 4


def test_an_unknown_mode_is_refused(grounded: ShimClient) -> None:
    grounded.boot()
    grounded.command(SET_MODE, 1, 99, 0)
    grounded.command(SET_MODE, 0, 6, 0)  # without the bit for custom modes
    grounded.command(SET_MODE, float("nan"), float("nan"), 0)
    grounded.run(0.3)
    assert sorted(grounded.acks(SET_MODE)) == [0, 0, 0, 1, 1, 1]
    assert _mode(grounded) == AUTO_LOITER


def test_with_a_stream_it_arms_in_offboard_and_leaves_the_ground_without_a_ramp() -> None:
    client = ShimClient(ShimOptions(vehicle="sih_quadx", seed=2))
    client.boot()
    stop = client.start_stream((0.7071, 0.0, 0.0, 0.7071), 0.05)
    client.run(0.5)
    client.set_mode(OFFBOARD)
    client.run(0.3)
    assert client.simulation.autopilot.heartbeat.base_mode == 0x11
    assert client.simulation.autopilot.heartbeat.system_status == 3
    client.command(ARM, 1)
    client.run(0.5)
    assert client.simulation.autopilot.heartbeat.base_mode == 0x91
    stop()
    client.start_stream((0.7071, 0.0, 0.0, 0.7071), 0.6)
    begin_s = client.time_s
    reached_s = client.wait_for(lambda: client.simulation.state.position_enu_m[2] >= 2.0, 4.0)
    assert reached_s - begin_s == pytest.approx(1.9, rel=0.15)


def test_return_goes_home_low_when_near_and_lands() -> None:
    client = ShimClient(ShimOptions(seed=1))
    client.boot()
    client.command(ARM, 1)
    client.take_off()
    client.run(10.0)
    client.start_stream((0.7071, 0.0, -0.04, 0.7071), 0.49)
    client.run(0.3)
    client.set_mode(OFFBOARD)
    client.wait_for(lambda: client.simulation.state.position_enu_m[0] > 4.0, 10.0)
    client.command(20)
    client.run(0.2)
    assert _mode(client) == AUTO_RTL
    highest = 0.0
    while _armed(client):
        client.run(0.1)
        highest = max(highest, client.simulation.state.position_enu_m[2])
        assert client.time_s < 90.0
    x, y, _ = client.simulation.state.position_enu_m
    assert (x, y) == pytest.approx((0.0, 0.0), abs=0.6)
    assert highest < 12.0


@pytest.mark.parametrize(("vehicle", "scenario"), [("bebop2", "wind3"), ("x500", "gusts")])
def test_hold_stays_in_its_place_in_wind(vehicle: str, scenario: str) -> None:
    client = ShimClient(
        ShimOptions(vehicle=vehicle, scenario=scenario, seed=1, airborne_at_enu_m=(0.0, 0.0, 20.0))
    )
    client.run(12.0)  # the wind was not there before
    for _ in range(20):
        client.run(0.25)
        assert client.simulation.state.position_enu_m == pytest.approx((0.0, 0.0, 20.0), abs=1.0)
