"""GUIDED under setpoints: masks, meanings of thrust, time-out, as ArduCopter was measured."""

import math
from collections.abc import Callable

import pytest

from sitl_shim.autopilot.ardupilot.guided import Submode
from sitl_shim.mavlink.wire import dialect
from tests.sitl_shim.autopilot.copter_client import (
    BRAKE,
    GUIDED,
    GUIDED_NOGPS,
    CopterClient,
    grounded,
    hovering,
    tilted,
)
from tests.sitl_shim.mavlink.shim_client import SET_MODE

_LEVEL = tilted()
_HOVER = 0.3659


def _stream(client: CopterClient, **setpoint: object) -> Callable[[], None]:
    return client.every(0.02, lambda: client.setpoint(**setpoint))  # type: ignore[arg-type]


def _velocity(client: CopterClient) -> tuple[float, float, float]:
    return client.simulation.state.velocity_enu_m_s


@pytest.mark.parametrize(
    ("thrust", "climb_m_s"),
    [(0.5, 0.0), (0.6, 0.5), (0.4, -0.3), (0.75, 1.25), (1.0, 2.5), (0.0, -1.5), (7.0, 2.5)],
)
def test_thrust_is_a_climb_rate_by_default(thrust: float, climb_m_s: float) -> None:
    client = hovering()
    _stream(client, q=_LEVEL, thrust=thrust)
    client.run(6.0)
    assert _velocity(client)[2] == pytest.approx(climb_m_s, abs=0.06)


def test_the_speeds_of_wpnav_scale_the_climb_rate() -> None:
    client = hovering(parameters={"WPNAV_SPEED_UP": 100, "WPNAV_SPEED_DN": 50})
    stop = _stream(client, q=_LEVEL, thrust=1.0)
    client.run(4.0)
    assert _velocity(client)[2] == pytest.approx(1.0, abs=0.06)
    stop()
    _stream(client, q=_LEVEL, thrust=0.0)
    client.run(5.0)
    assert _velocity(client)[2] == pytest.approx(-0.5, abs=0.06)


@pytest.mark.parametrize("tilt_deg", [0.0, 30.0])
def test_as_throttle_it_is_divided_by_the_cosine_of_the_tilt(tilt_deg: float) -> None:
    client = hovering(parameters={"GUID_OPTIONS": 8})
    _stream(client, q=tilted(roll_deg=tilt_deg), thrust=_HOVER)
    client.run(1.0)
    before = _velocity(client)[2]
    client.run(0.5)
    assert (_velocity(client)[2] - before) / 0.5 == pytest.approx(0.0, abs=0.7)
    assert client.tilt_deg == pytest.approx(tilt_deg, abs=1.0)


def test_without_angle_boost_a_tilt_sinks() -> None:
    client = hovering(parameters={"GUID_OPTIONS": 8, "ATC_ANGLE_BOOST": 0})
    _stream(client, q=tilted(roll_deg=30.0), thrust=_HOVER)
    client.run(2.0)
    assert _velocity(client)[2] < -1.0


def test_a_unit_of_throttle_is_26_8_m_s2() -> None:
    client = hovering(parameters={"GUID_OPTIONS": 8})
    _stream(client, q=_LEVEL, thrust=_HOVER + 0.1)
    client.run(0.3)
    before = _velocity(client)[2]
    client.run(0.2)
    drag = 0.2 * before + 0.034 * before * before
    assert (_velocity(client)[2] - before) / 0.2 + drag == pytest.approx(2.68, rel=0.1)


def test_the_meaning_of_thrust_changes_in_flight() -> None:
    client = hovering()
    stop = _stream(client, q=_LEVEL, thrust=0.5)
    client.run(2.0)
    client.copter.parameters.set("GUID_OPTIONS", 8)
    client.run(0.5)
    assert _velocity(client)[2] > 1.0  # half the throttle is more than hover
    client.copter.parameters.set("GUID_OPTIONS", 0)
    client.run(5.0)
    assert abs(_velocity(client)[2]) < 0.06
    stop()


def test_angle_max_does_not_limit_attitude_targets() -> None:
    client = hovering()
    assert client.copter.parameters["ANGLE_MAX"] == 3000
    _stream(client, q=tilted(pitch_deg=-50.0), thrust=0.5)
    client.run(1.5)
    assert client.tilt_deg == pytest.approx(50.0, abs=1.0)


