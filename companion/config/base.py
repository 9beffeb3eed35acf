"""What all sections of the configuration have in common."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Vector = Annotated[tuple[float, float, float], Field(strict=False)]
"""Three numbers; the sequence may be a list, which is what YAML has, the numbers are strict."""
Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]
PerAxis = Annotated[tuple[Positive, Positive, Positive], Field(strict=False)]


class Section(BaseModel):
    """Closed, frozen, finite and strict: a quoted number or a `true` for one is a mistake."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)
