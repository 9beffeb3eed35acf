"""The real MAVSDK, doing what its users do."""

import asyncio
import math
import tempfile
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

from mavsdk import ComponentType
from mavsdk.asyncio import Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.ftp import FtpAsync
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.log_files import LogFilesAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.mission_raw import MissionItem
from mavsdk.plugins.offboard import Attitude, AttitudeRate

from tests.conformance.shims import announced_parameters, shim_for_clients
from tests.conformance.steps import Session

_HEIGHT_PARAMETER = {"px4": "MIS_TAKEOFF_ALT", "ardupilot": "WPNAV_RADIUS"}
_INTEGER_PARAMETER = {"px4": "COM_OBL_RC_ACT", "ardupilot": "GUID_OPTIONS"}
_HOVER = {"px4": 0.49, "ardupilot": 0.5}
"""Thrust that holds the height: collective on PX4, no climb rate on ArduPilot."""
_OFFBOARD_MODE = {"px4": "OFFBOARD", "ardupilot": "OFFBOARD"}
_GLOBAL_RELATIVE_ALT_INT = 6
_TAKEOFF, _WAYPOINT = 22, 16
_METRES_PER_DEGREE = 111_320.0


async def _until(values: AsyncIterator[Any], condition: Callable[[Any], bool]) -> Any:
    async for value in values:
        if condition(value):
            return value
    raise AssertionError("the subscription ended")


async def run(flavour: str) -> Session:
    """All steps, against a shim of a flavour."""
    session = Session("MAVSDK", flavour)
    async with shim_for_clients(flavour) as (onboard, ground):
        configuration = Configuration.create_with_component_type(ComponentType.COMPANION_COMPUTER)
        async with Mavsdk(configuration) as mavsdk:
            client = _Client(mavsdk, session, other_port=ground)
            await client.run(f"udpin://127.0.0.1:{onboard}")
    return session


