"""The parts of a recording, by the names that the flight gave them."""

import numpy as np
import numpy.typing as npt

from companion.identification.estimates import UnidentifiedError
from companion.identification.recording import Recording

Rows = npt.NDArray[np.intp]

_LEAST_SAMPLES = 100
_LARGEST_GAP_S = 0.3
_WHOLE = 50
_ORDER = ("hover", "roll", "pitch", "thrust", "climb", "swing")
"""In which they are flown."""


def require(recording: Recording, name: str) -> Rows:
    """Rows of a part that must be there.

    Raises:
        UnidentifiedError: it is not, or is too short.
    """
    rows = np.flatnonzero(recording.segment == name)
    if len(rows) < _LEAST_SAMPLES:
        raise UnidentifiedError(
            f"the recording has {len(rows)} samples of the part '{name}', and at least "
            f"{_LEAST_SAMPLES} are needed: {_why(recording, name)}"
        )
    return rows


def _why(recording: Recording, name: str) -> str:
    """Why a part is too short, and what to do about it."""
    left = [why for part, why in recording.left if part == name]
    if left:
        return f"{'; '.join(left)}. Fly it again"
    later = _ORDER[_ORDER.index(name) + 1 :] if name in _ORDER else ()
    if np.isin(recording.segment, later).any():
        return "it was left early, or missed, though the flight went on. Fly it again"
    return "the flight was ended early. Fly it to its end"


def stretches(recording: Recording, name: str) -> list[Rows]:
    """Runs of rows of a part without a break, those that are long enough to tell anything."""
    rows = np.flatnonzero(recording.segment == name)
    if len(rows) == 0:
        return []
    breaks = (np.diff(rows) > 1) | (np.diff(recording.time_s[rows]) > _LARGEST_GAP_S)
    runs = np.split(rows, np.flatnonzero(breaks) + 1)
    return [run for run in runs if len(run) >= _LEAST_SAMPLES // 2]


def thinned(runs: list[Rows], most: int) -> list[Rows]:
    """Every second, third, … row of each run, so that about `most` are left in all.

    The first rows of each are left whole: what is white shows from sample to sample, and what
    wanders from second to second.
    """
    total = sum(len(run) for run in runs)
    every = max(1, -(-total // most))
    return [np.union1d(run[:_WHOLE], run[::every]) for run in runs]