def test_positive_pitch_flies_backwards_and_yaw_is_absolute() -> None:
    client = hovering()
    _stream(client, q=tilted(pitch_deg=5.0, yaw_deg=90.0), thrust=0.5)
    client.run(2.0)
    assert _velocity(client)[0] < -0.5  # nose to the east, and up
    client = hovering()
    _stream(client, q=tilted(yaw_deg=0.0), thrust=0.5)
    client.run(4.0)
    assert client.heading_deg == pytest.approx(0.0, abs=1.5)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ("mask", "place"), [(128, 0), (128, 1), (128, 2), (0, 0), (0, 2), (128, 3), (7, 3)]
)
def test_what_is_no_number_is_rejected_and_does_no_lasting_harm(
    bad: float, mask: int, place: int
) -> None:
    client = hovering()
    stop = _stream(client, q=_LEVEL, thrust=0.5)
    client.run(1.0)
    stop()
    numbers = [0.0, 0.0, 0.0, 0.5]
    numbers[place] = bad
    p, q, r, thrust = numbers
    client.setpoint(_LEVEL, thrust, mask=mask, rates=(p, q, r))
    client.run(0.5)
    assert client.copter._guided.submode is Submode.VELOCITY
    assert client.tilt_deg < 2.0
    _stream(client, q=_LEVEL, thrust=0.5)
    client.run(1.5)
    assert client.tilt_deg < 1.0
    assert abs(_velocity(client)[2]) < 0.1


def test_rates_that_are_ignored_may_be_anything() -> None:
    client = hovering()
    _stream(client, q=tilted(roll_deg=5.0), thrust=0.5, rates=(math.nan,) * 3)
    client.run(1.5)
    assert client.tilt_deg == pytest.approx(5.0, abs=1.0)


def test_rates_alone_turn_the_vehicle() -> None:
    client = hovering()
    _stream(client, q=(0.0, 0.0, 0.0, 0.0), mask=128, rates=(0.0, 0.0, 0.3), thrust=0.5)
    client.run(1.0)
    before = client.heading_deg
    client.run(2.0)
    assert client.heading_deg - before == pytest.approx(math.degrees(0.6), rel=0.05)


def test_rates_beside_an_attitude_keep_turning_it_between_messages() -> None:
    client = hovering()
    client.run(1.0)
    client.setpoint(_LEVEL, 0.5, mask=0, rates=(0.0, 0.0, 0.3))
    client.run(2.5)  # one message, and GUID_TIMEOUT is 3 s
    assert client.heading_deg - 90.0 == pytest.approx(math.degrees(0.75), rel=0.15)


@pytest.mark.parametrize(
    ("mask", "q"),
    [
        (3, tilted(roll_deg=10.0)),
        (4, tilted(roll_deg=10.0)),
        (71, tilted(roll_deg=10.0)),
        (7, tuple(1.01 * part for part in tilted(roll_deg=10.0))),
        (7, (0.0, 0.0, 0.0, 0.0)),
        (7, (math.nan, 0.0, 0.0, 0.0)),
    ],
    ids=["mask 3", "mask 4", "no thrust", "long", "zero", "nan"],
)
def test_what_is_rejected_stops_the_vehicle(mask: int, q: tuple[float, ...]) -> None:
    client = hovering()
    stop = _stream(client, q=tilted(roll_deg=8.0), thrust=0.5)
    client.run(2.0)
    stop()
    assert math.hypot(*_velocity(client)) > 1.5
    assert client.copter.heartbeat.base_mode == 209  # the bit of a controlled position is off
    _stream(client, q=q, mask=mask, rates=(0.0, 0.0, 0.3), thrust=0.5)
    client.run(5.0)
    assert math.hypot(*_velocity(client)) < 0.15
    assert client.copter.heartbeat.base_mode == 217
    assert client.mode == GUIDED


def test_a_norm_within_a_thousandth_is_accepted() -> None:
    client = hovering()
    _stream(client, q=tuple(1.0009 * part for part in tilted(roll_deg=10.0)), thrust=0.5)
    client.run(1.0)
    assert client.tilt_deg == pytest.approx(10.0, abs=0.6)


def test_sys_status_tells_what_is_controlled() -> None:
    client = hovering()
    xy, z = 0x4000, 0x2000

    def controlled() -> int:
        client.run(0.1)
        return client.copter.sensor_health.enabled & (xy | z)

    assert controlled() == xy | z
    _stream(client, q=_LEVEL, thrust=0.5)
    assert controlled() == z
    client.copter.parameters.set("GUID_OPTIONS", 8)
    assert controlled() == 0


