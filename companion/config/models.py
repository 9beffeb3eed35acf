"""What a mission, a vehicle and a controller file may say."""

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from companion.config.base import NonNegative, PerAxis, Positive, Section, Vector
from companion.config.link_models import LinkConfig
from companion.config.mocap_models import MocapConfig
from companion.config.monitor_models import MonitorConfig, Switches
from companion.config.plus_models import PlusConfig
from companion.config.preflight_models import PreflightConfig


class ResponseConfig(Section):
    """A second-order response from a command to what it commands, of gain 1."""

    natural_frequency_rad_s: Positive
    damping: Positive
    delay_s: NonNegative = Field(default=0.0, description="Dead time before it, of the vehicle.")


class DynamicsConfig(Section):
    """How a vehicle answers, as stated or identified: the linear A(s) of the theory."""

    attitude: ResponseConfig = Field(description="Tilt setpoint → tilt.")
    climb: ResponseConfig = Field(
        description="Climb-rate command → climb rate, with the companion's thrust loop closed."
    )
    loop_delay_s: NonNegative = Field(
        description="Transport: from the state's time until a command decided on it arrives."
    )
    lift: ResponseConfig | None = Field(
        default=None,
        description="Thrust setpoint → vertical acceleration; where the autopilot takes thrust.",
    )
    tilt_gain: Positive = Field(
        default=1.0,
        description="Horizontal acceleration over g times the tangent of the reported tilt.",
    )
    linear_drag_1_s: NonNegative = Field(description="k1 in the drag k1 v + k2 v|v| per mass.")
    quadratic_drag_1_m: NonNegative = Field(description="k2 in the drag k1 v + k2 v|v| per mass.")


class NoiseConfig(Section):
    """How far samples of the reported state scatter, as identified in a hover; ENU, one sigma."""

    position_m: PerAxis = Field(description="White part of the position.")
    velocity_m_s: PerAxis = Field(description="White part of the velocity.")
    acceleration_m_s2_sqrt_hz: PerAxis = Field(
        description="Density of the unexplained acceleration: of air, and of a wandering estimate."
    )
    tilt_rad: Positive = Field(description="White part of roll and pitch.")


class AttitudeLoopConfig(Section):
    """The companion's own attitude loop, for setpoints of body rates."""

    tilt_gain_1_s: Positive = Field(description="Tilt error to rate.")
    yaw_gain_1_s: Positive = Field(description="Heading error to rate.")
    tilt_rate_limit_rad_s: Annotated[float, Field(gt=0.0, le=8.0)] = 3.8
    yaw_rate_limit_rad_s: Annotated[float, Field(gt=0.0, le=6.0)] = 2.0


class VehicleConfig(Section):
    """What a user (or an identification) knows about a vehicle; never the simulator's truth."""

    name: str = Field(
        description="The vehicle that it is: its controller and the shim's plant have that name."
    )
    source: str = Field(description="Where the numbers came from.")
    hover_thrust: Annotated[float, Field(gt=0.05, lt=0.95)] = Field(
        description="First guess of the thrust field at hover."
    )
    thrust_curve: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        default=0.0, description="c in force = c t² + (1 - c) t."
    )
    minimum_thrust: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.08
    maximum_thrust: Annotated[float, Field(gt=0.0, le=1.0)] = 0.95
    tilt_limit_deg: Annotated[float, Field(gt=0.0, le=60.0)]
    speed_limit_m_s: Positive
    acceleration_limit_m_s2: Positive
    climb_limit_m_s: Positive
    descent_limit_m_s: Positive
    attitude_loop: AttitudeLoopConfig | None = Field(
        default=None, description="What `setpoint: rates` flies with."
    )
    dynamics: DynamicsConfig | None = Field(
        default=None,
        description="What `certify` reckons with and `mpc-l1-plus` flies with; `mpc-l1` needs none "
        "of it.",
    )
    noise: NoiseConfig | None = Field(
        default=None, description="What the predictor of `mpc-l1-plus` is weighted by."
    )

    @model_validator(mode="after")
    def _thrust_in_order(self) -> "VehicleConfig":
        if not self.minimum_thrust < self.hover_thrust < self.maximum_thrust:
            raise ValueError("minimum_thrust < hover_thrust < maximum_thrust must hold")
        return self


class TransferFunctionConfig(Section):
    """A strictly proper transfer function; coefficients in descending powers of s."""

    numerator: Annotated[tuple[float, ...], Field(strict=False, min_length=1)]
    denominator: Annotated[tuple[float, ...], Field(strict=False, min_length=2)]


TransferFunctions = Annotated[
    tuple[TransferFunctionConfig, TransferFunctionConfig, TransferFunctionConfig],
    Field(strict=False),
]
NonNegativePerAxis = Annotated[tuple[NonNegative, NonNegative, NonNegative], Field(strict=False)]


