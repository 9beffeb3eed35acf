"""The section `l1:` of a controller's file."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from companion.config.base import PerAxis, Positive, Section
from companion.config.units import unit


class TransferFunctionConfig(Section):
    """A strictly proper transfer function; coefficients in descending powers of s."""

    numerator: Annotated[tuple[float, ...], Field(strict=False, min_length=1)] = Field(
        description="Coefficients, that of the highest power of s first."
    )
    denominator: Annotated[tuple[float, ...], Field(strict=False, min_length=2)] = Field(
        description="The same; of a higher order than the numerator."
    )


TransferFunctions = Annotated[
    tuple[TransferFunctionConfig, TransferFunctionConfig, TransferFunctionConfig],
    Field(strict=False),
]


class ClimbRateGains(Section):
    """L1 gains of the vertical axis."""

    m: Positive = Field(description="Bandwidth of M(s).", json_schema_extra=unit("1/s"))
    omega: Positive = Field(description="Bandwidth of C(s).", json_schema_extra=unit("rad/s"))
    k: Positive = Field(description="Gain K of the position loop.", json_schema_extra=unit("1/s"))
    gamma: Positive = Field(description="Adaptation rate Γ.", json_schema_extra=unit("1/s²"))
    sigma_bound: Positive = Field(
        description="Bound of |σ̂|, in the unit of u: a climb rate.", json_schema_extra=unit("m/s")
    )


class L1Config(Section):
    """Gains of the L1 controller, per axis (x, y, z)."""

    m: PerAxis | None = Field(
        default=None,
        description="Bandwidth of the reference model M(s) = m / (s + m).",
        json_schema_extra=unit("1/s"),
    )
    reference_model: TransferFunctions | None = Field(
        default=None, description="M(s) in place of m; strictly positive real, of gain 1."
    )
    omega: PerAxis | None = Field(
        default=None,
        description="Bandwidth of the low-pass filter C(s) = ω / (s + ω).",
        json_schema_extra=unit("rad/s"),
    )
    low_pass: TransferFunctions | None = Field(
        default=None, description="C(s) in place of omega; stable, C(0) = 1."
    )
    k: PerAxis = Field(
        description="Proportional gain K of the position loop.", json_schema_extra=unit("1/s")
    )
    gamma: PerAxis = Field(description="Adaptation rate Γ.", json_schema_extra=unit("1/s²"))
    sigma_bound: PerAxis = Field(
        default=(8.0, 8.0, 8.0),
        description="Bound of the adaptive estimate |σ̂|, in the unit of u; it must cover the "
        "disturbance.",
    )
    projection_margin: Annotated[float, Field(gt=0.0, le=1.0)] = Field(
        default=0.1, description="Share of the bound over which the projection brakes the estimate."
    )
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
