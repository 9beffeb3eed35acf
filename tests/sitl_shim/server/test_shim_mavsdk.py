"""An independent client, the real MAVSDK 4.1, flies the shim over UDP."""

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest
from mavsdk import ComponentType
from mavsdk.asyncio import Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.offboard import Attitude

from tests.sitl_shim.server.shim_process import free_port, running_shim

pytestmark = pytest.mark.realtime


async def _until(values: AsyncIterator[Any], condition: Callable[[Any], bool]) -> Any:
    async def wait() -> Any:
        async for value in values:
            if condition(value):
                return value
        raise AssertionError("the subscription ended")

    return await asyncio.wait_for(wait(), 20.0)


async def test_mavsdk_connects_arms_takes_off_flies_offboard_and_lands() -> None:
    port = free_port()
    arguments = ["--vehicle=bebop2", "--seed=1", "--speed=4", "--onboard-port=0", "--gcs-port=0"]
    async with running_shim(*arguments, f"--onboard-remote={port}"):
        configuration = Configuration.create_with_component_type(ComponentType.COMPANION_COMPUTER)
        async with Mavsdk(configuration) as mavsdk:
            await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
            system = await mavsdk.first_autopilot(timeout_s=10.0)
            assert system is not None
            await _fly(system)


async def _fly(system: Any) -> None:
    action, telemetry = ActionAsync(system), TelemetryAsync(system)
    offboard, parameters = OffboardAsync(system), ParamAsync(system)
    await _until(telemetry.subscribe_health_all_ok(), bool)

    assert await parameters.get_param_float("MIS_TAKEOFF_ALT") == pytest.approx(2.5)
    await action.set_takeoff_altitude(3.0)
    await action.arm()
    await action.takeoff()
    await _until(telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 2.7)
    await _until(telemetry.subscribe_flight_mode(), lambda mode: mode.name == "HOLD")

    yaw_deg = (await telemetry.attitude_euler()).yaw_deg
    await offboard.set_attitude(Attitude(0.0, -6.0, yaw_deg, 0.49))
    await asyncio.sleep(0.2)  # PX4 wants a stream before the switch; MAVSDK sends it by itself
    await offboard.start()
    await _until(telemetry.subscribe_flight_mode(), lambda mode: mode.name == "OFFBOARD")
    await _until(telemetry.subscribe_attitude_euler(), lambda a: a.pitch_deg < -5.0)
    moved = await _until(
        telemetry.subscribe_position_velocity_ned(), lambda p: p.position.east_m > 1.0
    )
    assert abs(moved.position.north_m) < 0.5
    await offboard.stop()
    await _until(telemetry.subscribe_flight_mode(), lambda mode: mode.name == "HOLD")

    await action.land()
    await _until(telemetry.subscribe_landed_state(), lambda state: state.name == "LANDING")
    await _until(telemetry.subscribe_armed(), lambda armed: not armed)