class ClimbRateGains(Section):
    """L1 gains of the vertical axis."""

    m: Positive
    omega: Positive
    k: Positive
    gamma: Positive
    sigma_bound: Positive


class L1Config(Section):
    """Gains of the L1 controller, per axis (x, y, z)."""

    m: PerAxis | None = Field(
        default=None, description="Bandwidth of the reference model M(s) = m / (s + m), 1/s."
    )
    reference_model: TransferFunctions | None = Field(
        default=None, description="M(s) in place of m; strictly positive real, of gain 1."
    )
    omega: PerAxis | None = Field(
        default=None, description="Bandwidth of the low-pass filter C(s) = ω / (s + ω), rad/s."
    )
    low_pass: TransferFunctions | None = Field(
        default=None, description="C(s) in place of omega; stable, C(0) = 1."
    )
    k: PerAxis = Field(description="Proportional gain K of the position loop, 1/s.")
    gamma: PerAxis = Field(description="Adaptation rate Γ, 1/s².")
    sigma_bound: PerAxis = (8.0, 8.0, 8.0)
    projection_margin: Annotated[float, Field(gt=0.0, le=1.0)] = 0.1
    discretisation: Literal["exact", "euler"] = Field(
        default="exact", description="Of predictor and adaptation law; euler is for study."
    )

    climb_rate: ClimbRateGains | None = Field(
        default=None,
        description="Of the vertical axis, in place of the above, where the autopilot's own loop "
        "flies the climb rate (ArduPilot's default); it is slower than the companion's. An M(s) or "
        "C(s) that is given as such stays.",
    )

    @model_validator(mode="after")
    def _one_of_each(self) -> "L1Config":
        for one, other in (("m", "reference_model"), ("omega", "low_pass")):
            if (getattr(self, one) is None) == (getattr(self, other) is None):
                raise ValueError(f"give {one} or {other}, and not both")
        return self


class PidConfig(Section):
    """A PID law, per axis (x, y, z); its derivative is of the measurement."""

    kp: NonNegativePerAxis
    ki: NonNegativePerAxis
    kd: NonNegativePerAxis
    integral_limit: PerAxis = Field(description="Bound of the integral's part of the output.")


class OuterPidConfig(PidConfig):
    """The PID of PID-L1."""

    derivative: Literal["measurement", "error"] = Field(
        default="measurement",
        description="What D acts on; that of the error contains a derivative of y2*, a preview.",
    )


class LqrConfig(Section):
    """An LQR with integral action over D(s), per axis (x, y, z)."""

    position: PerAxis = Field(description="Weight on (y2* - y2)².")
    velocity: NonNegativePerAxis = Field(description="Weight on y1².")
    integral: PerAxis = Field(description="Weight on the squared integral of y2* - y2.")
    reference: PerAxis = Field(default=(1.0, 1.0, 1.0), description="Weight on (r2 - y2*)².")
    integral_limit: PerAxis = Field(description="Bound of the integral's part of r2, m.")
    period_s: Annotated[float, Field(ge=0.005, le=0.1)] = Field(
        default=0.01, description="Sampling time of the discretised D(s), and of the law."
    )


class MpcModelConfig(Section):
    """A second-order model ``K m / (s² + m s + K m)`` per axis: ωn² = K m, 2 ζ ωn = m."""

    m: PerAxis
    k: PerAxis


class MpcConfig(Section):
    """The outer controller."""

    period_s: Annotated[float, Field(ge=0.01, le=0.5)] = 0.03
    horizon: Annotated[int, Field(ge=2, le=200)] = 30
    q: Positive = 17.0
    r: NonNegative = 0.08
    s: NonNegative = 0.02
    penalise: Literal["r_minus_target", "absolute_r"] = "r_minus_target"
    r_max_m_s2: Positive = 160.0
    solver: Literal["osqp", "daqp"] = Field(
        default="osqp", description="daqp: exact and quicker; pip install 'companion[daqp]'."
    )


class ThrustConfig(Section):
    """The climb-rate loop and the hover-thrust estimator."""

    proportional: Positive = 4.0
    integral: NonNegative = 1.0
    maximum_acceleration_m_s2: Positive = 4.0
    hover_drift: Positive = 0.003
    acceleration_noise_m_s2: Positive = 0.2


class YawConfig(Section):
    """The yaw law."""

    gain: Positive = 1.5
    rate_limit_rad_s: Positive = 1.0
    desired: Literal["zero", "heading_at_engagement"] = Field(
        default="heading_at_engagement",
        description="zero: along the trajectory's own x axis, wherever the mission turns it.",
    )


Framework = Literal["mpc-l1", "pid-l1", "lqr-l1", "l1", "mpc-pid", "pid", "mpc-l1-plus"]

