"""The battery reports little, and what the autopilots' failsafes make of it."""

import pytest

from sitl_shim.mavlink.wire import dialect
from tests.sitl_shim.faults.vehicle_flights import copter, px4, px4_in_offboard, told
from tests.sitl_shim.mavlink.shim_client import OFFBOARD

_HOLD, _RETURN, _LAND = 0x03040000, 0x05040000, 0x06040000
_GUIDED, _COPTER_RTL, _COPTER_LAND, _COPTER_BRAKE = 4, 6, 9, 17


def _low(remaining, at_s=1.5):
    return {"fault": "battery", "at_s": at_s, "remaining": remaining}


def _mode(client):
    beat = client.simulation.autopilot.heartbeat
    return beat.custom_mode, beat.system_status


@pytest.mark.parametrize("fly", [px4, copter], ids=["px4", "ardupilot"])
def test_the_report_falls_and_the_motors_turn_as_before(fly):
    client = fly(_low(0.5))
    client.set_interval(dialect.MAVLINK_MSG_ID_BATTERY_STATUS, 100_000)
    client.run_until(1.4)
    before = client.last("SYS_STATUS")
    client.run_until(2.5)
    after = client.last("SYS_STATUS")
    assert (before.battery_remaining, after.battery_remaining) == (100, 50)
    assert client.last("BATTERY_STATUS").battery_remaining == 50
    battery = client.simulation.vehicle.battery
    half_v = 0.5 * (battery.full_voltage_v - battery.empty_voltage_v)
    assert before.voltage_battery - after.voltage_battery == pytest.approx(1e3 * half_v, rel=0.1)
    assert client.simulation.state.battery_remaining > 0.99
    assert client.simulation.state.position_enu_m[2] == pytest.approx(5.0, abs=0.3)
    assert told(client) == [(1.5, "battery", 0.5)]


def test_px4_warns_of_a_low_battery_and_flies_on():
    client = px4_in_offboard(_low(0.12))
    client.run_until(3.0)
    assert _mode(client) == (OFFBOARD, 4)
    assert "Failsafe activated\t" in client.texts()


@pytest.mark.parametrize(
    ("remaining", "action", "mode"),
    [(0.06, 3, _RETURN), (0.03, 3, _LAND), (0.06, 2, _LAND), (0.03, 1, _RETURN)],
)
def test_px4_holds_then_does_what_the_parameter_says(remaining, action, mode):
    client = px4_in_offboard(
        _low(remaining), parameters={"COM_LOW_BAT_ACT": action, "COM_FAIL_ACT_T": 1.0}
    )
    client.run_until(2.0)
    assert _mode(client) == (_HOLD, 5)
    assert client.simulation.autopilot.intended_custom_mode == OFFBOARD
    assert "Failsafe activated, entering Hold for 1 seconds\t" in client.texts()
    client.run_until(3.0)
    assert _mode(client) == (mode, 5)
    assert client.texts().count("Failsafe activated\t") == 1
    client.wait_for(lambda: not client.simulation.autopilot.armed, 25.0)
    assert client.simulation.state.on_ground
    assert client.simulation.autopilot.heartbeat.system_status < 4


def test_px4_only_warns_where_the_parameter_says_so():
    client = px4_in_offboard(_low(0.01), parameters={"COM_LOW_BAT_ACT": 0})
    client.run_until(4.0)
    assert _mode(client) == (OFFBOARD, 4)


def test_a_mode_that_is_chosen_takes_over_from_px4s_failsafe():
    client = px4_in_offboard(_low(0.06), parameters={"COM_FAIL_ACT_T": 0.5})
    client.run_until(3.0)
    assert _mode(client) == (_RETURN, 5)
    client.set_mode(OFFBOARD)
    client.run_until(3.2)
    assert _mode(client) == (OFFBOARD, 4)
    client.run_until(5.0)
    assert _mode(client) == (OFFBOARD, 4), "until another cause comes up"


def test_who_takes_off_with_a_low_battery_is_only_warned():
    client = px4(_low(0.06, at_s=0.5), airborne_at_enu_m=None)
    client.run_until(5.0)
    client.command(400, 1.0)
    client.take_off()
    client.run_until(12.0)
    assert client.simulation.autopilot.heartbeat.system_status == 4
    assert client.simulation.state.position_enu_m[2] > 1.0


@pytest.mark.parametrize(
    ("parameters", "mode"),
    [
        ({"BATT_LOW_MAH": 500.0}, _GUIDED),
        ({"BATT_LOW_MAH": 500.0, "BATT_FS_LOW_ACT": 1}, _COPTER_LAND),
        ({"BATT_LOW_MAH": 500.0, "BATT_FS_LOW_ACT": 2}, _COPTER_RTL),
        ({"BATT_LOW_MAH": 500.0, "BATT_FS_LOW_ACT": 7}, _COPTER_BRAKE),
        ({"BATT_LOW_VOLT": 10.9, "BATT_LOW_TIMER": 1, "BATT_FS_LOW_ACT": 1}, _COPTER_LAND),
    ],
)
def test_ardupilot_does_what_its_parameters_say(parameters, mode):
    client = copter(_low(0.1), parameters=parameters)
    client.run_until(2.0 + parameters.get("BATT_LOW_TIMER", 0))
    assert _mode(client) == (mode, 5)
    texts = client.texts()
    (low,) = [text for text in texts if text.startswith("Battery 1 is low 10.7")]
    assert " used 297" in low
    assert "Battery Failsafe" in texts


def test_ardupilot_becomes_critical_after_it_was_low():
    limits = {"BATT_LOW_MAH": 1000.0, "BATT_CRT_MAH": 200.0, "BATT_FS_CRT_ACT": 1}
    client = copter(_low(0.2), _low(0.05, at_s=2.0), parameters=limits)
    client.run_until(1.9)
    assert _mode(client) == (_GUIDED, 5)
    client.run_until(2.3)
    assert _mode(client) == (_COPTER_LAND, 5)
    assert any(text.startswith("Battery 1 is critical") for text in client.texts())


def test_ardupilot_does_nothing_by_default():
    client = copter(_low(0.02))
    client.run_until(4.0)
    assert _mode(client) == (_GUIDED, 4)
    assert not any("Battery" in text for text in client.texts())
