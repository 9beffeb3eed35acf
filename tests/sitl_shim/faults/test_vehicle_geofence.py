"""The autopilots' own fences about home."""

import pytest

from tests.sitl_shim.faults.vehicle_flights import EAST, copter, px4_in_offboard
from tests.sitl_shim.mavlink.shim_client import OFFBOARD, ShimClient

_HOLD, _RETURN, _LAND = 0x03040000, 0x05040000, 0x06040000
_GUIDED, _COPTER_RTL, _COPTER_LAND, _COPTER_BRAKE = 4, 6, 9, 17
_CEILING = {"GF_MAX_VER_DIST": 5.5, "COM_FAIL_ACT_T": 0.5}
_FENCE = {"FENCE_ENABLE": 1, "FENCE_ALT_MAX": 5.5, "RTL_ALT": 300}


def _climbing(**parameters: float) -> ShimClient:
    """PX4 from 5 m upwards, under attitude setpoints."""
    client = px4_in_offboard(parameters={**_CEILING, **parameters})
    thrust = client.simulation.autopilot.parameters["MPC_THR_HOVER"]
    client._repeats.pop()
    client.start_stream(EAST, thrust * 1.1)
    return client


def _mode(client):
    beat = client.simulation.autopilot.heartbeat
    return beat.custom_mode, beat.system_status


def _height_m(client):
    return client.simulation.state.position_enu_m[2]


def test_px4_holds_beyond_its_fence_until_a_mode_is_chosen():
    client = _climbing(GF_ACTION=2)
    broke_s = client.wait_for(lambda: _height_m(client) > 5.5, 5.0)
    client.wait_for(lambda: _mode(client) == (_HOLD, 5), 0.3)
    assert "Failsafe activated\t" not in client.texts()
    client.run_until(broke_s + 3.0)
    assert "Failsafe activated\t" in client.texts()
    assert _mode(client) == (_HOLD, 5)
    assert client.simulation.autopilot.intended_custom_mode == OFFBOARD
    assert 5.5 < _height_m(client) < 6.5
    client.set_mode(OFFBOARD)
    client.run(0.3)
    assert _mode(client) == (OFFBOARD, 4), "whoever is outside may fly back"


@pytest.mark.parametrize(("action", "mode"), [(3, _RETURN), (5, _LAND)])
def test_px4_returns_or_lands_after_a_hold_and_goes_on_when_it_is_back_inside(action, mode):
    client = _climbing(GF_ACTION=action)
    client.wait_for(lambda: _mode(client) == (_HOLD, 5), 5.0)
    client.wait_for(lambda: _mode(client) == (mode, 5), 0.7)
    client.wait_for(lambda: _height_m(client) < 4.0, 8.0)
    assert _mode(client) == (mode, 5)
    client.wait_for(lambda: not client.simulation.autopilot.armed, 15.0)
    assert client.simulation.state.on_ground


@pytest.mark.parametrize(("action", "armed"), [(0, True), (1, True), (4, False)])
def test_px4_warns_or_stops_its_motors(action, armed):
    client = _climbing(GF_ACTION=action)
    client.wait_for(lambda: _height_m(client) > 5.6, 5.0)
    client.run(0.5)
    assert client.simulation.autopilot.armed is armed
    if armed:
        assert _mode(client) == (OFFBOARD, 4)
        assert ("Failsafe activated\t" in client.texts()) is (action == 1)


def test_px4_without_limits_has_no_fence_whatever_its_action():
    client = _climbing(GF_ACTION=4, GF_MAX_VER_DIST=0.0)
    client.wait_for(lambda: _height_m(client) > 6.0, 6.0)
    assert _mode(client) == (OFFBOARD, 4)


@pytest.mark.parametrize(
    ("action", "mode"), [(0, _GUIDED), (1, _COPTER_RTL), (2, _COPTER_LAND), (4, _COPTER_BRAKE)]
)
def test_ardupilot_does_at_its_ceiling_what_its_parameter_says(action, mode):
    client = copter(parameters={**_FENCE, "FENCE_ACTION": action})
    client._repeats.clear()
    client.every(0.02, lambda: client.climb(1.0))
    client.wait_for(lambda: _height_m(client) > 5.6, 3.0)
    assert _mode(client) == (mode, 4)
    client.run(0.1)
    assert "Max Alt fence breached" in client.texts()
    if action == 2:
        client.wait_for(lambda: _height_m(client) < 5.3, 5.0)
        assert "Fence breach cleared" in client.texts()


def test_ardupilot_flies_home_from_beyond_its_circle_and_lands():
    client = copter(
        parameters={**_FENCE, "FENCE_TYPE": 2, "FENCE_RADIUS": 3.0, "RTL_LOIT_TIME": 500}
    )
    client._repeats.clear()
    east = (0.6975, 0.1165, -0.1165, 0.6975)  # nose east, pitched down by 19 degrees
    client.every(0.02, lambda: client.climb(0.0, _unit(east)))
    client.wait_for(lambda: client.mode == _COPTER_RTL, 6.0)
    client.run(0.1)
    assert "Circle fence breached" in client.texts()
    client.wait_for(lambda: not client.copter.armed, 30.0)
    x, y, _ = client.simulation.state.position_enu_m
    assert (x * x + y * y) ** 0.5 < 1.0
    assert client.simulation.state.on_ground


def _unit(q):
    norm = sum(part * part for part in q) ** 0.5
    return tuple(part / norm for part in q)
