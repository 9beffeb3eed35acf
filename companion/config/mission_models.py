"""What a mission may say."""

from typing import Annotated, Any, Literal

from pydantic import Field, WithJsonSchema, field_validator, model_validator

from companion.config.base import Positive, Section, Vector
from companion.config.link_models import LinkConfig
from companion.config.mocap_models import MocapConfig
from companion.config.monitor_models import MonitorConfig, Switches
from companion.config.preflight_models import PreflightConfig
from companion.config.units import written

TRAJECTORY_SCHEMA = WithJsonSchema(
    {"anyOf": [{"type": "integer", "minimum": 1, "maximum": 5}, {"type": "string", "minLength": 1}]}
)
"""A number or a file's name: which numbers, is a validator's affair."""


class GeofenceConfig(Section):
    """A box about the place of take-off (or the local frame's origin: `origin.at`), ENU m."""

    low_m: Vector = Field(
        default=(-3.0, -3.0, 0.2),
        description="The corner that is west, south and below; its height is above the ground.",
    )
    high_m: Vector = Field(
        default=(3.0, 3.0, 4.0), description="The corner that is east, north and above."
    )

    @model_validator(mode="after")
    def _in_order(self) -> "GeofenceConfig":
        if not all(low < high for low, high in zip(self.low_m, self.high_m, strict=True)):
            raise ValueError("low_m must be below high_m on each axis")
        return self


class OriginConfig(Section):
    """Where the trajectory lies, and which way its x axis points."""

    at: Literal["takeoff", "local"] = Field(
        default="takeoff",
        description="Above where the vehicle stood, at the height of that ground, horizontally "
        "where it is after take-off; or at the origin of the autopilot's local frame.",
    )
    offset_enu_m: Vector = Field(
        default=(0.0, 0.0, 0.0), description="From there to the trajectory's origin."
    )
    heading_deg: float | Literal["vehicle"] = Field(
        default=0.0,
        description="Direction of the trajectory's x axis, counter-clockwise from east; or where "
        "the nose points at engagement.",
    )


class TimeoutsConfig(Section):
    """How long the companion waits for what, s (of the autopilot's time where it flies)."""

    connect_s: Positive = Field(default=20.0, description="For the vehicle's first heartbeat.")
    ready_s: Positive = Field(
        default=60.0,
        description="For its estimate and its own checks, before arming; a satellite fix takes "
        "its time.",
    )
    command_s: Positive = Field(default=5.0, description="For the answer to a command.")
    takeoff_s: Positive = Field(default=30.0, description="For the take-off's height.")
    land_s: Positive = Field(default=60.0, description="For the ground, and the motors' stop.")
    link_lost_s: Annotated[float, Field(ge=1.5)] = Field(
        default=5.0, description="Silence after which the flight gives the link up."
    )
    handed_over_s: Positive = Field(
        default=60.0, description="Wait for a person's word after a hand-over."
    )


class SupervisorConfig(Section):
    """When the ladder of fallbacks is climbed down."""

    state_age_limit_s: Annotated[float, Field(ge=0.03, le=0.5)] = Field(
        default=0.1, description="A state older than this is not flown on."
    )
    hand_over_after_s: Annotated[float, Field(ge=0.1, le=3.0)] = Field(
        default=0.8, description="After this long on a fallback that holds nothing: hand over."
    )
    failed_solves_s: Annotated[float, Field(ge=0.1, le=5.0)] = Field(
        default=1.0, description="After this long without a solved plan: hand over."
    )
    loop_delay_limit_s: Annotated[float, Field(ge=0.05, le=0.5)] = Field(
        default=0.1,
        description="Nothing is tracked while a setpoint acts later than this after its state.",
    )
    jump_limit_m: Annotated[float, Field(ge=0.1, le=5.0)] = Field(
        default=1.0, description="An estimate that steps further is not followed: hand over."
    )


