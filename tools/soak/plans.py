"""Which flights a soak flies."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count, cycle

AUTOPILOTS = ("px4", "ardupilot")
_WINDS = ("calm", "fan", "gusts", "calm", "wind3")
"""For the five trajectories; turned on by one with each round."""
_FAULTS = "bad-link"
_FAULTY_PLACE = 7
"""Which flight of a round has faults."""
ROUND = 10
"""Flights in a round: each trajectory on each flavour."""


@dataclass(frozen=True, slots=True)
class FlightPlan:
    """One flight."""

    autopilot: str
    trajectory: int | str
    """1 … 5, or a file."""
    wind: str = "calm"
    seed: int = 1
    controller: str | None = None
    """None: the default."""
    faults: str | None = None

    @property
    def options(self) -> dict[str, object]:
        """As a mission has them."""
        options: dict[str, object] = {
            "autopilot": self.autopilot,
            "trajectory": self.trajectory,
            "wind": self.wind,
            "seed": self.seed,
            "controller": self.controller,
            "faults": self.faults,
        }
        return {name: value for name, value in options.items() if value is not None}


def rounds(autopilot: str | None, controller: str | None) -> Iterator[FlightPlan]:
    """Flights without end: in rounds of ten, all different, one of each round with faults.

    Args:
        autopilot: one flavour only; None: both in turn.
        controller: None: the default.
    """
    flavours = cycle(AUTOPILOTS if autopilot is None else (autopilot,))
    for number in count():
        place, lap = number % ROUND, number // ROUND
        faulty = place == _FAULTY_PLACE
        yield FlightPlan(
            next(flavours),
            1 + place // 2,
            "calm" if faulty else _WINDS[(place // 2 + lap) % len(_WINDS)],
            seed=1 + number,
            controller=controller,
            faults=_FAULTS if faulty else None,
        )
