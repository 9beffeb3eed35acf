"""Somebody else chooses a mode, or stops the motors."""

import math

import pytest

from sitl_shim.data_file import DataFileError
from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import Simulation
from tests.sitl_shim.faults.vehicle_flights import (
    copter,
    options_of,
    px4,
    px4_in_offboard,
    told,
)
from tests.sitl_shim.mavlink.shim_client import OFFBOARD, POSCTL

_HEIGHT_M = 5.0
_STABILIZE, _ALT_HOLD, _LOITER, _BRAKE = 0, 2, 5, 17


def _mode(at_s=1.5, by="ground_station", **mode):
    return {"fault": "mode", "at_s": at_s, "mode": mode, "by": by}


def _tilt_deg(client):
    _, x, y, _ = client.simulation.state.attitude_flu_to_enu
    return math.degrees(math.acos(max(-1.0, 1.0 - 2.0 * (x * x + y * y))))


def test_a_ground_station_takes_px4_over_and_the_stream_is_not_obeyed_any_more():
    client = px4_in_offboard(_mode(px4="hold"))
    client.set_interval(dialect.MAVLINK_MSG_ID_CURRENT_MODE, 100_000)
    client.run_until(1.6)
    mode = client.last("CURRENT_MODE")
    assert (mode.custom_mode, mode.intended_custom_mode) == (0x03040000, 0x03040000)
    client.run_until(4.0)
    beat = client.last("HEARTBEAT")
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (0x9D, 0x03040000, 4)
    assert client.simulation.state.position_enu_m[2] == pytest.approx(_HEIGHT_M, abs=0.2)
    assert told(client) == [(1.5, "mode", float(0x03040000))]
    assert client.acks(176) == [0, 0], "the client's own alone"


def test_px4_refuses_a_mode_for_sticks_to_a_ground_station_while_there_are_none():
    client = px4_in_offboard(_mode(px4="POSCTL"))
    client.run_until(2.0)
    assert client.simulation.autopilot.heartbeat.custom_mode == OFFBOARD
    assert "Switching to Position is currently not available\t" in client.texts()


@pytest.mark.parametrize(
    ("name", "custom_mode", "stays_m", "keeps_m"),
    [
        ("Position", POSCTL, 0.1, 0.1),
        ("ALTCTL", 0x00020000, 3.0, 0.15),
        ("Stabilized", 0x00070000, 3.0, 3.0),
    ],
)
def test_a_pilot_takes_px4_over_with_sticks_in_the_middle(name, custom_mode, stays_m, keeps_m):
    client = px4_in_offboard(_mode(px4=name, by="rc"))
    client.run_until(1.6)
    x, y, z = client.simulation.state.position_enu_m
    client.run_until(5.0)
    beat = client.simulation.autopilot.heartbeat
    assert (beat.custom_mode, beat.system_status) == (custom_mode, 4)
    assert client.simulation.autopilot.intended_custom_mode == custom_mode
    later = client.simulation.state.position_enu_m
    assert math.hypot(later[0] - x, later[1] - y) < stays_m + 0.3
    assert abs(later[2] - z) < keeps_m + 0.05
    assert _tilt_deg(client) < 3.0


@pytest.mark.parametrize(
    ("name", "by", "number", "sinks"),
    [
        ("BRAKE", "ground_station", _BRAKE, (-0.2, 0.2)),
        ("LOITER", "ground_station", _LOITER, (1.5, 5.1)),
        ("LOITER", "rc", _LOITER, (-0.2, 0.2)),
        ("ALT_HOLD", "rc", _ALT_HOLD, (-0.2, 0.2)),
        ("STABILIZE", "rc", _STABILIZE, (-2.5, 2.5)),
        ("stabilize", "ground_station", _STABILIZE, (4.0, 5.1)),
    ],
)
def test_others_take_ardupilot_over(name, by, number, sinks):
    client = copter(_mode(ardupilot=name, by=by))
    client.run_until(1.56)
    assert client.last("HEARTBEAT").custom_mode == number, "told at once"
    client.run_until(3.5)
    assert client.mode == number
    least, most = sinks
    assert least < _HEIGHT_M - client.simulation.state.position_enu_m[2] < most
    assert told(client) == [(1.5, "mode", float(number))]


def test_a_mode_of_the_other_flavour_alone_is_no_event():
    client = px4(_mode(ardupilot="LOITER"))
    client.run_until(2.5)
    assert told(client) == []
    assert client.simulation.autopilot.heartbeat.custom_mode == 0x03040000


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    ("flavour", "name", "there_is"), [("px4", "SPORT", "POSCTL"), ("ardupilot", "HOLD", "LOITER")]
)
def test_an_unknown_mode_is_refused_whichever_autopilot_flies(autopilot, flavour, name, there_is):
    options = options_of(autopilot, _mode(**{flavour: name}))
    with pytest.raises(DataFileError, match=f"vehicle.0.mode.{flavour}.*{name}.*{there_is}"):
        Simulation(options)


@pytest.mark.parametrize(
    ("fly", "text"),
    [(px4_in_offboard, "Disarmed by external command\t"), (copter, "Disarming motors")],
    ids=["px4", "ardupilot"],
)
def test_who_is_disarmed_in_the_air_falls(fly, text):
    client = fly({"fault": "disarm", "at_s": 1.5})
    client.run_until(1.51)
    assert not client.simulation.autopilot.armed
    client.run_until(3.5)
    assert client.simulation.state.on_ground
    assert text in client.texts()
    assert client.last("HEARTBEAT").base_mode & 0x80 == 0
    assert told(client) == [(1.5, "disarm", 1.0)]
