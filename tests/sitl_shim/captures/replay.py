"""Says to the shim what clients said to a real vehicle, at the same boot times."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from companion.mavlink.framing import Framer
from sitl_shim.mavlink.endpoint import Shim
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.captures.conversation import Capture, Conversation, Said, is_vehicle

_GPS_AT_41_6_S = 518
"""A seed with which ArduPilot's estimator begins to use GPS when it did in the recordings."""
_LONGER_S = 3.0
"""The shim may be so much later with what the real one said last."""


@dataclass(frozen=True)
class Setting:
    """The vehicle and the link of a recording."""

    autopilot: str = "px4"
    vehicle: str = "sih_quadx"
    link: LinkKind = LinkKind.ONBOARD
    parameters: Mapping[str, float] = field(default_factory=dict)
    seed: int = 3
    shift_s: float = 0.0
    """Added to the recording's times.  At which fraction of a second the real one's cycles
    (heartbeats at 1 Hz, health checks at 10 Hz) come after its boot, differs from boot to boot;
    whether a short-lived mode is seen, or a setpoint came before the check, depends on it."""


SETTINGS: Mapping[str, Setting] = {
    "px4-boot-onboard": Setting(),
    "px4-offboard": Setting(shift_s=-0.442),
    "px4-stream-loss-hold": Setting(parameters={"COM_OBL_RC_ACT": 5.0}, shift_s=-0.38),
    "px4-mavsdk": Setting(parameters={"COM_OBL_RC_ACT": 5.0}, shift_s=-0.04),
    "px4-mavproxy": Setting(link=LinkKind.GROUND_STATION, shift_s=0.084),
    "px4-params-mission": Setting(shift_s=-0.092),
    "ardupilot-boot": Setting("ardupilot", "arducopter", seed=_GPS_AT_41_6_S),
    "ardupilot-flight": Setting("ardupilot", "arducopter", seed=_GPS_AT_41_6_S),
    "ardupilot-mavsdk": Setting("ardupilot", "arducopter", seed=_GPS_AT_41_6_S),
}


def replay(capture: Capture) -> Conversation:
    """What the shim says while it is told what the recorded clients told the real one."""
    setting = SETTINGS[capture.name]
    options = ShimOptions(
        autopilot=setting.autopilot,
        vehicle=setting.vehicle,
        seed=setting.seed,
        parameters=dict(setting.parameters),
        truth=False,
    )
    shim = Shim(options, [setting.link])
    shift_s = setting.shift_s
    for each in capture.clients:
        shim.receive(0, each.frame.raw, max(0.0, each.time_s + shift_s))
    real = capture.vehicle
    said: list[Said] = []
    counts: dict[int, dict[int, int]] = {}
    framer = Framer()
    while shim.time_s < real.ends_s + shift_s + _LONGER_S:
        for datagram in shim.step():
            time_s = datagram.due_s - shift_s
            if time_s < real.begins_s:
                continue
            for frame in framer.feed(datagram.data):
                if is_vehicle(frame):
                    said.append(Said(time_s, frame))
                    windows = counts.setdefault(frame.message_id, {})
                    window = int(time_s / real.window_s)
                    windows[window] = windows.get(window, 0) + 1
    said.sort(key=lambda each: each.time_s)
    return Conversation(real.begins_s, real.ends_s, said, real.window_s, counts)
