"""A shim that does one thing otherwise than the real one is found to differ in just that.

Each of these went unnoticed by an earlier, coarser comparison.
"""

import math
from collections.abc import Callable
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


@pytest.mark.parametrize(
    ("message", "hz", "often"),
    [
        ("SYSTEM_TIME", 1.8, "more often"),
        ("BATTERY_STATUS", 1.2, "more often"),
        ("ODOMETRY", 36.0, "more often"),
        ("SYS_STATUS", 4.2, "less often"),
    ],
)
def test_another_rate(monkeypatch: pytest.MonkeyPatch, message: str, hz: float, often: str) -> None:
    number = getattr(dialect, f"MAVLINK_MSG_ID_{message}")
    monkeypatch.setitem(streams._ONBOARD_RATES_HZ, number, hz)
    (found,) = _unknown("px4-params-mission", 19.2, "rates")
    assert found.startswith(f"{message} comes")
    assert found.endswith(often)


_RECEIVE = Guided.receive_attitude


def _climbs_faster(self: Guided, *arguments: Any) -> bool:
    taken = _RECEIVE(self, *arguments)
    self.climb_m_s *= 1.4
    return taken


def _flies_small_tilts_level(self: Guided, *arguments: Any) -> bool:
    taken = _RECEIVE(self, *arguments)
    if taken and self.attitude is not None:
        w, x, y, z = self.attitude
        if math.hypot(x, y) < math.sin(math.radians(9.0) / 2.0):
            norm = math.hypot(w, z)
            self.attitude = (w / norm, 0.0, 0.0, z / norm)
    return taken


def _never_times_out(self: Guided, *arguments: Any) -> bool:
    return False


@pytest.mark.parametrize(
    ("method", "otherwise", "until_s", "effects"),
    [
        (
            "receive_attitude",
            _flies_small_tilts_level,
            62.0,
            {
                "mask 7, thrust 0.5, tilt 5°: tilt (°)",
                "mask 7, thrust 0.5, tilt 5°: echoed tilt (°)",
            },
        ),
        (
            "receive_attitude",
            _climbs_faster,
            79.0,
            {
                "mask 7, thrust 0.6, tilt 0°: climb (m/s)",
                "mask 7, thrust 0.4, tilt 0°: climb (m/s)",
            },
        ),
        (
            "timed_out",
            _never_times_out,
            117.0,
            {
                f"mask 7, thrust 0.5, tilt 3°, 4 s after: {what} (°)"
                for what in ("tilt", "echoed tilt")
            },
        ),
    ],
    ids=["small tilts are level", "climbs 1.4 times as fast", "GUID_TIMEOUT has no effect"],
)
def test_another_effect_of_setpoints_on_ardupilot(
    monkeypatch: pytest.MonkeyPatch,
    method: str,
    otherwise: Callable[..., bool],
    until_s: float,
    effects: set[str],
) -> None:
    monkeypatch.setattr(Guided, method, otherwise)
    found = _unknown("ardupilot-flight", until_s, "effects of setpoints")
    assert effects <= {text.partition(" differs")[0] for text in found}
