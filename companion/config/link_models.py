"""What a mission may say of its link: whom to fly, and who else may use the link."""

from typing import Annotated, Literal

from pydantic import Field

from companion.config.base import Section
from companion.config.signing_models import SigningConfig

SystemId = Annotated[int, Field(ge=1, le=255)]


class ForwardConfig(Section):
    """An endpoint for a ground station or another client."""

    url: str = Field(
        description="udpout://HOST:PORT sends to a client that listens (QGroundControl: 14550); "
        "udpin:// and tcpin:// wait for clients.",
        examples=["udpout://127.0.0.1:14550"],
    )
    remote: bool = Field(
        default=False,
        description="The address is not this computer's loopback: others on the network can "
        "listen, and command as far as the filter lets them.",
    )
    allow_setpoints: bool = Field(
        default=False,
        description="Setpoints, sticks and poses of its clients reach the vehicle in flight.",
    )
    allow_commands: bool = Field(
        default=False,
        description="Commands, modes and parameters of its clients reach the vehicle unfiltered.",
    )
    truth: bool = Field(
        default=False, description="The simulator's truth is forwarded, too; for a display only."
    )


class LinkConfig(Section):
    """The link to the vehicle."""

    system_id: SystemId | None = Field(
        default=None, description="MAVLink system to fly; by default the first that is heard."
    )
    component_id: SystemId | None = Field(
        default=None, description="Its autopilot's component; by default the one that is heard."
    )
    forward: Annotated[tuple[ForwardConfig, ...], Field(strict=False)] = Field(
        default=(), description="Endpoints that share the link."
    )
    mission_backend: Literal["companion", "mavsdk"] = Field(
        default="companion",
        description="Who asks for arming, take-off and landing; setpoints are always ours.",
    )
    signing: SigningConfig | None = Field(
        default=None, description="Packets are signed, and only signed ones are read."
    )