class _Client:
    def __init__(self, mavsdk: Any, session: Session, *, other_port: int) -> None:
        self.other_port = other_port
        self.mavsdk = mavsdk
        self.session = session
        self.flavour = session.flavour

    async def run(self, url: str) -> None:
        step = self.session.step
        await step("connect", lambda: self.connect(url), 15.0)
        if not self.session.steps[-1].passed:
            return
        if self.flavour == "ardupilot":
            await step("stream rates", self.ask_for_streams, 10.0)
        await step("version", self.version, 10.0)
        await step("health", self.health, 40.0)
        await step("read a parameter", self.read_parameter, 10.0)
        await step("set a parameter", self.set_parameter, 10.0)
        await step("all parameters", self.all_parameters, 30.0)
        await step("list files by FTP", self.list_files, 15.0)
        await step("arm", self.arm, 15.0)
        await step("take off", self.take_off, 30.0)
        await step("offboard, attitude", self.offboard_attitude, 20.0)
        await step("offboard, body rates", self.offboard_rates, 20.0)
        await step("hold", self.hold, 15.0)
        await step("upload a mission", self.upload_mission, 15.0)
        await step("download the mission", self.download_mission, 15.0)
        await step("fly the mission", self.fly_mission, 60.0)
        await step("land", self.land, 40.0)
        await step("list logs", self.list_logs, 15.0)
        await step("download a log", self.download_log, 60.0)

    async def connect(self, url: str) -> str:
        await self.mavsdk.add_any_connection(url)
        system = await self.mavsdk.first_autopilot(timeout_s=10.0)
        assert system is not None, "no autopilot was found"
        self.system = system
        self.action = ActionAsync(system)
        self.telemetry = TelemetryAsync(system)
        self.offboard = OffboardAsync(system)
        self.parameters = ParamAsync(system)
        self.mission = MissionRawAsync(system)
        self.logs = LogFilesAsync(system)
        return "an autopilot"

    async def ask_for_streams(self) -> str:
        """ArduPilot streams nothing to a new link."""
        telemetry = self.telemetry
        for name in ("position", "attitude_quaternion", "attitude_euler", "position_velocity_ned"):
            await getattr(telemetry, f"set_rate_{name}")(20.0)
        for name in ("landed_state", "health", "home", "gps_info", "battery"):
            setter = getattr(telemetry, f"set_rate_{name}", None)
            if setter is not None:
                await setter(5.0)
        return "granted"

    async def version(self) -> str:
        found = await InfoAsync(self.system).get_version()
        text = f"{found.flight_sw_major}.{found.flight_sw_minor}"
        expected = {"px4": "1.17", "ardupilot": "4.7"}[self.flavour]
        assert text == expected, text
        return text

    async def health(self) -> str:
        await _until(self.telemetry.subscribe_health_all_ok(), bool)
        return "all well"

    async def read_parameter(self) -> str:
        name = _HEIGHT_PARAMETER[self.flavour]
        value = await self.parameters.get_param_float(name)
        assert math.isfinite(value)
        return f"{name} is {value:g}"

    async def set_parameter(self) -> str:
        name = _INTEGER_PARAMETER[self.flavour]
        before = await self.parameters.get_param_int(name)
        await self.parameters.set_param_int(name, 4)
        now = await self.parameters.get_param_int(name)
        await self.parameters.set_param_int(name, before)
        assert now == 4, now
        return f"{name}: {before}, then {now}"

    async def all_parameters(self) -> str:
        found = await self.parameters.get_all_params()
        count = len(found.int_params) + len(found.float_params)
        assert count == await announced_parameters(self.other_port), count
        return f"{count} parameters, all that there are"

    async def list_files(self) -> str:
        """A listing, or an orderly refusal: what must not be is silence."""
        try:
            listing = await FtpAsync(self.system).list_directory("/")
        except Exception as error:
            if "TIMEOUT" in str(error).upper():
                raise
            return "refused in order"
        return f"{len(listing.entries)} entries"

    async def arm(self) -> str:
        await self.action.arm()
        await _until(self.telemetry.subscribe_armed(), bool)
        return "armed"

    async def take_off(self) -> str:
        await self.action.set_takeoff_altitude(3.0)
        await self.action.takeoff()
        await _until(self.telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 2.7)
        await _until(self.telemetry.subscribe_landed_state(), lambda s: s.name == "IN_AIR")
        return "at 3 m"

    async def offboard_attitude(self) -> str:
        yaw_deg = (await self.telemetry.attitude_euler()).yaw_deg
        thrust = _HOVER[self.flavour]
        await self.offboard.set_attitude(Attitude(0.0, -6.0, yaw_deg, thrust))
        await asyncio.sleep(0.2)  # PX4 wants a stream before the switch; MAVSDK sends it by itself
        await self.offboard.start()
        await _until(
            self.telemetry.subscribe_flight_mode(),
            lambda mode: mode.name == _OFFBOARD_MODE[self.flavour],
        )
        seen = await _until(self.telemetry.subscribe_attitude_euler(), lambda a: a.pitch_deg < -5.0)
        return f"pitch {seen.pitch_deg:.0f}° of -6° asked"

    async def offboard_rates(self) -> str:
        before = (await self.telemetry.attitude_euler()).yaw_deg
        thrust = _HOVER[self.flavour]
        await self.offboard.set_attitude_rate(AttitudeRate(0.0, 0.0, 40.0, thrust))

        def turned(attitude: Any) -> bool:
            return 15.0 < (attitude.yaw_deg - before) % 360.0 < 180.0

        await _until(self.telemetry.subscribe_attitude_euler(), turned)
        await self.offboard.set_attitude_rate(AttitudeRate(0.0, 0.0, 0.0, thrust))
        return "turned by more than 15° at 40°/s"

    async def hold(self) -> str:
        await self.offboard.stop()
        mode = await _until(
            self.telemetry.subscribe_flight_mode(), lambda mode: mode.name != "OFFBOARD"
        )
        return f"mode {mode.name}"

    async def land(self) -> str:
        await self.action.land()
        await _until(self.telemetry.subscribe_armed(), lambda armed: not armed)
        return "landed and disarmed"

    async def upload_mission(self) -> str:
        home = await self.telemetry.home()
        north = home.latitude_deg + 12.0 / _METRES_PER_DEGREE
        self.items = [
            _item(0, _TAKEOFF, home.latitude_deg, home.longitude_deg, 3.0),
            _item(1, _WAYPOINT, north, home.longitude_deg, 3.0),
            _item(2, _WAYPOINT, north, home.longitude_deg, 4.0),
        ]
        if self.flavour == "ardupilot":  # its item 0 is home
            self.items = [_item(0, _WAYPOINT, home.latitude_deg, home.longitude_deg, 0.0)] + [
                _item(k + 1, item.command, item.x * 1e-7, item.y * 1e-7, item.z)
                for k, item in enumerate(self.items)
            ]
        await self.mission.upload_mission(self.items)
        return f"{len(self.items)} items"

    async def download_mission(self) -> str:
        found = await self.mission.download_mission()
        assert [i.command for i in found] == [i.command for i in self.items], found
        assert abs(found[-2].x - self.items[-2].x) <= 1
        return f"{len(found)} items, the same"

    async def fly_mission(self) -> str:
        """Begun in the air, so that it is the same for both."""
        await self.mission.start_mission()
        place = await _until(
            self.telemetry.subscribe_position_velocity_ned(), lambda p: p.position.north_m > 10.0
        )
        progress = await _until(
            self.mission.subscribe_mission_progress(), lambda p: 0 < p.total <= p.current
        )
        return f"{place.position.north_m:.0f} m north, {progress.current} of {progress.total} items"

    async def list_logs(self) -> str:
        self.entries = await self.logs.get_entries()
        assert self.entries, "no logs"
        return f"{len(self.entries)} logs, the last of {self.entries[-1].size_bytes} bytes"

    async def download_log(self) -> str:
        entry = min(self.entries, key=lambda e: e.size_bytes)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "flight.log"
            async for _ in self.logs.download_log_file(entry, str(path)):
                pass
            size = path.stat().st_size
        assert size == entry.size_bytes, (size, entry.size_bytes)
        return f"{size} bytes, as announced"


def _item(seq: int, command: int, latitude_deg: float, longitude_deg: float, z: float) -> Any:
    return MissionItem(
        seq=seq,
        frame=_GLOBAL_RELATIVE_ALT_INT,
        command=command,
        current=1 if seq == 0 else 0,
        autocontinue=1,
        param1=0.0,
        param2=0.0,
        param3=0.0,
        param4=math.nan,
        x=round(latitude_deg * 1e7),
        y=round(longitude_deg * 1e7),
        z=z,
        mission_type=0,
    )
