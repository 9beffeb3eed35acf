"""How much is flown: the whole study, or a quick look."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Scale:
    """What a run of the study flies."""

    name: str
    seeds: tuple[int, ...]
    """Of each controller on each trajectory in each wind."""
    adaptation_rates: tuple[float, ...]
    """Γ of the sweep, 1/s²."""
    origin_trajectories: tuple[int, ...]
    """Flown about a moved origin too."""
    mpc_ticks: int
    """Plans over which the computing times are measured."""


FULL = Scale(
    "full",
    seeds=(1, 2, 3, 4, 5),
    adaptation_rates=(
        50.0,
        100.0,
        150.0,
        200.0,
        300.0,
        400.0,
        500.0,
        700.0,
        1000.0,
        1400.0,
        2000.0,
    ),
    origin_trajectories=(1, 2, 3, 4, 5),
    mpc_ticks=300,
)
QUICK = Scale(
    "quick",
    seeds=(1,),
    adaptation_rates=(100.0, 300.0, 500.0, 1000.0),
    origin_trajectories=(4,),
    mpc_ticks=30,
)

VEHICLE = "bebop2"
TRAJECTORIES = (1, 2, 3, 4, 5)
VELOCITY_NOISE_M_S = 0.015
"""Standard deviation of that vehicle's measured velocity, by motion capture."""
