"""What a mission may say about motion capture."""

from typing import Annotated, Literal

from pydantic import Field, field_validator

from companion.config.base import NonNegative, Positive, Section

MocapSystem = Literal["udp", "vicon", "optitrack", "qualisys", "vrpn", "mock"]
"""`udp` is this project's own JSON input; the others are what the package `motioncapture` has."""


class MocapConfig(Section):
    """Where poses come from, what they mean, and how they go on to the autopilot."""

    system: MocapSystem = Field(
        default="udp",
        description="udp: JSON on a port (docs/mocap.md); else a system of the extra `mocap`.",
    )
    host: str = Field(
        default="127.0.0.1",
        description="udp: the address to listen on; else the computer of the motion capture.",
    )
    port: Annotated[int, Field(ge=0, le=65535)] = Field(
        default=9770, description="udp: the port to listen on; 0 takes any free one."
    )
    options: dict[str, str] = Field(
        default_factory=dict, description="Further settings of the package's `connect`."
    )
    body: Annotated[str, Field(min_length=1)] = Field(
        default="drone", description="Name of the vehicle's rigid body."
    )
    axes: Literal["z_up", "y_up"] = Field(
        default="z_up", description="The room's axes: z up (taken for ENU), or y up."
    )
    room_yaw_deg: float = Field(
        default=0.0, description="Turns the room about up, left positive, before it is ENU."
    )
    body_yaw_deg: float = Field(
        default=0.0, description="Where the nose is, seen from the rigid body's x axis."
    )
    rate_hz: Annotated[float, Field(ge=30.0, le=100.0)] = Field(
        default=50.0, description="At most so many poses a second go to the autopilot."
    )
    latency_s: Annotated[float, Field(ge=0.0, le=0.2)] = Field(
        default=0.0, description="From the exposure until the pose is here, at its shortest."
    )
    timeout_s: Annotated[float, Field(ge=0.1, le=2.0)] = Field(
        default=0.4, description="Without a usable pose for this long the stream is lost."
    )
    position_sigma_m: Positive = Field(default=0.002, description="Told to the autopilot.")
    attitude_sigma_deg: Positive = Field(default=0.5, description="Told to the autopilot.")
    max_speed_m_s: Positive = Field(
        default=8.0, description="A pose that would need more speed is an error or a jump."
    )
    max_rate_deg_s: NonNegative = Field(default=900.0, description="The same for its attitude.")

    @field_validator(
        "options", mode="before", json_schema_input_type=dict[str, str | bool | int | float]
    )
    @classmethod
    def _texts(cls, value: object) -> object:
        if isinstance(value, dict):
            return {str(key): str(item) for key, item in value.items()}
        return value
