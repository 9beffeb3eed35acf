"""What a campaign's file may say."""

from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from companion.config.base import Section
from companion.config.units import written

MOST_FLIGHTS = 1_000_000

Value = str | bool | int | float | dict[str, Any] | None
"""A choice as YAML has it; keys stand for faults, null for none."""


def _said(sentence: str) -> WrapValidator:
    """One sentence in the place of one for each kind of value, or of a pattern."""

    def validate(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:  # noqa: ANN401
        try:
            return handler(value)
        except ValidationError as error:
            raise ValueError(sentence) from error

    return WrapValidator(validate)


def _not_empty(values: tuple[Value, ...]) -> tuple[Value, ...]:
    if not values:
        raise ValueError("give one value at least")
    return values


_Choice = Annotated[
    Value, _said("a name, a number, true or false, or keys with values are expected")
]
_Setting = Annotated[
    Value | list[Any],
    _said("a name, a number, true or false, a list, or keys with values are expected"),
]
_Name = Annotated[
    str,
    Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"),
    _said("letters (a to z), digits, '-', '_' and '.' are expected, a letter or digit first"),
]
Values = Annotated[tuple[_Choice, ...], Field(strict=False), AfterValidator(_not_empty)]
Method = Literal["grid", "latin-hypercube", "sobol"]


def _or_list(schema: dict[str, Any]) -> None:
    """Tell an editor that a list of choices may stand in the section's place."""
    section = dict(schema)
    schema.clear()
    schema["anyOf"] = [{"type": "array", "minItems": 1}, section]


class ParameterConfig(Section):
    """What varies: a list of choices, or a range from low to high."""

    model_config = ConfigDict(json_schema_extra=_or_list)

    values: Values | None = Field(
        default=None,
        description="The choices; a list in the parameter's place says the same.",
        json_schema_extra=written("list of values"),
    )
    low: float | None = Field(default=None, description="Lower end of a range, itself included.")
    high: float | None = Field(default=None, description="Upper end of a range.")
    log: bool = Field(default=False, description="Evenly spread in the logarithm.")
    integer: bool = Field(default=False, description="Whole numbers alone, both ends included.")
    steps: Annotated[int, Field(ge=2, le=100_000)] | None = Field(
        default=None, description="How many values a grid takes of the range, its ends included."
    )
    unit: str | None = Field(default=None, description="For a person.")

    @model_validator(mode="before")
    @classmethod
    def _list_is_choices(cls, given: object) -> object:
        return {"values": given} if isinstance(given, list) else given

    @model_validator(mode="after")
    def _choices_or_range(self) -> "ParameterConfig":
        ends = (self.low, self.high)
        if (self.values is None) == (ends == (None, None)):
            raise ValueError("give a list of choices, or `low` and `high`, and not both")
        if self.values is not None:
            if self.log or self.integer or self.steps is not None:
                raise ValueError("log, integer and steps belong to a range (low, high)")
            return self
        low, high = ends
        if low is None or high is None or not low < high:
            raise ValueError("a range needs low < high")
        if self.log and low <= 0.0:
            raise ValueError("a logarithmic range must lie above 0")
        if self.log and self.integer:
            raise ValueError("a range of whole numbers can't be logarithmic; give one of the two")
        if self.integer and not (low.is_integer() and high.is_integer()):
            raise ValueError("a range of whole numbers needs whole numbers as its ends")
        return self


class SampleConfig(Section):
    """How points are taken from the parameters' ranges."""

    method: Method = Field(
        description="How points are spread over the ranges: every combination, or a sample "
        "without gaps."
    )
    points: Annotated[int, Field(ge=1, le=MOST_FLIGHTS)] | None = Field(
        default=None, description="How many; of a grid its lists and steps decide."
    )
    seed: Annotated[int, Field(ge=0)] = Field(default=1, description="Of the sampling.")

    @model_validator(mode="after")
    def _points_are_asked_for_once(self) -> "SampleConfig":
        if self.method == "grid" and self.points is not None:
            raise ValueError("a grid has as many points as its lists and steps give. Remove points")
        if self.method != "grid" and self.points is None:
            raise ValueError(f"a {self.method} sample needs to know how many points. Add points")
        return self


class BaseConfig(Section):
    """The flight that all others differ from by their parameters alone."""

    controller: str = Field(default="mpc-l1", description="By name, or a YAML file.")
    trajectory: int | str = Field(
        default=4,
        description="1 line, 2 circle, 3 tilted ellipse, 4 figure-eight, 5 rose; or a CSV or YAML "
        "file.",
        json_schema_extra=written("1 … 5, or a file's name"),
    )
    wind: str = Field(
        default="calm",
        description="A scenario by name (fan: that of the trajectory), or a YAML file.",
    )
    vehicle: str = Field(default="bebop2", description="By name, or a YAML file.")
    autopilot: Literal["auto", "px4", "ardupilot"] = Field(
        default="auto", description="Which the embedded shim is; auto is px4."
    )
    faults: str | dict[str, Any] | None = Field(
        default=None,
        description="What goes wrong on purpose: by name, a YAML file, or keys.",
        examples=["bad-link"],
    )
    sensors: str | None = Field(
        default=None,
        description="A sensor profile in place of the vehicle's own, by name or a YAML file.",
        examples=["mocap"],
    )
    seed: Annotated[int, Field(ge=0)] = Field(default=1, description="Of all noise of a flight.")
    flights: Literal["airborne", "whole"] = Field(
        default="airborne",
        description="airborne: the trajectory alone, beginning and ending in the air; whole: from "
        "take-off to landing.",
    )
    settings: dict[str, _Setting] = Field(
        default={},
        description="Keys as --set takes them (controller.mpc.horizon), with values.",
        json_schema_extra=written("keys with values"),
    )


class CampaignConfig(Section):
    """A campaign."""

    name: _Name = Field(description="Of its folder, too: letters, digits, '-', '_' and '.'.")
    says: str | None = Field(default=None, description="What it is for; for a person.")
    engine: Literal["flights", "batched"] = Field(
        default="flights",
        description="flights: each through the whole program in lockstep; batched: thousands of "
        "simplified vehicles at once.",
    )
    keep: Literal["flights", "figures"] = Field(
        default="flights", description="Each flight's data as a file, or its row of figures alone."
    )
    base: BaseConfig = Field(
        default=BaseConfig(),
        description="The flight that all others differ from by their parameters alone.",
    )
    sample: SampleConfig = Field(description="How points are taken from the parameters' ranges.")
    parameters: Annotated[dict[str, ParameterConfig], Field(min_length=1)] = Field(
        description="What varies, by name: plant.mass and other keys of the plant, wind, "
        "trajectory, seed, or a key as --set takes it; each with a list of choices, or a range "
        "from low to high (docs/campaigns.md)."
    )
    each: dict[str, Values] = Field(
        default={},
        description="Choices each of which is flown at every point: controllers compared in the "
        "same conditions.",
        json_schema_extra=written("keys with lists of values"),
    )
    seeds: Annotated[int, Field(ge=1, le=10_000)] | None = Field(
        default=None, description="Every point is flown with the seeds 1 … this many."
    )
