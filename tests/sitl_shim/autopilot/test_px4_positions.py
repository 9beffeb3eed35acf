"""Position setpoints in OFFBOARD, and going somewhere from Hold."""

import math

import pytest

from sitl_shim.mavlink.geodesy import global_position
from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import (
    ARM,
    AUTO_LOITER,
    NAN,
    OFFBOARD,
    ShimClient,
    airborne,
)

_REPOSITION, _CHANGE_SPEED = 192, 178
_LOCAL_NED, _BODY_NED, _GLOBAL_INT, _RELATIVE_INT = 1, 8, 5, 6
_NO_POSITION, _NO_VELOCITY, _NO_ACCELERATION = 0x007, 0x038, 0x1C0
_FORCE, _NO_YAW, _NO_YAW_RATE = 0x200, 0x400, 0x800
_POSITION_ONLY = _NO_VELOCITY | _NO_ACCELERATION | _NO_YAW_RATE
_VELOCITY_ONLY = _NO_POSITION | _NO_ACCELERATION | _NO_YAW_RATE
_NORTH_ENU = (0.0, 1.0)


def _set(
    client: ShimClient,
    mask: int,
    *,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0),
    yaw: float = 0.0,
    yaw_rate: float = 0.0,
    frame: int = _LOCAL_NED,
) -> None:
    """SET_POSITION_TARGET_LOCAL_NED, as given."""
    client.send(
        dialect.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, frame, mask, *position, *velocity, *acceleration, yaw, yaw_rate
        )
    )


def _offboard(client: ShimClient, mask: int, **fields: object) -> None:
    client.every(0.05, lambda: _set(client, mask, **fields))  # type: ignore[arg-type]
    client.run(0.3)
    client.set_mode(OFFBOARD)
    client.run(0.3)
    assert client.simulation.autopilot.heartbeat.custom_mode == OFFBOARD


def _position(client: ShimClient) -> tuple[float, float, float]:
    position: tuple[float, float, float] = client.simulation.state.position_enu_m
    return position


def _velocity(client: ShimClient) -> tuple[float, float, float]:
    velocity: tuple[float, float, float] = client.simulation.state.velocity_enu_m_s
    return velocity


def test_a_position_and_a_yaw_are_flown_to() -> None:
    client = airborne()
    _offboard(client, _POSITION_ONLY, position=(4.0, -3.0, -32.0), yaw=math.pi)
    client.run(12.0)
    assert _position(client) == pytest.approx((-3.0, 4.0, 32.0), abs=0.15)
    assert abs(client.last("ATTITUDE").yaw) == pytest.approx(math.pi, abs=0.05)
    assert client.simulation.autopilot.heartbeat.base_mode == 0x91


def test_a_velocity_is_flown() -> None:
    client = airborne()
    _offboard(client, _VELOCITY_ONLY | _NO_YAW, velocity=(1.5, 0.0, -0.5))
    client.run(8.0)
    assert _velocity(client) == pytest.approx((0.0, 1.5, 0.5), abs=0.1)


def test_a_velocity_along_the_nose_is_turned() -> None:
    client = airborne()
    facing = client.last("ATTITUDE").yaw
    _offboard(client, _VELOCITY_ONLY | _NO_YAW, velocity=(1.0, 0.0, 0.0), frame=_BODY_NED)
    client.run(8.0)
    east, north, _ = _velocity(client)
    assert math.hypot(east, north) == pytest.approx(1.0, abs=0.1)
    assert math.atan2(east, north) == pytest.approx(facing, abs=0.15)


def test_velocity_across_with_a_held_height() -> None:
    client = airborne()
    mask = _NO_ACCELERATION | _NO_YAW | _NO_YAW_RATE | 0x003 | 0x020  # z, vx and vy are given
    _offboard(client, mask, position=(0.0, 0.0, -33.0), velocity=(0.0, 1.0, 0.0))
    client.run(10.0)
    assert _velocity(client) == pytest.approx((1.0, 0.0, 0.0), abs=0.1)
    assert _position(client)[2] == pytest.approx(33.0, abs=0.15)


def test_an_acceleration_is_flown() -> None:
    client = airborne()
    mask = _NO_POSITION | _NO_VELOCITY | _NO_YAW | _NO_YAW_RATE
    _offboard(client, mask, acceleration=(1.0, 0.0, 0.0))
    before = _velocity(client)
    client.run(1.0)
    gained = _velocity(client)[1] - before[1]
    assert 0.6 < gained < 1.1, "air resists"


def test_a_global_position_is_flown_to() -> None:
    client = airborne()
    latitude, longitude, altitude_mm = global_position(client.simulation.origin, (5.0, 2.0, 31.0))
    client.every(
        0.05,
        lambda: client.send(
            dialect.MAVLink_set_position_target_global_int_message(
                0, 1, 1, _GLOBAL_INT, _POSITION_ONLY | _NO_YAW,
                latitude, longitude, altitude_mm / 1000.0, 0, 0, 0, 0, 0, 0, 0, 0,
            )
        ),
    )  # fmt: skip
    client.run(0.3)
    client.set_mode(OFFBOARD)
    client.run(12.0)
    assert _position(client) == pytest.approx((5.0, 2.0, 31.0), abs=0.15)


