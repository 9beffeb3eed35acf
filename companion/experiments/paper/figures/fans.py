"""Where the fans of the scenarios stand."""

from dataclasses import dataclass

import numpy as np
import yaml

from companion.config.resolve import configs_folder
from companion.report.flight_data import Array


@dataclass(frozen=True, slots=True)
class Fan:
    """A jet across a path; ENU, metres."""

    stands_m: Array
    crosses_m: Array
    """Where its axis meets the path."""
    width_m: float
    """σ of its profile across."""


def fan_of(trajectory: int) -> Fan | None:
    """The fan that blows across a trajectory; None if no scenario has one."""
    path = configs_folder() / "scenarios" / f"fan-{trajectory}.yaml"
    try:
        winds = yaml.safe_load(path.read_text(encoding="utf-8"))["winds"]
    except (OSError, KeyError, TypeError, yaml.YAMLError):
        return None
    jet = next((wind for wind in winds if wind.get("kind") == "jet"), None)
    if jet is None:
        return None
    crosses = np.array(jet["crossing_enu_m"], float)
    along = np.array(jet["direction_enu"], float)
    along /= np.linalg.norm(along)
    return Fan(crosses - float(jet["fan_distance_m"]) * along, crosses, float(jet["width_m"]))