FRAMEWORK_SECTIONS: dict[Framework, tuple[str, ...]] = {
    "mpc-l1": ("mpc", "l1"),
    "pid-l1": ("outer_pid", "l1"),
    "lqr-l1": ("lqr", "l1"),
    "l1": ("l1",),
    "mpc-pid": ("mpc", "mpc_model", "inner_pid"),
    "pid": ("inner_pid",),
    "mpc-l1-plus": ("plus",),
}
"""The sections of gains that each framework reads."""


class ControllerConfig(Section):
    """A named stack with its gains."""

    framework: Framework
    source: str = Field(description="Where the numbers came from.")
    l1: L1Config | None = None
    mpc: MpcConfig | None = None
    mpc_model: MpcModelConfig | None = Field(
        default=None, description="What the MPC takes the PID-controlled vehicle for."
    )
    outer_pid: OuterPidConfig | None = Field(default=None, description="r2 = y2* + PID(y2* - y2).")
    lqr: LqrConfig | None = None
    inner_pid: PidConfig | None = Field(default=None, description="u = PID(r2 - y2).")
    plus: PlusConfig | None = Field(default=None, description="MPC-L1+.")
    thrust: ThrustConfig = ThrustConfig()
    yaw: YawConfig = YawConfig()
    fallback: str | None = Field(
        default=None,
        description="Robust controller that the in-flight monitor falls back to: a name, a YAML "
        "file beside this one, or none. Of mpc-l1-plus by default the vehicle's mpc-l1.",
    )

    @model_validator(mode="after")
    def _sections_of_the_framework(self) -> "ControllerConfig":
        wanted = FRAMEWORK_SECTIONS[self.framework]
        known = {section for sections in FRAMEWORK_SECTIONS.values() for section in sections}
        missing = [section for section in wanted if getattr(self, section) is None]
        if missing:
            raise ValueError(f"the framework {self.framework} needs '{missing[0]}'. Add it")
        for section in sorted(known.difference(wanted)):
            if getattr(self, section) is not None:
                raise ValueError(
                    f"the framework {self.framework} has no '{section}', only "
                    f"{', '.join(wanted)}. Remove it"
                )
        if "mpc" in wanted and self.l1 is not None and self.l1.m is None:
            raise ValueError("the MPC over an L1 controller needs M(s) by its m. Give l1.m")
        if self.framework == "lqr-l1" and self.l1 is not None and self.l1.m is None:
            raise ValueError("the LQR over an L1 controller needs M(s) by its m. Give l1.m")
        return self


class GeofenceConfig(Section):
    """A box about the place of take-off (or the local frame's origin: `origin.at`), ENU m."""

    low_m: Vector = (-3.0, -3.0, 0.2)
    high_m: Vector = (3.0, 3.0, 4.0)

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

    connect_s: Positive = 20.0
    ready_s: Positive = 60.0
    command_s: Positive = 5.0
    takeoff_s: Positive = 30.0
    land_s: Positive = 60.0
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

    trajectory: int | str = Field(default=4, description="1 … 5, or a CSV or YAML file.")
    controller: str = "mpc-l1"
    vehicle: str = "bebop2"
    autopilot: Literal["auto", "px4", "ardupilot"] = Field(
        default="auto", description="By its HEARTBEAT, or another one is refused."
    )
    setpoint: Literal["attitude", "rates"] = Field(
        default="attitude",
        description="What is streamed: attitudes, or body rates by the companion's own loop.",
    )
    wind: str = Field(default="calm", description="A scenario of the embedded shim.")
    faults: str | dict[str, Any] | None = Field(
        default=None,
        description="What goes wrong on purpose in the embedded shim: faults by name, a YAML "
        "file, or their keys.",
    )
    sensors: str | None = Field(
        default=None,
        description="A sensor profile of the embedded shim in place of the vehicle's own, by name "
        "(mocap, gnss, exact) or a YAML file.",
    )
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    connect: str | None = Field(default=None, description="Link to a real autopilot.")
    link: LinkConfig = LinkConfig()
    mocap: MocapConfig | None = Field(
        default=None, description="Poses from a motion-capture system, for the autopilot."
    )
    origin: OriginConfig = OriginConfig()
    takeoff_height_m: Annotated[float, Field(ge=0.5, le=20.0)] = Field(
        default=2.5,
        description="Of the take-off on ArduPilot; PX4 goes to its own MIS_TAKEOFF_ALT.",
    )
    hover_s: Annotated[float, Field(ge=0.0, le=60.0)] = 4.0
    approach_speed_m_s: Annotated[float, Field(gt=0.05, le=2.0)] = 0.6
    state_rate_hz: Annotated[float, Field(ge=30.0, le=250.0)] = 100.0
    geofence: GeofenceConfig = GeofenceConfig()
    timeouts: TimeoutsConfig = TimeoutsConfig()
    supervisor: SupervisorConfig = SupervisorConfig()
    monitor: MonitorConfig = MonitorConfig()
    switch: Switches = Field(
        default=(), description="Hand-overs in flight, each t=SECONDS:CONTROLLER."
    )
    preflight: PreflightConfig = PreflightConfig()
