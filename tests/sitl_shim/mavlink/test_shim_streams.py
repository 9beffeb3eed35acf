"""Streams: default rates, intervals, their quantisation and limits, truth beside them."""

import itertools
import math

import pytest

from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import AUTO_LAND, ShimClient, airborne

_ONBOARD_HZ = {
    "ATTITUDE": 100,
    "ATTITUDE_QUATERNION": 50,
    "GLOBAL_POSITION_INT": 50,
    "HIGHRES_IMU": 50,
    "LOCAL_POSITION_NED": 30,
    "ODOMETRY": 30,
    "TIMESYNC": 10,
    "ALTITUDE": 10,
    "ATTITUDE_TARGET": 10,
    "POSITION_TARGET_LOCAL_NED": 10,
    "SERVO_OUTPUT_RAW": 10,
    "VFR_HUD": 10,
    "GPS_RAW_INT": 8,
    "SYS_STATUS": 5,
    "EXTENDED_SYS_STATE": 5,
    "HEARTBEAT": 1,
    "SYSTEM_TIME": 1,
    "PING": 1,
    "ESTIMATOR_STATUS": 1,
    "BATTERY_STATUS": 0.5,
    "HOME_POSITION": 0.5,
    "VIBRATION": 0.5,
    "CURRENT_MODE": 0.5,
}
_GROUND_HZ = {
    "ATTITUDE": 50,
    "ATTITUDE_QUATERNION": 50,
    "ATTITUDE_TARGET": 50,
    "GLOBAL_POSITION_INT": 50,
    "LOCAL_POSITION_NED": 50,
    "POSITION_TARGET_LOCAL_NED": 50,
    "SERVO_OUTPUT_RAW": 50,
    "GPS_RAW_INT": 5,
    "VFR_HUD": 4,
    "HEARTBEAT": 1,
    "SYS_STATUS": 1,
    "EXTENDED_SYS_STATE": 1,
    "ODOMETRY": 0,
    "TIMESYNC": 0,
}


@pytest.fixture(scope="module")
def booted() -> ShimClient:
    client = ShimClient(ShimOptions(), (LinkKind.ONBOARD, LinkKind.GROUND_STATION))
    client.run_until(6.0)
    client.forget()
    client.run(10.0)
    return client


@pytest.mark.parametrize("name", list(_ONBOARD_HZ))
def test_the_onboard_link_starts_with_the_rates_of_px4(booted: ShimClient, name: str) -> None:
    assert len(booted.messages(name)) == pytest.approx(_ONBOARD_HZ[name] * 10, abs=1)


@pytest.mark.parametrize("name", list(_GROUND_HZ))
def test_the_ground_stations_link_has_rates_of_its_own(booted: ShimClient, name: str) -> None:
    assert len(booted.messages(name, link=1)) == pytest.approx(_GROUND_HZ[name] * 10, abs=1)