@pytest.mark.parametrize("timeout_s", [3.0, 0.5])
def test_the_last_target_holds_until_the_timeout_then_it_levels_and_drifts(
    timeout_s: float,
) -> None:
    client = hovering(parameters={"GUID_TIMEOUT": timeout_s})
    stop = _stream(client, q=tilted(roll_deg=8.0), thrust=0.7)
    client.run(1.0)
    stop()
    client.run(timeout_s - 0.1)
    assert client.tilt_deg == pytest.approx(8.0, abs=0.6)
    client.run(2.0)
    assert client.tilt_deg < 0.6
    assert abs(_velocity(client)[2]) < 0.2
    assert math.hypot(*_velocity(client)[:2]) > 0.5
    assert client.mode == GUIDED
    assert client.texts() == []
    _stream(client, q=tilted(roll_deg=8.0), thrust=0.5)
    client.run(0.6)
    assert client.tilt_deg > 7.0


def test_setpoints_outside_of_guided_are_ignored() -> None:
    client = hovering()
    client.choose(BRAKE)
    _stream(client, q=tilted(roll_deg=15.0), thrust=0.5)
    client.run(2.0)
    assert client.tilt_deg < 1.0
    assert client.acks(SET_MODE) == [0]


def test_guided_nogps_obeys_attitude_targets() -> None:
    client = hovering()
    client.choose(GUIDED_NOGPS)
    _stream(client, q=tilted(roll_deg=8.0), thrust=0.6)
    client.run(2.0)
    assert client.tilt_deg == pytest.approx(8.0, abs=0.6)
    assert _velocity(client)[2] == pytest.approx(0.5, abs=0.1)


def test_on_the_ground_only_a_positive_climb_lifts_off() -> None:
    client = grounded()
    client.ready()
    client.arm()
    stop = _stream(client, q=_LEVEL, thrust=0.5)
    client.run(2.0)
    assert client.simulation.state.on_ground
    stop()
    _stream(client, q=_LEVEL, thrust=0.6)
    client.run(3.0)
    assert client.simulation.state.position_enu_m[2] > 0.5


def test_level_drifts_by_what_the_level_is_off() -> None:
    client = hovering()
    _stream(client, q=_LEVEL, thrust=0.5)
    client.run(3.0)
    begin = _velocity(client)
    client.run(1.0)
    gained = math.dist(begin[:2], _velocity(client)[:2])
    assert 0.02 < gained < 0.10  # 0.06 m/s2 was measured, less drag


# --- positions and velocities ---


def _position_target(client: CopterClient, mask: int, **fields: float) -> None:
    values = dict.fromkeys(("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz"), 0.0) | fields
    client.send(
        dialect.MAVLink_set_position_target_local_ned_message(
            round(client.time_s * 1000), 1, 1, 1, mask, *values.values(), 0.0, 0.0
        )
    )


def test_a_position_is_gone_to() -> None:
    client = hovering()
    _position_target(client, 0xDF8, x=3.0, y=2.0, z=-32.0)
    client.run(10.0)
    assert math.dist(client.simulation.state.position_enu_m, (2.0, 3.0, 32.0)) < 0.15


def test_a_velocity_holds_until_the_timeout() -> None:
    client = hovering()
    stop = client.every(0.1, lambda: _position_target(client, 0xDC7, vx=1.0, vz=-0.5))
    client.run(4.0)
    assert _velocity(client)[1] == pytest.approx(1.0, abs=0.1)
    assert _velocity(client)[2] == pytest.approx(0.5, abs=0.1)
    stop()
    client.run(7.0)
    assert math.hypot(*_velocity(client)) < 0.1


def test_a_whole_trajectory_is_followed_closely_and_positions_alone_late() -> None:
    def error_m(mask: int) -> float:
        client = hovering()
        radius, omega = 2.0, 0.5
        begin = client.time_s

        def send() -> None:
            phase = omega * (client.time_s - begin)
            c, s = math.cos(phase), math.sin(phase)
            _position_target(
                client,
                mask,
                x=radius * s,
                y=radius * (1.0 - c),
                z=-30.0,
                vx=radius * omega * c,
                vy=radius * omega * s,
                afx=-radius * omega**2 * s,
                afy=radius * omega**2 * c,
            )

        client.every(0.02, send)
        client.run(8.0)
        worst = 0.0
        for _ in range(200):
            client.run(0.02)
            phase = omega * (client.time_s - begin)
            goal = (radius * (1.0 - math.cos(phase)), radius * math.sin(phase), 30.0)
            worst = max(worst, math.dist(goal, client.simulation.state.position_enu_m))
        return worst

    assert error_m(0xC00) < 0.15
    assert 0.6 < error_m(0xDF8) < 1.6
