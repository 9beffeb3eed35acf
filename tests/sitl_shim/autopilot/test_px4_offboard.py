"""The offboard stream: what is needed before the switch, what happens when it stops, masks."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import (
    ALTCTL,
    AUTO_LAND,
    AUTO_LOITER,
    AUTO_RTL,
    NAN,
    OFFBOARD,
    POSCTL,
    SET_MODE,
    ShimClient,
    airborne,
)

_EAST = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""Level, nose to the east, FRD to NED: as the vehicle stands at first."""


def _heartbeat(client: ShimClient) -> tuple[int, int, int]:
    beat = client.simulation.autopilot.heartbeat
    return beat.base_mode, beat.custom_mode, beat.system_status


def _in_offboard(vehicle: str = "bebop2", **options: object) -> ShimClient:
    """In OFFBOARD, level; the stream has just stopped."""
    client = airborne(vehicle, **options)
    stop = client.start_stream(_EAST, 0.49)
    client.run(0.5)
    client.set_mode(OFFBOARD)
    client.run(1.0)
    assert _heartbeat(client) == (0x91, OFFBOARD, 4)
    stop()
    return client


def test_a_tenth_of_a_second_of_stream_is_enough_before_the_switch() -> None:
    client = airborne()
    client.start_stream(_EAST)
    client.run(0.1)
    client.set_mode(OFFBOARD)
    client.run(0.3)
    assert client.acks(SET_MODE) == [0, 0]


def test_twenty_milliseconds_between_two_health_checks_are_not() -> None:
    client = airborne()
    client.run(0.02)
    client.start_stream(_EAST)
    client.run(0.02)
    client.set_mode(OFFBOARD)
    client.run(0.3)
    assert client.acks(SET_MODE) == [0, 1]


def test_a_slow_stream_holds_the_mode() -> None:
    client = _in_offboard()
    client.start_stream(_EAST, 0.49, hz=1.2)
    client.run(5.0)
    assert _heartbeat(client) == (0x91, OFFBOARD, 4)


@pytest.mark.parametrize(
    ("action", "base_mode", "mode"),
    [
        (0, 0xD1, POSCTL),
        (1, 0xD1, ALTCTL),
        (3, 0x9D, AUTO_RTL),
        (4, 0x9D, AUTO_LAND),
        (5, 0x9D, AUTO_LOITER),
    ],
)
def test_a_stream_that_stops_brings_the_action_of_the_parameter(
    action: int, base_mode: int, mode: int
) -> None:
    client = _in_offboard(parameters={"COM_OBL_RC_ACT": float(action)})
    client.heartbeat(6)
    stopped_s = client.time_s
    failed_s = client.wait_for(lambda: _heartbeat(client)[2] == 5, 2.0)
    assert 1.0 <= failed_s - stopped_s <= 1.15
    assert _heartbeat(client) == (base_mode, mode, 5)
    client.run(0.1)
    assert client.texts() == ["Failsafe activated\t"]
    assert client.simulation.autopilot.intended_custom_mode == OFFBOARD


@pytest.mark.parametrize("action", [6, 7])
def test_actions_that_stop_the_motors_let_it_fall(action: int) -> None:
    client = _in_offboard(parameters={"COM_OBL_RC_ACT": float(action)})
    client.run(1.6)
    assert not client.simulation.autopilot.armed
    assert client.simulation.state.velocity_enu_m_s[2] < -2.0


@pytest.mark.parametrize("action", [0, 3, 4, 5])
def test_a_stream_that_resumes_brings_offboard_back(action: int) -> None:
    client = _in_offboard(parameters={"COM_OBL_RC_ACT": float(action)})
    client.run(3.0)
    assert _heartbeat(client)[2] == 5
    resumed_s = client.time_s
    client.start_stream(_EAST, 0.49)
    back_s = client.wait_for(lambda: _heartbeat(client) == (0x91, OFFBOARD, 4), 1.0)
    assert back_s - resumed_s <= 0.15


def test_a_mode_chosen_in_the_failsafe_ends_it_for_good() -> None:
    client = _in_offboard()
    client.run(1.5)
    client.set_mode(AUTO_LOITER)
    client.run(0.3)
    assert _heartbeat(client) == (0x9D, AUTO_LOITER, 4)
    client.start_stream(_EAST, 0.49)
    client.run(1.0)
    assert _heartbeat(client) == (0x9D, AUTO_LOITER, 4)


