"""Who asks the autopilot for arming, take-off and landing: the companion itself, or MAVSDK."""

from importlib.util import find_spec
from typing import Literal, Protocol

from companion.config.link_models import ForwardConfig
from companion.config.yaml_source import ConfigError
from companion.extras import install_extra
from companion.flight.shared_link.endpoints import Endpoint
from companion.flight.stages.mavsdk_mission import MavsdkMission
from companion.flight.vehicle.connection import Connection
from companion.mavlink.commands import arm
from companion.mavlink.exchange import Verdict


class Answer(Protocol):
    """How a request to the autopilot ended."""

    @property
    def verdict(self) -> Verdict:
        """Accepted, refused, or not answered."""

    @property
    def explanation(self) -> str:
        """One sentence, for a person."""


class MissionBackend(Protocol):
    """The level above setpoints."""

    @property
    def endpoints(self) -> tuple[ForwardConfig, ...]:
        """Endpoints of the shared link that it needs for itself."""

    def attach(self, endpoint: Endpoint) -> None:
        """Take the endpoint, which is open now."""

    async def become_ready(self, timeout_s: float) -> None:
        """Connect, and agree that the vehicle is fit to fly.

        Raises:
            FlightAbortedError: it is not; the text says what is missing.
        """

    async def arm(self) -> Answer:
        """Ask for arming."""

    async def take_off(self, height_m: float) -> Answer:
        """Ask for a take-off to a height above the ground."""

    async def land(self) -> Answer:
        """Ask for a landing; accepted once the vehicle reports that mode."""

    async def close(self) -> None:
        """Let go of everything."""


class OwnMission:
    """Commands of the companion's own."""

    endpoints: tuple[ForwardConfig, ...] = ()

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def attach(self, endpoint: Endpoint) -> None:
        """None is needed."""

    async def become_ready(self, timeout_s: float) -> None:
        """Always."""

    async def arm(self) -> Answer:
        """COMPONENT_ARM_DISARM."""
        return await self._connection.exchanges.command(arm(self._connection.target))

    async def take_off(self, height_m: float) -> Answer:
        """NAV_TAKEOFF as the autopilot's dialect has it."""
        connection = self._connection
        return await connection.exchanges.command(
            connection.dialect.takeoff(connection.target, height_m)
        )

    async def land(self) -> Answer:
        """The autopilot's mode LAND."""
        connection = self._connection
        return await connection.exchanges.change_mode(connection.target, "land")

    async def close(self) -> None:
        """Nothing is held."""


def make_backend(name: Literal["companion", "mavsdk"], connection: Connection) -> MissionBackend:
    """The backend of a name in the mission."""
    return MavsdkMission(connection) if name == "mavsdk" else OwnMission(connection)


def require_mavsdk() -> None:
    """Refuse a flight that needs MAVSDK where it is not installed.

    Raises:
        ConfigError: it is not there, or is one of the versions with another interface.
    """
    if find_spec("mavsdk") is None:
        raise ConfigError(
            "link.mission_backend: mavsdk needs MAVSDK, which is not installed. Run: "
            f"{install_extra('mavsdk')}, or leave the setting out."
        )
    if find_spec("mavsdk.asyncio") is None:
        raise ConfigError(
            "link.mission_backend: mavsdk needs MAVSDK 4, and the one installed is older. Run: "
            f"{install_extra('mavsdk')}."
        )
