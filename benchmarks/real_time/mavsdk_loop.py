"""The same job as its users write it with MAVSDK: odometry in, attitude out, in Python's asyncio.

    python -m benchmarks.real_time.mavsdk_loop URL SECONDS

A proportional-derivative law towards a point, as Euler angles; the thrust tells which odometry it
was made of (`frames.tagged_thrust`).  The vehicle stays on the ground: what it does with the
setpoints is not looked at.
"""

import asyncio
import sys

from mavsdk import ComponentType
from mavsdk.asyncio import Configuration, Mavsdk
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.offboard import Attitude
from mavsdk.plugins.telemetry import Odometry

from benchmarks.real_time.frames import tagged_thrust

_RATE_HZ = 100.0
_CONNECTS_WITHIN_S = 15.0
_KP_DEG_M, _KD_DEG_S_M, _LIMIT_DEG = 8.0, 6.0, 20.0


async def run(url: str, seconds: float) -> None:
    """Answer odometry for so long.

    Raises:
        TimeoutError: there is no vehicle, or it tells no odometry.
    """
    configuration = Configuration.create_with_component_type(ComponentType.COMPANION_COMPUTER)
    async with Mavsdk(configuration) as mavsdk:
        await mavsdk.add_any_connection(url)
        system = await mavsdk.first_autopilot(_CONNECTS_WITHIN_S)
        if system is None:
            raise TimeoutError(f"no autopilot at {url}")
        telemetry, offboard = TelemetryAsync(system), OffboardAsync(system)
        await telemetry.set_rate_odometry(_RATE_HZ)
        loop = asyncio.get_running_loop()
        end_s = loop.time() + seconds
        async for odometry in telemetry.subscribe_odometry():
            await offboard.set_attitude(_setpoint(odometry))
            if loop.time() > end_s:
                break


def _setpoint(odometry: Odometry) -> Attitude:
    position, velocity = odometry.position_body, odometry.velocity_body
    pitch = _KP_DEG_M * position.x_m + _KD_DEG_S_M * velocity.x_m_s
    roll = -_KP_DEG_M * position.y_m - _KD_DEG_S_M * velocity.y_m_s
    return Attitude(_limited(roll), _limited(pitch), 0.0, tagged_thrust(odometry.time_usec))


def _limited(angle_deg: float) -> float:
    return max(-_LIMIT_DEG, min(_LIMIT_DEG, angle_deg))


if __name__ == "__main__":
    asyncio.run(run(sys.argv[1], float(sys.argv[2])))
