"""The section `plus:` of a controller's file: MPC-L1+."""

from typing import Annotated, Literal

from pydantic import Field

from companion.config.base import NonNegative, PerAxis, Positive, Section
from companion.config.units import unit

Bandwidth = Annotated[float, Field(ge=0.5, le=20.0)]
NonNegativePerAxis = Annotated[tuple[NonNegative, NonNegative, NonNegative], Field(strict=False)]


class LagConfig(Section):
    """Learning of the attitude's lag in flight."""

    forgetting_s: Positive = Field(default=4.0, description="What was seen longer ago counts less.")
    prior: Positive = Field(
        default=1.0,
        description="Excitation, (m/s³)² s, that weighs as much as what was identified.",
    )
    least_scale: Annotated[float, Field(ge=0.3, le=1.0)] = Field(
        default=0.6, description="Of the time constants of the attitude's response."
    )
    greatest_scale: Annotated[float, Field(ge=1.0, le=3.0)] = Field(
        default=2.2, description="The same, upwards."
    )


class MismatchConfig(Section):
    """Learning of drag, tilt gain and heading in flight: how far each may be off, one sigma."""

    forgetting_s: Positive = Field(default=8.0, description="What was seen longer ago counts less.")
    drag_1_s: Positive = Field(default=0.2, description="Of the linear drag per mass.")
    gain: Positive = Field(default=0.1, description="Of the tilt gain, as a share.")
    heading_rad: Positive = Field(default=0.15, description="Of the reported heading.")
    settling_s: Positive = Field(default=0.5, description="Low-pass on what was learnt.")
    farthest: Positive = Field(default=3.0, description="Standard deviations that each may go.")


class VerticalPlusConfig(Section):
    """Of the vertical axis where the autopilot's own loop flies the climb rate."""

    bandwidth_rad_s: Bandwidth = Field(description="Of the feedback.")
    rate_time_s: NonNegative = Field(description="τ: weight on the rate of the command.")
    low_pass_rad_s: Positive = Field(description="C(s) on the adaptive estimate.")
    sigma_walk: Positive = Field(
        description="How quickly the disturbance is reckoned to change.",
        json_schema_extra=unit("m/s² per √s"),
    )


class PlusConfig(Section):
    """Weights and bandwidths of MPC-L1+, per axis (x, y, z); its model is the vehicle's file's."""

    bandwidth_rad_s: Annotated[tuple[Bandwidth, Bandwidth, Bandwidth], Field(strict=False)] = Field(
        description="Of the feedback: ρ = bandwidth⁻⁴ on (u - u*)², bandwidth⁻² over a climb rate."
    )
    rate_time_s: NonNegativePerAxis = Field(
        description="τ: weight ρ τ² on the squared rate of u - u*; keeps noise out of the command."
    )
    low_pass_rad_s: PerAxis = Field(description="C(s) on the adaptive estimate.")
    sigma_walk: PerAxis = Field(
        description="How quickly the disturbance is reckoned to change.",
        json_schema_extra=unit("m/s² per √s"),
    )
    sigma_bound_m_s2: PerAxis = Field(default=(6.0, 6.0, 4.0), description="Of |σ̂|.")
    climb_rate: VerticalPlusConfig | None = Field(
        default=None,
        description="In place of the above on z, where the thrust field is a climb rate.",
    )
    step_s: Annotated[float, Field(ge=0.01, le=0.1)] = Field(
        default=0.04, description="Step of the plan."
    )
    horizon: Annotated[int, Field(ge=5, le=80)] = Field(
        default=25, description="How many steps a plan looks ahead."
    )
    tilt_rate_limit_rad_s: Annotated[float, Field(gt=0.0, le=8.0)] = Field(
        default=4.0, description="Hard; of the commanded tilt."
    )
    solver: Literal["osqp", "daqp"] = Field(
        default="osqp", description="daqp: exact and quicker; pip install 'companion[daqp]'."
    )
    lag: LagConfig | None = Field(
        default=LagConfig(),
        description="Learning of the attitude's lag in flight; null: it is what was identified.",
    )
    mismatch: MismatchConfig | None = Field(
        default=MismatchConfig(),
        description="Learning of drag, tilt gain and heading in flight; null: they are what was "
        "identified.",
    )
    caution: Annotated[float, Field(gt=0.1, le=1.0)] = Field(
        default=0.6, description="On the bandwidths, in the variant that the monitor falls back to."
    )
