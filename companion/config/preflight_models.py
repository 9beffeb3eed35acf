"""What a mission says about the checks before a flight."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from companion.config.base import Section

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class PreflightConfig(Section):
    """The checks before a flight."""

    fix: bool = Field(
        default=False,
        description="Set the parameters that the check would have otherwise; restored after "
        "landing.",
    )
    battery_refuse_below: Share = Field(
        default=0.15, description="A flight is refused with less of the charge, as a share of 1."
    )
    battery_warn_below: Share = Field(default=0.35, description="The same, for a warning.")
    thrust_field: Literal["any", "thrust", "climb_rate"] = Field(
        default="any", description="What the autopilot's thrust field must mean."
    )
    accept: Annotated[tuple[str, ...], Field(strict=False)] = Field(
        default=(),
        description="Subjects of findings that refuse no flight, by the names that the check "
        "tells; they warn.",
        examples=[["battery"]],
    )

    @model_validator(mode="after")
    def _in_order(self) -> "PreflightConfig":
        if self.battery_refuse_below > self.battery_warn_below:
            raise ValueError("battery_refuse_below must not be above battery_warn_below")
        return self
