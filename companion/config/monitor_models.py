"""What a mission says about the in-flight monitor, and about hand-overs that are planned."""

import re
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from companion.config.base import NonNegative, Positive, Section

L1_OFF, L1_ON = "l1-off", "l1-on"
_SWITCH = re.compile(r"t=(?P<at_s>[-+0-9.eE]+):(?P<to>.+)")


class MonitorConfig(Section):
    """The in-flight monitor's bounds (docs/monitor.md)."""

    act: bool = Field(
        default=True,
        description="Go down the ladder of controllers by it; false: it only shows and warns.",
    )
    smoothing_s: Positive = Field(
        default=0.4, description="Time constant of the means that the bounds are held against."
    )
    y_tilde_share: Positive = Field(default=1.0, description="Of the controller's bound of |ỹ|.")
    sigma_share: Annotated[float, Field(gt=0.0, le=1.0)] = Field(
        default=0.95, description="Of the projection's bound of |σ̂|."
    )
    slew_floor_rad_s: Positive = Field(
        default=1.3, description="Rms rate of the commanded tilt that is always well."
    )
    slew_per_noise: NonNegative = Field(
        default=6.0,
        description="To this, times the vehicle's unexplained acceleration (`noise`, per √Hz).",
    )
    slew_factor: NonNegative = Field(
        default=1.5, description="To this, of the rate that the trajectory itself asks for."
    )
    delay_margin_s: Positive = Field(
        default=0.05, description="Over the loop delay that the vehicle's file states."
    )
    severe: Annotated[float, Field(gt=1.0)] = Field(
        default=1.6, description="Times its bound: straight to the last controller."
    )
    calm: Annotated[float, Field(gt=0.0, lt=1.0)] = Field(
        default=0.75, description="Times its bound, all of them: calm enough for the way up."
    )
    alarm_after_s: NonNegative = Field(
        default=0.15, description="Above a bound for this long: down to the next controller."
    )
    ascend_after_s: Annotated[float, Field(ge=1.0)] = Field(
        default=5.0, description="Calm for this long: up to the one before."
    )
    ascents: Annotated[int, Field(ge=0, le=10)] = Field(
        default=2, description="Ways back up in a flight, at most."
    )


class SwitchConfig(Section):
    """A hand-over that is planned."""

    at_s: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = Field(
        description="Since the trajectory's start.", examples=[8.0]
    )
    to: Annotated[str, Field(min_length=1)] = Field(
        description="A controller's name or YAML file, or l1-off, l1-on.", examples=["mpc-l1"]
    )

    @property
    def controller(self) -> str | None:
        """The controller that it names; None if it is about the adaptation."""
        return None if self.to in (L1_OFF, L1_ON) else self.to


def _from_text(value: Any) -> Any:  # noqa: ANN401 - whatever a file says
    """``t=8:mpc-l1`` as the command line has it, as a section."""
    if not isinstance(value, str):
        return value
    match = _SWITCH.fullmatch(value)
    try:
        at_s = float(match["at_s"]) if match else None
    except ValueError:
        at_s = None
    if match is None or at_s is None:
        raise ValueError("a hand-over reads t=SECONDS:CONTROLLER, for instance t=8:mpc-l1")
    if at_s < 0.0:
        raise ValueError(
            f"t={match['at_s']} is before the trajectory's start, from which t counts. Give 0 or "
            "more, or fly that controller from the beginning with --controller."
        )
    return {"at_s": at_s, "to": match["to"]}


Switch = Annotated[
    SwitchConfig, BeforeValidator(_from_text, json_schema_input_type=str | SwitchConfig)
]
Switches = Annotated[tuple[Switch, ...], Field(strict=False)]
