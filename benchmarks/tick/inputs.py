"""The recorded inputs of the ticks, as they are kept in benchmarks/data."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from companion.control.reference_model import Array

FOLDER = Path(__file__).resolve().parents[1] / "data"
SETS = ("std", "hard")
"""20-30 % of the ticks with an active constraint, and nearly all of them.

By these names at N_h 30, 480 ticks of each flight; as ``std-60`` the 96 in their middle, at N_h 60.
"""
HORIZONS = (10, 20, 30, 40, 60, 80)


@dataclass(frozen=True, slots=True)
class Recording:
    """Inputs of receding-horizon ticks; ENU, m and m/s."""

    r_max_m_s2: float
    position_m: Array
    """(ticks, 3) as measured."""
    velocity_m_s: Array
    previous_m: Array
    """(ticks, 3) reference that was applied last."""
    before_m: Array
    """(ticks, 3) the one before."""
    number: NDArray[np.int64]
    """(ticks,) of the tick among those that were flown, one flight after the other."""
    index: NDArray[np.int64]
    """(ticks,) where in `path_m` the tick's desired position is."""
    path_m: Array
    """Desired positions, one flight after the other, each longer than its ticks by a preview."""


def read_recording(name: str) -> Recording:
    """Read a set by its name."""
    with np.load(FOLDER / f"{name}.npz", allow_pickle=False) as kept:
        return Recording(
            float(kept["r_max_m_s2"]),
            *(kept[key].astype(float) for key in ("position_m", "velocity_m_s")),
            *(kept[key].astype(float) for key in ("previous_m", "before_m")),
            kept["number"].astype(int),
            kept["index"].astype(int),
            kept["path_m"].astype(float),
        )


def write_recording(name: str, recording: Recording) -> None:
    """Write a set; micrometres are what single precision keeps of a few metres."""
    FOLDER.mkdir(exist_ok=True)
    np.savez_compressed(
        FOLDER / f"{name}.npz",
        r_max_m_s2=recording.r_max_m_s2,
        number=recording.number.astype(np.int16),
        index=recording.index.astype(np.int32),
        **{
            key: getattr(recording, key).astype(np.float32)
            for key in ("position_m", "velocity_m_s", "previous_m", "before_m", "path_m")
        },
    )
