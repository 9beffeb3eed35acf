"""What a vehicle's file may say."""

from typing import Annotated

from pydantic import Field, model_validator

from companion.config.base import NonNegative, PerAxis, Positive, Section


class ResponseConfig(Section):
    """A second-order response from a command to what it commands, of gain 1."""

    natural_frequency_rad_s: Positive = Field(description="ωn: how quickly it follows.")
    damping: Positive = Field(description="ζ: below 1 it overshoots.")
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
    tilt_rate_limit_rad_s: Annotated[float, Field(gt=0.0, le=8.0)] = Field(
        default=3.8, description="Most that roll and pitch turn at."
    )
    yaw_rate_limit_rad_s: Annotated[float, Field(gt=0.0, le=6.0)] = Field(
        default=2.0, description="Most that the heading turns at."
    )


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
    minimum_thrust: Annotated[float, Field(ge=0.0, lt=1.0)] = Field(
        default=0.08, description="Least thrust field that is sent in flight."
    )
    maximum_thrust: Annotated[float, Field(gt=0.0, le=1.0)] = Field(
        default=0.95, description="Largest thrust field that is sent."
    )
    tilt_limit_deg: Annotated[float, Field(gt=0.0, le=60.0)] = Field(
        description="Most that a setpoint tilts the vehicle."
    )
    speed_limit_m_s: Positive = Field(
        description="Trajectories that are faster are refused; plans stay below it."
    )
    acceleration_limit_m_s2: Positive = Field(
        description="Trajectories that accelerate more are refused."
    )
    climb_limit_m_s: Positive = Field(description="Fastest climb that is commanded.")
    descent_limit_m_s: Positive = Field(description="Fastest descent that is commanded.")
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
