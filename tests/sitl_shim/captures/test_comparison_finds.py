"""A shim that does something otherwise than the real one is found to differ in just that.

Each of these would go unnoticed by a coarser comparison.  Several at once, for a replay costs time.
"""

import math
from typing import Any

import pytest

from sitl_shim.autopilot.ardupilot.guided import Guided
from sitl_shim.mavlink import streams
from sitl_shim.mavlink.wire import dialect
from tests.sitl_shim.captures.conversation import read_capture
from tests.sitl_shim.captures.replay import replay
from tests.sitl_shim.captures.verdicts import verdicts


def _unknown(name: str, until_s: float, aspect: str) -> tuple[str, ...]:
    capture = read_capture(name).until(until_s)
    return verdicts(capture, replay(capture))[aspect].unknown


def test_other_rates(monkeypatch: pytest.MonkeyPatch) -> None:
    rates_hz = {"SYSTEM_TIME": 1.8, "BATTERY_STATUS": 1.2, "ODOMETRY": 36.0, "SYS_STATUS": 4.2}
    for message, hz in rates_hz.items():
        number = getattr(dialect, f"MAVLINK_MSG_ID_{message}")
        monkeypatch.setitem(streams._ONBOARD_RATES_HZ, number, hz)
    found = _unknown("px4-params-mission", 19.2, "rates")
    assert {(text.split()[0], " ".join(text.split()[-2:])) for text in found} == {
        ("SYSTEM_TIME", "more often"),
        ("BATTERY_STATUS", "more often"),
        ("ODOMETRY", "more often"),
        ("SYS_STATUS", "less often"),
    }


def test_other_effects_of_setpoints_on_ardupilot(monkeypatch: pytest.MonkeyPatch) -> None:
    receive = Guided.receive_attitude

    def climbs_faster_and_flies_small_tilts_level(self: Guided, *arguments: Any) -> bool:
        taken = receive(self, *arguments)
        self.climb_m_s *= 1.4
        if taken and self.attitude is not None:
            w, x, y, z = self.attitude
            tilt_deg = 2.0 * math.degrees(math.asin(min(1.0, math.hypot(x, y))))
            # The tilt of 3° is left as it is: it shows the time-out.
            if 4.0 < tilt_deg < 9.0:
                norm = math.hypot(w, z)
                self.attitude = (w / norm, 0.0, 0.0, z / norm)
        return taken

    monkeypatch.setattr(Guided, "receive_attitude", climbs_faster_and_flies_small_tilts_level)
    monkeypatch.setattr(Guided, "timed_out", lambda *_: False)
    found = _unknown("ardupilot-flight", 116.0, "effects of setpoints")
    assert {text.partition(" differs")[0] for text in found} == {
        "mask 7, thrust 0.5, tilt 5°: tilt (°)",
        "mask 7, thrust 0.5, tilt 5°: echoed tilt (°)",
        "mask 7, thrust 0.4, tilt 0°: climb (m/s)",
        "mask 7, thrust 0.6, tilt 0°: climb (m/s)",
        "mask 7, thrust 0.5, tilt 3°, 4 s after: tilt (°)",
        "mask 7, thrust 0.5, tilt 3°, 4 s after: echoed tilt (°)",
    }
