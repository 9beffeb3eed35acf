"""What happens to a vehicle at a moment: a load taken up or dropped, a motor that weakens."""

from itertools import pairwise
from math import inf
from typing import Annotated, Literal

from pydantic import Field, model_validator

from sitl_shim.data_file import DataModel

NotNegative = Annotated[float, Field(ge=0.0)]

Since = Literal["boot", "setpoints"]
"""What a time counts from: the vehicle's boot, or the moment at which it first follows a client's
setpoints in flight.  The second is the same stretch of a flight whether that began on the ground
or in the air."""


class Moments:
    """When what a scenario's times count from came about."""

    __slots__ = ("setpoints_s",)

    def __init__(self) -> None:
        self.setpoints_s = inf
        """Simulated time since boot at which setpoints were first followed; infinite before."""

    def time_s(self, event: "Timed") -> float:
        """Simulated time since boot of an event; infinite while it is not known."""
        return event.at_s + (self.setpoints_s if event.since == "setpoints" else 0.0)


class Timed(DataModel):
    """What has a moment."""

    at_s: NotNegative
    """Simulated time."""
    since: Since = "boot"
    """From when on it counts."""


class Load(Timed):
    """The mass that the vehicle carries from a moment on.

    It replaces the load before, and 0 releases it.  Less than 0: a part of the vehicle is gone.
    """

    mass_kg: float | None = None
    """Beside the vehicle's own."""
    mass_share: float | None = None
    """The same as a share of the vehicle's own mass."""

    @model_validator(mode="after")
    def _one_mass(self) -> "Load":
        if (self.mass_kg is None) == (self.mass_share is None):
            raise ValueError("a load has either mass_kg or mass_share")
        return self

    def mass_on(self, vehicle_mass_kg: float) -> float:
        """What it weighs on a vehicle of a mass, kg."""
        if self.mass_kg is not None:
            return self.mass_kg
        return (self.mass_share or 0.0) * vehicle_mass_kg

    @property
    def mass_key(self) -> str:
        """Of the two keys the one that it has."""
        return "mass_share" if self.mass_kg is None else "mass_kg"


class Motor(Timed):
    """One motor's thrust from a moment on."""

    rotor: Annotated[int, Field(ge=1, le=4)]
    """1 front right, 2 rear left, 3 front left, 4 rear right: the order of the vehicle's file."""
    thrust_factor: Annotated[float, Field(ge=0.0, le=1.0)]
    """Of the thrust that the motor's command would give; 1 is a sound motor."""


def check_order(events: "tuple[Timed, ...]", *, at_once: bool) -> None:
    """Refuse events that are not in the order in which they happen.

    Args:
        events: of one list of a scenario.
        at_once: whether two of them may have the same time.

    Raises:
        ValueError: times fall, or what counts from the boot comes after what does not.
    """
    for earlier, later in pairwise(events):
        if (earlier.since, later.since) == ("setpoints", "boot"):
            raise ValueError("what counts since boot comes before what counts since setpoints")
        if earlier.since != later.since:
            continue
        if later.at_s < earlier.at_s or (later.at_s == earlier.at_s and not at_once):
            raise ValueError(
                f"the times at_s must rise, and {later.at_s:g} s comes after {earlier.at_s:g} s"
            )