@pytest.mark.parametrize(
    ("mask", "frame"),
    [
        (_NO_POSITION | _NO_VELOCITY | _NO_ACCELERATION, _LOCAL_NED),
        (_POSITION_ONLY | _FORCE, _LOCAL_NED),
        (_POSITION_ONLY, 17),
    ],
)
def test_what_says_nothing_or_is_not_known_is_no_stream(mask: int, frame: int) -> None:
    client = airborne()
    client.every(0.05, lambda: _set(client, mask, frame=frame))
    client.run(0.5)
    client.set_mode(OFFBOARD)
    client.run(0.3)
    assert client.acks(176) == [0, 1]


def test_when_the_stream_of_positions_stops_the_failsafe_acts() -> None:
    client = airborne(parameters={"COM_OBL_RC_ACT": 5.0})
    stop = client.every(0.05, lambda: _set(client, _POSITION_ONLY | _NO_YAW, position=(0, 0, -30)))
    client.run(0.3)
    client.set_mode(OFFBOARD)
    client.run(1.0)
    stop()
    client.run(0.9)
    assert client.simulation.autopilot.heartbeat.system_status == 4
    client.run(0.4)
    assert client.simulation.autopilot.heartbeat.system_status == 5
    assert client.simulation.autopilot.heartbeat.custom_mode == AUTO_LOITER


def test_an_attitude_setpoint_takes_over_from_a_position() -> None:
    client = airborne()
    stop = client.every(0.05, lambda: _set(client, _POSITION_ONLY | _NO_YAW, position=(0, 0, -30)))
    client.run(0.3)
    client.set_mode(OFFBOARD)
    client.run(1.0)
    stop()
    client.start_stream((0.7071, 0.0, 0.0, 0.7071), 0.7)
    client.run(1.0)
    assert _velocity(client)[2] > 1.0


def test_from_the_ground_a_position_above_takes_off() -> None:
    client = ShimClient(ShimOptions(seed=1))
    client.boot()
    client.every(0.05, lambda: _set(client, _POSITION_ONLY | _NO_YAW, position=(0, 0, -3)))
    client.run(0.5)
    client.set_mode(OFFBOARD)
    client.command(ARM, 1)
    client.run(10.0)
    assert _position(client)[2] == pytest.approx(3.0, abs=0.2)


# --- going somewhere from Hold ---


def _go_to(client: ShimClient, east_m: float, north_m: float, up_m: float) -> None:
    """As QGroundControl does it."""
    latitude, longitude, _ = global_position(client.simulation.origin, (east_m, north_m, 0.0))
    altitude_m = client.simulation.origin.altitude_amsl_m + up_m
    client.send(
        dialect.MAVLink_command_int_message(
            1, 1, 0, _REPOSITION, 0, 0, -1, 1, 0, NAN, latitude, longitude, altitude_m
        )
    )


def test_a_reposition_flies_there_and_holds() -> None:
    client = airborne()
    _go_to(client, 6.0, -4.0, 33.0)
    client.run(12.0)
    assert client.acks(_REPOSITION) == [0]
    assert client.simulation.autopilot.heartbeat.custom_mode == AUTO_LOITER
    assert _position(client) == pytest.approx((6.0, -4.0, 33.0), abs=0.2)


def test_a_reposition_in_floats_and_above_home_goes_there_too() -> None:
    client = airborne()
    origin = client.simulation.origin
    north_deg = origin.latitude_deg + 5e-5
    client.command(
        _REPOSITION, -1, 1, 0, 0.0, north_deg, origin.longitude_deg, origin.altitude_amsl_m + 30.0
    )
    client.run(10.0)
    assert _position(client)[1] == pytest.approx(5.56, abs=0.6), "floats are coarse"
    assert client.last("ATTITUDE").yaw == pytest.approx(0.0, abs=0.05)


def test_a_reposition_without_a_place_stops() -> None:
    client = airborne()
    _go_to(client, 90.0, 0.0, 30.0)
    client.run(5.0)
    stopped_at = _position(client)[0]
    client.command(_REPOSITION, -1, 1, 0, NAN, NAN, NAN, NAN)
    client.run(8.0)
    assert client.acks(_REPOSITION) == [0, 0]
    assert stopped_at < _position(client)[0] < stopped_at + 15.0
    assert math.hypot(*_velocity(client)[:2]) < 0.1


def test_a_reposition_that_may_not_change_the_mode_is_unsupported() -> None:
    client = airborne()
    client.command(_REPOSITION, -1, 0, 0, NAN, NAN, NAN, NAN)
    client.run(0.1)
    assert client.acks(_REPOSITION) == [3]


def test_the_speed_of_a_reposition_can_be_changed() -> None:
    client = airborne()
    _go_to(client, 90.0, 0.0, 30.0)
    client.run(1.0)
    client.command(_CHANGE_SPEED, 1, 2.0, -1)
    client.run(10.0)
    assert _velocity(client)[0] == pytest.approx(2.0, abs=0.15)