class MissionConfig(Section):
    """A flight."""

    @field_validator("trajectory", mode="before")
    @classmethod
    def _known_trajectory(cls, value: object) -> object:
        number = isinstance(value, int) and not isinstance(value, bool)
        if not (number and value in range(1, 6)) and not (isinstance(value, str) and value):
            raise ValueError("test trajectories are numbered 1 to 5; else give a CSV or YAML file")
        return value

    @field_validator("faults", mode="before")
    @classmethod
    def _names_or_keys(cls, value: object) -> object:
        keys = isinstance(value, dict) and all(isinstance(key, str) for key in value)
        if not keys and value is not None and not (isinstance(value, str) and value):
            raise ValueError("a name, a YAML file, or keys such as link and vehicle are expected")
        return value

    trajectory: Annotated[int | str, TRAJECTORY_SCHEMA] = Field(
        default=4,
        description="What is flown: 1 line, 2 circle, 3 tilted ellipse, 4 figure-eight, 5 rose; or "
        "a file of timed points, CSV or YAML.",
        json_schema_extra=written("1 … 5, or a file's name"),
    )
    controller: str = Field(
        default="mpc-l1",
        description="By name (configs/controllers/, one for the vehicle), or a YAML file.",
    )
    vehicle: str = Field(
        default="bebop2",
        description="What is known of the vehicle: by name (configs/vehicles/), or a YAML file.",
    )
    autopilot: Literal["auto", "px4", "ardupilot"] = Field(
        default="auto", description="By its HEARTBEAT, or another one is refused."
    )
    setpoint: Literal["attitude", "rates"] = Field(
        default="attitude",
        description="What is streamed: attitudes, or body rates by the companion's own loop.",
    )
    wind: str = Field(
        default="calm",
        description="Wind and events of the embedded shim: calm, fan, gusts, wind3, payload-drop, "
        "gust-front, weak-motor, or a scenario's YAML file.",
    )
    faults: str | dict[str, Any] | None = Field(
        default=None,
        description="What goes wrong on purpose in the embedded shim: faults by name (bad-link, "
        "slow-link), a YAML file, or their keys.",
        examples=["bad-link"],
    )
    sensors: str | None = Field(
        default=None,
        description="A sensor profile of the embedded shim in place of the vehicle's own, by name "
        "(mocap, gnss, ekf3, exact) or a YAML file.",
        examples=["mocap"],
    )
    plant: str | None = Field(
        default=None,
        description="A plant file (YAML) of the embedded shim: a simulated vehicle of one's own, "
        "in place of the one of the vehicle's name.",
        examples=["plant.yaml"],
    )
    seed: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        default=0,
        description="Of all noise of the embedded shim; the same seed gives the same flight in "
        "lockstep.",
    )
    connect: str | None = Field(
        default=None,
        description="Link to a real autopilot, in place of the embedded shim: udpin://HOST:PORT, "
        "udpout://HOST:PORT, tcpout://HOST:PORT, serial:///dev/DEVICE:BAUD.",
        examples=["udpin://127.0.0.1:14540"],
    )
    link: LinkConfig = Field(
        default=LinkConfig(),
        description="Whom to fly on that link, who else may use it, and signing.",
    )
    mocap: MocapConfig | None = Field(
        default=None, description="Poses from a motion-capture system, for the autopilot."
    )
    origin: OriginConfig = Field(
        default=OriginConfig(),
        description="Where the trajectory lies, and which way its x axis points.",
    )
    takeoff_height_m: Annotated[float, Field(ge=0.5, le=20.0)] = Field(
        default=2.5,
        description="Of the take-off on ArduPilot; PX4 goes to its own MIS_TAKEOFF_ALT.",
    )
    hover_s: Annotated[float, Field(ge=0.0, le=60.0)] = Field(
        default=4.0, description="At the trajectory's first point, before it is flown."
    )
    approach_speed_m_s: Annotated[float, Field(gt=0.05, le=2.0)] = Field(
        default=0.6, description="On the way there, and back to where it took off."
    )
    state_rate_hz: Annotated[float, Field(ge=30.0, le=250.0)] = Field(
        default=100.0,
        description="Of states that the autopilot is asked for; each is answered by a setpoint.",
    )
    geofence: GeofenceConfig = Field(
        default=GeofenceConfig(),
        description="A box about the place of take-off (or the local frame's origin: "
        "`origin.at`), ENU, neither moved by the offset nor turned. A trajectory that leaves it "
        "is refused.",
    )
    timeouts: TimeoutsConfig = Field(
        default=TimeoutsConfig(), description="How long the companion waits for what."
    )
    supervisor: SupervisorConfig = Field(
        default=SupervisorConfig(),
        description="When a flight falls back to something simpler, or is handed over.",
    )
    monitor: MonitorConfig = Field(
        default=MonitorConfig(),
        description="The in-flight monitor (docs/monitor.md): when a flight goes down to a more "
        "robust controller.",
    )
    switch: Switches = Field(
        default=(),
        description="Hand-overs in flight, each t=SECONDS:CONTROLLER; the controller by name or "
        "YAML file, or l1-off, l1-on.",
    )
    preflight: PreflightConfig = Field(
        default=PreflightConfig(), description="The checks before a flight (docs/preflight.md)."
    )
