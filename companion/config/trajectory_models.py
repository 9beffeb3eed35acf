"""What a trajectory's YAML file may say, for its JSON Schema and the reference.

It is read by `companion.trajectories.from_file`, which knows no other room; a test holds the two
together.
"""

from typing import Annotated

from pydantic import Field

from companion.config.base import Section
from companion.config.units import written

_Coordinate = Annotated[float, Field(ge=-10_000.0, le=10_000.0)]
Point = Annotated[
    tuple[float, _Coordinate, _Coordinate, _Coordinate],
    Field(strict=False, description="[t, x, y, z]: s, m, m, m; x east, y north, z up."),
]


class TrajectoryConfig(Section):
    """Timed points, joined by a smooth curve that starts and ends at rest."""

    name: str | None = Field(
        default=None, description="For a person; by default the file's name without its suffix."
    )
    points: Annotated[tuple[Point, ...], Field(strict=False, min_length=2)] = Field(
        description="A list of [t, x, y, z]: seconds, which rise by 10 ms at least, and metres; x "
        "east, y north, z up, from where the mission puts the trajectory.",
        json_schema_extra=written("list of [t, x, y, z], 2 at least"),
    )
