"""Boot, readiness, arming and disarming, as ArduCopter 4.7-dev was measured."""

import pytest

from tests.sitl_shim.autopilot.copter_client import (
    BRAKE,
    GUIDED,
    GUIDED_NOGPS,
    LAND,
    STABILIZE,
    CopterClient,
    grounded,
    hovering,
)
from tests.sitl_shim.mavlink.shim_client import ARM, SET_MODE, TAKEOFF

_FORCE = 21196
_EKF_STATUS, _SYS_STATUS, _LOCAL_POSITION, _EXTENDED = 193, 1, 32, 245
_PREARM = 0x10000000
_HORIZONTAL = 0x10


def _heartbeats(client: CopterClient) -> list[tuple[int, int, int]]:
    beats = client.messages("HEARTBEAT")
    seen = [(m.base_mode, m.custom_mode, m.system_status) for m in beats]
    return [beat for n, beat in enumerate(seen) if n == 0 or beat != seen[n - 1]]


def test_the_whole_boot_takes_the_measured_times() -> None:
    client = grounded(boot_scale=1.0)
    client.run_until(1.5)
    for message in (_EKF_STATUS, _SYS_STATUS, _LOCAL_POSITION):
        client.set_interval(message, 200_000)
    client.run_until(43.0)
    assert _heartbeats(client) == [(89, 0, 1), (81, 0, 3)]
    flags = [(time_s, m.flags) for time_s, m in client.received("EKF_STATUS_REPORT")]
    first = {flag: next(t for t, f in flags if f == flag) for _, flag in flags}
    assert list(first) == [0x400, 0x0, 0xA7, 0x33F]
    assert 37.5 <= first[0x33F] <= 41.9
    positions = client.received("LOCAL_POSITION_NED")
    assert positions[0][0] == pytest.approx(first[0x33F], abs=0.25)
    texts = {m.text: time_s for time_s, m in client.received("STATUSTEXT")}
    assert texts["ArduPilot Ready"] == pytest.approx(2.45, abs=0.05)
    assert texts["EKF3 IMU0 origin set"] == pytest.approx(20.0, abs=0.05)
    assert texts["EKF3 IMU0 is using GPS"] == pytest.approx(first[0x33F], abs=0.25)
    assert client.received("GPS_GLOBAL_ORIGIN")[0][0] == pytest.approx(20.0, abs=0.05)
    assert client.received("HOME_POSITION")[0][0] == pytest.approx(20.0, abs=0.05)


def test_boots_differ_by_seed_and_shrink_with_the_scale() -> None:
    def position_s(seed: int, scale: float) -> float:
        client = grounded(seed=seed, boot_scale=scale)
        return client.wait_for(lambda: client.copter.estimator.position_known, 50.0)

    quick = position_s(1, 0.1)
    assert quick == pytest.approx(0.1 * position_s(1, 1.0), abs=0.01)
    assert position_s(2, 0.1) != quick


def test_sys_status_has_the_recorded_masks() -> None:
    client = grounded(boot_scale=1.0)
    client.run_until(2.6)
    client.set_interval(_SYS_STATUS, 200_000)

    def masks() -> tuple[int, int, int]:
        client.run(0.3)
        m = client.last("SYS_STATUS")
        return (
            m.onboard_control_sensors_present,
            m.onboard_control_sensors_enabled,
            m.onboard_control_sensors_health,
        )

    assert masks() == (0x5371FC0F, 0x52419C0F, 0x47519C0F)
    client.run_until(11.0)
    assert masks() == (0x5371FC2F, 0x52419C2F, 0x47519C2F)
    client.run_until(22.6)
    assert masks() == (0x5371FC2F, 0x52619C2F, 0x47719C2F)
    client.run_until(24.0)
    assert masks() == (0x5371FC2F, 0x52619C2F, 0x57719C2F)
    client.run_until(42.0)
    client.choose(GUIDED)
    client.arm()
    assert masks() == (0x5371FC2F, 0x5361FC2F, 0x5771FC2F)


def test_guided_asked_for_during_the_boot_is_acknowledged_and_overwritten() -> None:
    client = grounded(boot_scale=1.0)
    client.run_until(1.9)
    client.choose(GUIDED)
    assert client.acks(SET_MODE) == [0]
    assert _heartbeats(client)[-1] == (89, GUIDED, 1)
    client.run_until(3.1)
    assert client.mode == STABILIZE
    assert _heartbeats(client) == [(89, 0, 1), (89, 4, 1), (89, 0, 3), (81, 0, 3)]
    client.choose(GUIDED)
    client.run(5.0)
    assert _heartbeats(client)[-1] == (89, GUIDED, 3)


