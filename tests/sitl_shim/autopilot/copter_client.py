"""A test client of the shim's ArduCopter."""

import math
from typing import Any

from sitl_shim.mavlink.wire import Packer, dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import ARM, SET_MODE, ShimClient

STABILIZE, ALT_HOLD, AUTO, GUIDED, LOITER, RTL = 0, 2, 3, 4, 5, 6
LAND, BRAKE, GUIDED_NOGPS = 9, 17, 20
QUICK_BOOT = 0.1
"""Scale of the boot: a position after some 4 s."""
READY_S = 5.0
GROUND, AIR, TAKING_OFF, LANDING = 1, 2, 3, 4


class CopterClient(ShimClient):
    """Speaks ArduPilot's modes; reads attitude, velocity and state where it must judge."""

    station = Packer(255, 190)
    station_heartbeat = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)

    @property
    def copter(self) -> Any:
        return self.simulation.autopilot

    @property
    def mode(self) -> int:
        return self.copter.heartbeat.custom_mode

    def choose(self, mode: int) -> None:
        """DO_SET_MODE, and until it is answered."""
        self.command(SET_MODE, 1, mode)
        self.run(0.1)

    def climb(self, rate_m_s: float, q: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)) -> None:
        """Attitude and a climb rate, by the default meaning of thrust."""
        fastest = 2.5 if rate_m_s > 0.0 else 1.5
        self.setpoint(q, 0.5 + 0.5 * rate_m_s / fastest)

    def ready(self) -> None:
        """Until it can be armed in GUIDED, which it is in."""
        self.run_until(READY_S - 0.5)
        self.choose(GUIDED)
        self.run_until(READY_S + 1.0)

    def arm(self) -> None:
        self.command(ARM, 1)
        self.run(0.1)
        assert self.copter.armed

    @property
    def tilt_deg(self) -> float:
        _, x, y, _ = self.simulation.state.attitude_flu_to_enu
        return math.degrees(math.acos(1.0 - 2.0 * (x * x + y * y)))

    @property
    def heading_deg(self) -> float:
        """True, clockwise from north."""
        w, x, y, z = self.simulation.state.attitude_flu_to_enu
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return 90.0 - math.degrees(yaw)


def grounded(vehicle: str = "arducopter", *, seed: int = 1, **options: Any) -> CopterClient:
    """At the moment of its boot."""
    settings = {"boot_scale": QUICK_BOOT, **options}
    return CopterClient(ShimOptions(autopilot="ardupilot", vehicle=vehicle, seed=seed, **settings))


def hovering(vehicle: str = "arducopter", *, seed: int = 1, **options: Any) -> CopterClient:
    """Armed, in GUIDED, 30 m above the origin."""
    client = CopterClient(
        ShimOptions(
            autopilot="ardupilot",
            vehicle=vehicle,
            seed=seed,
            airborne_at_enu_m=(0.0, 0.0, 30.0),
            **options,
        )
    )
    client.run(1.0)
    return client


def tilted(roll_deg: float = 0.0, pitch_deg: float = 0.0, yaw_deg: float = 90.0) -> Any:
    """Attitude FRD to NED, Z-Y-X, written out here so that it is not the shim's own."""
    half = [math.radians(angle) / 2.0 for angle in (roll_deg, pitch_deg, yaw_deg)]
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, half), map(math.sin, half)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