def test_boot_times_are_multiples_of_the_tick(booted: ShimClient) -> None:
    for name in ("ATTITUDE", "LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "ATTITUDE_TARGET"):
        times = [m.time_boot_ms for m in booted.messages(name)]
        assert all(time % 4 == 0 for time in times)
        assert times == sorted(set(times))


def test_at_50_hz_the_steps_are_20_ms(booted: ShimClient) -> None:
    times = [m.time_boot_ms for m in booted.messages("ATTITUDE_QUATERNION")]
    assert {b - a for a, b in itertools.pairwise(times)} <= {16, 20, 24}


@pytest.mark.parametrize(
    ("name", "message_id", "interval_us", "per_second"),
    [
        ("ODOMETRY", 331, 10_000, 100),
        ("ODOMETRY", 331, 1_000, 125),
        ("LOCAL_POSITION_NED", 32, 4_000, 125),
        ("ATTITUDE_TARGET", 83, 4_000, 125),
        ("GLOBAL_POSITION_INT", 33, 5_000, 125),
        ("ATTITUDE", 30, 1_000, 250),
        ("ATTITUDE_QUATERNION", 31, 4_000, 250),
        ("HIGHRES_IMU", 105, 4_000, 250),
        ("HIL_STATE_QUATERNION", 115, 4_000, 250),
    ],
)
def test_intervals_are_kept_on_the_average_up_to_the_most_that_there_is(
    name: str, message_id: int, interval_us: int, per_second: int
) -> None:
    client = ShimClient(ShimOptions())
    client.run_until(1.0)
    client.set_interval(message_id, interval_us)
    client.run(0.2)
    assert client.acks(511) == [0]
    client.forget()
    client.run(2.0)
    assert len(client.messages(name)) == pytest.approx(2 * per_second, abs=2)


def test_the_current_mode_is_told_twice_a_second_and_at_once_when_it_changes() -> None:
    client = airborne()
    client.set_interval(436, 100_000)
    client.run(1.05)
    assert client.acks(511) == [0]
    client.forget()
    client.run(4.0)
    times = [time_s for time_s, _ in client.received("CURRENT_MODE")]
    assert [b - a for a, b in itertools.pairwise(times)] == pytest.approx([0.5] * 7)
    client.run(0.2)
    client.forget()
    client.set_mode(AUTO_LAND)
    changed_s = client.wait_for(
        lambda: client.simulation.autopilot.heartbeat.custom_mode == AUTO_LAND, 0.2
    )
    client.run(0.1)
    told = [t for t, m in client.received("CURRENT_MODE") if m.custom_mode == AUTO_LAND]
    assert len(told) == 1
    assert told[0] - changed_s < 0.03


def test_at_100_hz_the_steps_are_8_and_12_ms() -> None:
    client = ShimClient(ShimOptions())
    client.run_until(1.0)
    client.set_interval(331, 10_000)
    client.run(1.0)
    times = [m.time_usec for m in client.messages("ODOMETRY")][40:]
    assert {b - a for a, b in itertools.pairwise(times)} == {8_000, 12_000}


@pytest.mark.parametrize(
    ("predict_us", "step_us"),
    [(4_000, 4_000), (7_999, 4_000), (8_000, 8_000), (20_000, 20_000), (1_000, 4_000)],
)
def test_the_estimators_period_is_the_shortest_interval_of_what_it_publishes(
    predict_us: int, step_us: int
) -> None:
    client = ShimClient(ShimOptions(parameters={"EKF2_PREDICT_US": predict_us}))
    client.run_until(1.0)
    client.set_interval(331, 4_000)
    client.run(0.5)
    times = [m.time_usec for m in client.messages("ODOMETRY")][20:]
    assert {b - a for a, b in itertools.pairwise(times)} == {step_us}


def test_minus_one_stops_and_zero_restores() -> None:
    client = ShimClient(ShimOptions())
    client.run_until(1.0)
    client.set_interval(30, -1)
    client.run(0.1)
    client.forget()
    client.run(1.0)
    assert client.messages("ATTITUDE") == []
    client.set_interval(30, 0)
    client.run(0.1)
    client.forget()
    client.run(1.0)
    assert len(client.messages("ATTITUDE")) == pytest.approx(100, abs=1)


def test_an_interval_may_come_as_command_int() -> None:
    client = ShimClient(ShimOptions())
    client.run_until(1.0)
    client.send(dialect.MAVLink_command_int_message(1, 1, 0, 511, 0, 0, 331, 10_000, 0, 0, 0, 0, 0))
    client.run(0.2)
    client.forget()
    client.run(1.0)
    assert len(client.messages("ODOMETRY")) == pytest.approx(100, abs=1)


@pytest.mark.parametrize("message_id", [0, 9999, 253])
def test_an_interval_for_the_heartbeat_or_for_an_unknown_message_fails(message_id: int) -> None:
    client = ShimClient(ShimOptions())
    client.run_until(1.0)
    client.set_interval(message_id, 100_000)
    client.set_interval(math.nan, math.nan)
    client.run(0.1)
    assert client.acks(511) == [4, 4]


def test_the_interval_can_be_asked_for() -> None:
    client = ShimClient(ShimOptions())
    client.run_until(1.0)
    for message_id in (30, 105, 115):
        client.command(510, message_id)
    client.run(0.1)
    answers = [(m.message_id, m.interval_us) for m in client.messages("MESSAGE_INTERVAL")]
    assert answers == [(30, 10_000), (105, 20_000), (115, -1)]
    assert client.acks(510) == [0, 0, 0]


@pytest.mark.parametrize(
    ("asked_us", "answered_us"),
    [
        (3e9, 2**31 - 1),
        (1e30, -1),
        (math.inf, -1),
        (-math.inf, -1),
        (-0.5, -1),
        (0.5, 1),
        (math.nan, 33_333),
        (1e-6, 33_333),
    ],
)
def test_an_odd_interval_is_understood_as_px4_does_and_can_be_asked_for(
    asked_us: float, answered_us: int
) -> None:
    client = ShimClient(ShimOptions())
    client.run_until(1.0)
    client.set_interval(331, asked_us)
    client.command(510, 331)
    client.run(0.1)
    assert client.acks(511) == [0]
    assert [m.interval_us for m in client.messages("MESSAGE_INTERVAL")] == [answered_us]


# --- truth ---


def test_exact_truth_comes_from_a_component_of_its_own_at_100_and_25_hz(
    booted: ShimClient,
) -> None:
    assert len(booted.messages("ODOMETRY", component=240)) == pytest.approx(1000, abs=1)
    assert len(booted.messages("DEBUG_VECT", component=240)) == pytest.approx(250, abs=1)
    assert booted.messages("ODOMETRY", component=240, link=1) == []


def test_truth_is_sampled_at_the_instants_of_the_reported_odometry() -> None:
    client = ShimClient(ShimOptions(airborne_at_enu_m=(1.0, 2.0, 3.0)))
    client.run(0.5)
    client.set_interval(331, 10_000)
    client.run(0.2)
    client.forget()
    client.run(1.0)
    reported = [m.time_usec for m in client.messages("ODOMETRY")]
    assert reported == [m.time_usec for m in client.messages("ODOMETRY", component=240)]


def test_truth_in_odometry_is_the_plants_state() -> None:
    client = ShimClient(ShimOptions(airborne_at_enu_m=(1.0, 2.0, 30.0), vehicle="x500"))
    for _ in range(40):
        client.run(0.05)
        state = client.simulation.state
        east, north, up = state.position_enu_m
        ve, vn, vu = state.velocity_enu_m_s
        for m in client.messages("ODOMETRY", component=240)[-1:]:
            if m.time_usec == client.simulation.time_us:
                assert (m.x, m.y, m.z) == pytest.approx((north, east, -up), abs=1e-6)
                assert (m.vx, m.vy, m.vz) == pytest.approx((vn, ve, -vu), abs=1e-6)
    m = client.last("ODOMETRY", component=240)
    assert (m.x, m.y, m.z) == pytest.approx((2.0, 1.0, -30.0), abs=0.5)
    assert m.frame_id == m.child_frame_id == 1


def test_truth_can_be_switched_off() -> None:
    client = ShimClient(ShimOptions(truth=False))
    client.run_until(2.0)
    assert {m.get_srcComponent() for _, m in client.inbox()} == {1}


def test_the_truths_component_takes_intervals_of_its_own() -> None:
    client = ShimClient(ShimOptions())
    client.run_until(1.0)
    client.command(511, 250, -1, target=(1, 240))
    client.command(511, 331, 20_000, target=(1, 240))
    client.run(0.1)
    client.forget()
    client.run(1.0)
    assert client.messages("DEBUG_VECT", component=240) == []
    assert len(client.messages("ODOMETRY", component=240)) == pytest.approx(50, abs=1)


def test_truth_as_px4_gives_it_is_coarse_and_has_no_time() -> None:
    client = ShimClient(ShimOptions(airborne_at_enu_m=(1.0, 2.0, 30.0)))
    client.run(0.6)
    assert client.messages("HIL_STATE_QUATERNION") == []
    client.set_interval(115, 20_000)
    client.run(0.5)
    exact = client.last("ODOMETRY", component=240)
    coarse = client.last("HIL_STATE_QUATERNION")
    assert coarse.time_usec == 0
    assert coarse.alt / 1e3 - 489.4 == pytest.approx(-exact.z, abs=0.01)
    north = math.radians(coarse.lat / 1e7 - 47.3977418) * 6_371_000.0
    assert north == pytest.approx(exact.x, abs=0.02)
    assert coarse.vz == pytest.approx(exact.vz * 100.0, abs=3.0)


def test_the_winds_push_is_told_in_ned() -> None:
    client = ShimClient(ShimOptions(airborne_at_enu_m=(0.0, 0.0, 30.0), scenario="wind3"))
    client.run(1.0)
    east, north, up = client.simulation.state.wind_acceleration_enu_m_s2
    assert max(abs(east), abs(north)) > 0.1
    told = client.last("DEBUG_VECT", component=240)
    assert told.name == "wind_acc"
    assert (told.x, told.y, told.z) == pytest.approx((north, east, -up), abs=0.02)


# --- contents that carry traps ---


def test_odometry_says_that_its_velocity_is_in_ned() -> None:
    client = ShimClient(ShimOptions(airborne_at_enu_m=(0.0, 0.0, 30.0)))
    client.run(1.0)
    odometry, local = client.last("ODOMETRY"), client.last("LOCAL_POSITION_NED")
    assert odometry.frame_id == odometry.child_frame_id == 1
    assert (odometry.vx, odometry.vy, odometry.vz) == pytest.approx(
        (local.vx, local.vy, local.vz), abs=0.1
    )


def test_position_target_is_nan_while_idle(booted: ShimClient) -> None:
    target = booted.last("POSITION_TARGET_LOCAL_NED")
    assert all(math.isnan(value) for value in (target.x, target.y, target.z, target.vx))
    assert target.type_mask == 63


def test_position_target_tells_the_place_that_is_held() -> None:
    client = ShimClient(ShimOptions(airborne_at_enu_m=(1.0, 2.0, 30.0)))
    client.run(1.0)
    target = client.last("POSITION_TARGET_LOCAL_NED")
    assert (target.x, target.y, target.z) == pytest.approx((2.0, 1.0, -30.0), abs=0.1)
    assert target.yaw == pytest.approx(math.pi / 2.0, abs=0.05)
    assert target.type_mask == 0


def test_servo_outputs_are_900_disarmed_and_above_1000_armed() -> None:
    client = ShimClient(ShimOptions(airborne_at_enu_m=(0.0, 0.0, 30.0)))
    client.run(1.0)
    assert 1300 < client.last("SERVO_OUTPUT_RAW").servo1_raw < 1700
    grounded = ShimClient(ShimOptions())
    grounded.run(1.0)
    assert grounded.last("SERVO_OUTPUT_RAW").servo1_raw == 900