def test_the_prearm_bit_depends_on_the_mode_and_is_up_to_a_second_old() -> None:
    client = grounded(boot_scale=1.0)
    client.run_until(24.0)
    assert client.copter.sensor_health.health & _PREARM  # in STABILIZE, without a position
    client.choose(GUIDED)
    assert client.copter.sensor_health.health & _PREARM  # not looked at again yet
    client.run(1.0)
    assert not client.copter.sensor_health.health & _PREARM
    client.wait_for(lambda: client.copter.estimator.position_known, 20.0)
    client.run(1.0)
    assert client.copter.sensor_health.health & _PREARM


@pytest.mark.parametrize(
    ("at_s", "forced", "reasons"),
    [
        (14.0, False, ["Arm: Gyros inconsistent", "Arm: AHRS: waiting for home"]),
        (21.0, False, ["Arm: Gyros inconsistent", "Arm: Need Position Estimate"]),
        (30.0, False, ["Arm: Need Position Estimate"]),
        (30.0, True, ["Arm: Need Position Estimate"]),
    ],
)
def test_arming_too_early_fails_with_the_reasons(
    at_s: float, forced: bool, reasons: list[str]
) -> None:
    client = grounded(boot_scale=1.0)
    client.run_until(at_s)
    client.choose(GUIDED)
    client.forget()
    client.command(ARM, 1, _FORCE if forced else 0)
    client.run(0.1)
    assert client.acks(ARM) == [4]
    texts = [(m.severity, m.text) for m in client.messages("STATUSTEXT")]
    assert texts == [(2, reason) for reason in reasons]
    assert not client.copter.armed


def test_it_complains_of_itself_after_thirty_seconds() -> None:
    client = grounded(boot_scale=1.0)
    client.run_until(10.0)
    client.choose(GUIDED)
    client.run_until(31.0)
    assert client.texts().count("PreArm: Need Position Estimate") == 1


def test_guided_nogps_arms_without_a_position() -> None:
    client = grounded(boot_scale=1.0)
    client.run_until(24.0)
    client.choose(GUIDED_NOGPS)
    client.arm()
    assert client.texts()[-1] == "Arming motors"


@pytest.mark.parametrize("mode", [LAND, BRAKE])
def test_some_modes_are_not_armable(mode: int) -> None:
    client = grounded()
    client.run_until(6.0)
    client.choose(mode)
    client.forget()
    client.command(ARM, 1)
    client.run(0.1)
    assert client.acks(ARM) == [4]
    assert client.texts()[0].endswith("mode not armable")


def test_arming_tells_origin_and_home_and_disarms_after_ten_idle_seconds() -> None:
    client = grounded()
    client.ready()
    client.forget()
    client.arm()
    armed_s = client.time_s
    assert client.acks(ARM) == [0]
    assert len(client.messages("HOME_POSITION")) == len(client.messages("GPS_GLOBAL_ORIGIN")) == 1
    ended_s = client.wait_for(lambda: not client.copter.armed, 12.0)
    assert ended_s - armed_s == pytest.approx(10.0, abs=0.2)
    client.run(0.1)
    assert client.texts()[-1] == "Disarming motors"


def test_disarm_delay_zero_never_disarms() -> None:
    client = grounded(parameters={"DISARM_DELAY": 0})
    client.ready()
    client.arm()
    client.run(15.0)
    assert client.copter.armed


def test_disarming_in_flight_fails_unless_forced() -> None:
    client = hovering()
    client.command(ARM, 0)
    client.run(0.1)
    assert client.acks(ARM) == [4]
    assert client.copter.armed
    client.command(ARM, 0, _FORCE)
    client.run(1.0)
    assert not client.copter.armed
    assert client.simulation.state.velocity_enu_m_s[2] < -5.0


def test_a_takeoff_needs_guided_and_motors_that_are_armed() -> None:
    client = grounded()
    client.ready()
    client.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 3.0)
    client.run(0.1)
    assert client.acks(TAKEOFF) == [4]
    client.choose(STABILIZE)
    client.arm()
    client.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 3.0)
    client.run(0.1)
    assert client.acks(TAKEOFF) == [4, 4]
    client.choose(GUIDED)
    client.command(TAKEOFF, 0, 0, 0, 0, 0, 0, -3.0)
    client.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 3.0)
    client.run(0.1)
    assert client.acks(TAKEOFF) == [4, 4, 4, 0]


def test_unknown_modes_fail_and_malformed_requests_are_denied() -> None:
    client = grounded()
    client.ready()
    client.command(SET_MODE, 1, 77)
    client.command(SET_MODE, 0, GUIDED)
    client.run(0.1)
    assert client.acks(SET_MODE)[-2:] == [4, 2]
    assert client.mode == GUIDED


def test_without_a_position_no_mode_that_needs_one_is_entered_once_armed() -> None:
    client = grounded(boot_scale=1.0)
    client.run_until(24.0)
    client.choose(GUIDED_NOGPS)
    client.arm()
    client.choose(GUIDED)
    assert client.acks(SET_MODE) == [0, 4]
    assert client.mode == GUIDED_NOGPS
    assert client.texts()[-1] == "Mode change to GUIDED failed: requires position"