def test_position_mode_without_sticks_sinks_lands_and_disarms() -> None:
    client = ShimClient(ShimOptions(airborne_at_enu_m=(0.0, 0.0, 2.5), seed=1))
    stop = client.start_stream(_EAST, 0.49)
    client.run(0.5)
    client.set_mode(OFFBOARD)
    client.run(0.3)
    stop()
    begin_s = client.time_s
    end_s = client.wait_for(lambda: not client.simulation.autopilot.armed, 12.0)
    assert end_s - begin_s < 11.0
    assert client.simulation.state.on_ground
    client.run(0.1)
    assert _heartbeat(client) == (0x11, OFFBOARD, 0)


def test_the_time_out_is_a_parameter() -> None:
    client = _in_offboard(parameters={"COM_OF_LOSS_T": 3.0})
    client.run(2.9)
    assert _heartbeat(client)[2] == 4
    client.run(0.3)
    assert _heartbeat(client)[2] == 5


# --- what each type_mask does ---


def _tilt_deg(client: ShimClient) -> float:
    _, x, y, _ = client.simulation.state.attitude_flu_to_enu
    return math.degrees(math.acos(1.0 - 2.0 * (x * x + y * y)))


def _yaw_deg(client: ShimClient) -> float:
    w, x, y, z = client.simulation.state.attitude_flu_to_enu
    return math.degrees(math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def _stream(client: ShimClient, duration_s: float, **setpoint: object) -> None:
    stop = client.every(0.01, lambda: client.setpoint(**setpoint))  # type: ignore[arg-type]
    client.run(duration_s)
    stop()


def _tilted(roll_deg: float) -> tuple[float, float, float, float]:
    half = math.radians(roll_deg) / 2.0
    c, s = math.cos(half) * math.sqrt(0.5), math.sin(half) * math.sqrt(0.5)
    return (c, s, s, c)


def test_mask_7_holds_attitude_and_thrust() -> None:
    client = _in_offboard()
    _stream(client, 1.0, q=_tilted(10.0), thrust=0.49)
    assert _tilt_deg(client) == pytest.approx(10.0, abs=1.0)


@pytest.mark.parametrize("factor", [-1.0, 2.0])
def test_a_quaternion_of_either_sign_and_any_norm_is_the_same_attitude(factor: float) -> None:
    client = _in_offboard()
    _stream(client, 1.0, q=[factor * value for value in _tilted(10.0)], thrust=0.49)
    assert _tilt_deg(client) == pytest.approx(10.0, abs=1.0)
    assert _heartbeat(client) == (0x91, OFFBOARD, 4)


def test_mask_3_takes_the_yaw_rate_as_feed_forward_only() -> None:
    client = _in_offboard("sih_quadx")
    _stream(client, 2.0, q=_EAST, thrust=0.49)
    before_deg = _yaw_deg(client)
    _stream(client, 3.0, q=_EAST, thrust=0.49, mask=3, rates=(0.0, 0.0, 0.5))
    turned_deg = before_deg - _yaw_deg(client)  # a positive yaw rate on the wire is clockwise
    _stream(client, 1.0, q=_EAST, thrust=0.49, mask=3, rates=(0.0, 0.0, 0.5))
    assert turned_deg == pytest.approx(10.0, abs=3.0)
    assert before_deg - _yaw_deg(client) == pytest.approx(turned_deg, abs=3.0)


def test_mask_128_holds_body_rates() -> None:
    client = _in_offboard()
    _stream(client, 0.5, mask=128, rates=(0.0, 0.0, 0.3), thrust=0.49)
    assert _heartbeat(client)[0] == 0x81
    _stream(client, 1.5, mask=128, rates=(0.0, 0.0, 0.3), thrust=0.49)
    assert client.simulation.state.rate_flu_rad_s[2] == pytest.approx(-0.3, abs=0.06)


def test_a_masked_rate_drops_all_rates_and_keeps_the_mode() -> None:
    client = _in_offboard()
    _stream(client, 0.3, mask=128, thrust=0.49)
    _stream(client, 2.0, mask=129, rates=(0.0, 1.0, 1.0), thrust=0.9)
    assert max(map(abs, client.simulation.state.rate_flu_rad_s)) < 0.1
    assert client.last("ATTITUDE_TARGET").thrust == pytest.approx(0.49)
    assert _heartbeat(client) == (0x81, OFFBOARD, 4)


def test_mask_0_mixes_attitude_and_rates() -> None:
    client = _in_offboard()
    _stream(client, 0.5, mask=0, q=_EAST, thrust=0.49)
    calm = max(map(abs, client.simulation.state.rate_flu_rad_s))
    _stream(client, 0.5, mask=0, q=_EAST, thrust=0.49, rates=(2.0, 0.0, 0.0))
    assert max(map(abs, client.simulation.state.rate_flu_rad_s)) > calm + 0.05
    assert _heartbeat(client) == (0x91, OFFBOARD, 4)


def test_mask_64_makes_the_thrust_zero_and_it_falls() -> None:
    client = _in_offboard()
    _stream(client, 1.0, mask=64 + 7, q=_EAST, thrust=0.49)
    assert client.last("ATTITUDE_TARGET").thrust == 0.0
    assert client.simulation.state.velocity_enu_m_s[2] < -5.0


def test_mask_135_is_no_setpoint() -> None:
    client = _in_offboard()
    _stream(client, 1.3, mask=135, q=_EAST, thrust=0.49)
    assert _heartbeat(client)[2] == 5


def test_nan_in_the_quaternion_is_accepted_and_leaves_it_without_control() -> None:
    client = _in_offboard()
    _stream(client, 1.3, q=(NAN, 0.0, 0.0, 0.0), thrust=0.49)
    assert _heartbeat(client) == (0x91, OFFBOARD, 4)
    assert all(map(math.isfinite, client.simulation.state.position_enu_m))
    _stream(client, 1.5, q=_EAST, thrust=0.49)
    assert _tilt_deg(client) < 3.0


@pytest.mark.parametrize("bad", [NAN, math.inf, -math.inf])
@pytest.mark.parametrize(("mask", "place"), [(128, 0), (128, 2), (0, 1), (128, 3), (7, 3), (7, 4)])
def test_one_setpoint_that_is_no_number_does_no_lasting_harm(
    bad: float, mask: int, place: int
) -> None:
    client = _in_offboard()
    numbers = [0.0, 0.0, 0.0, 0.49, 1.0]
    numbers[place] = bad
    p, q, r, thrust, w = numbers
    _stream(client, 0.02, q=(w, 0.0, 0.0, 1.0), rates=(p, q, r), mask=mask, thrust=thrust)
    _stream(client, 2.0, q=_EAST, thrust=0.49)
    assert _heartbeat(client) == (0x91, OFFBOARD, 4)
    assert _tilt_deg(client) < 3.0


@pytest.mark.parametrize("target", [(1, 1), (1, 0), (0, 0), (0, 1)])
def test_setpoints_for_this_system_or_for_all_are_taken(target: tuple[int, int]) -> None:
    client = _in_offboard()
    _stream(client, 1.2, q=_EAST, thrust=0.3, target=target)
    assert _heartbeat(client)[2] == 4
    assert client.last("ATTITUDE_TARGET").thrust == pytest.approx(0.3)


@pytest.mark.parametrize("target", [(2, 1), (1, 100)])
def test_setpoints_for_others_are_not(target: tuple[int, int]) -> None:
    client = _in_offboard()
    _stream(client, 1.3, q=_EAST, thrust=0.3, target=target)
    assert _heartbeat(client)[2] == 5


_anything = st.floats(width=32, allow_nan=True, allow_infinity=True)


@settings(deadline=None, derandomize=True, max_examples=50)
@given(
    mask=st.integers(0, 255),
    q=st.tuples(_anything, _anything, _anything, _anything),
    rates=st.tuples(_anything, _anything, _anything),
    thrust=_anything,
)
def test_no_setpoint_whatever_breaks_the_simulation(
    mask: int,
    q: tuple[float, float, float, float],
    rates: tuple[float, float, float],
    thrust: float,
) -> None:
    client = airborne()
    client.start_stream(_EAST, 0.49)
    client.run(0.15)
    client.set_mode(OFFBOARD)
    client.run(0.1)
    _stream(client, 0.1, mask=mask, q=q, rates=rates, thrust=thrust)
    state = client.simulation.state
    assert all(map(math.isfinite, state.position_enu_m + state.rate_flu_rad_s))


def test_the_echo_shows_the_thrust_as_sent() -> None:
    client = _in_offboard()
    _stream(client, 0.3, q=_EAST, thrust=1.7)
    assert client.last("ATTITUDE_TARGET").thrust == pytest.approx(1.7)
