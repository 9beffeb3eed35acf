"""What comes of each vehicle of a batch."""

import math

import numpy as np
from numpy.typing import NDArray

from companion.control.reference_model import Array
from companion.experiments.batched.task import Vehicle
from companion.experiments.flight_store import Summary


class Score:
    """Adds up; (vehicles,) each."""

    def __init__(self, scored_s: Array, hover_s: float) -> None:
        """Begin.

        Args:
            scored_s: how long each vehicle's tracking is scored, after the hover.
            hover_s: how long it is not.
        """
        count = len(scored_s)
        self._scored_s, self._hover_s = scored_s, hover_s
        self.lost = np.zeros(count, dtype=bool)
        self._notes = [""] * count
        self._flown_s = np.zeros(count)
        self._steps, self._samples, self._slews = (np.zeros(count) for _ in "123")
        self._sum, self._square, self._most, self._height = (np.zeros(count) for _ in "1234")
        self._reported, self._wind, self._slew = (np.zeros(count) for _ in "123")
        self._u: Array | None = None

    def lose(self, which: NDArray[np.bool_], why: str) -> None:
        """Give vehicles up."""
        for k in np.flatnonzero(which & ~self.lost):
            self._notes[k] = why
        self.lost = self.lost | which

    def step(self, time_s: float, position_m: Array, desired_m: Array, wind_m_s2: Array) -> None:
        """The truth at a step of the plant."""
        if time_s < self._hover_s - 1e-9:
            return
        scored = self._scored(time_s)
        off = position_m - desired_m
        square = np.where(scored, (off * off).sum(axis=0), 0.0)
        error = np.sqrt(square)
        self._sum += error
        self._square += square
        self._steps += scored
        np.maximum(self._most, error, out=self._most)
        np.maximum(self._height, np.where(scored, np.abs(off[2]), 0.0), out=self._height)
        np.maximum(self._wind, np.where(scored, wind_m_s2, 0.0), out=self._wind)
        self._flown_s[scored] = round(time_s - self._hover_s, 6)

    def sample(
        self, time_s: float, position_m: Array, desired_m: Array, u: Array, dt_s: float
    ) -> None:
        """What the companion sees, and u as it was applied."""
        scored = self._scored(time_s)
        error = np.sqrt(((position_m - desired_m) ** 2).sum(axis=0))
        self._reported += np.where(scored, error, 0.0)
        self._samples += scored
        if self._u is not None and time_s > self._hover_s:
            rate = ((u[:2] - self._u[:2]) ** 2).sum(axis=0) / dt_s**2
            self._slew += np.where(scored, rate, 0.0)
            self._slews += scored
        self._u = u

    def row(
        self, k: int, vehicle: Vehicle, r_max_share: float, fallbacks: int, wall_s: float
    ) -> Summary:
        """A vehicle's row."""
        task = vehicle.task
        if vehicle.problems:
            refusal = "\n".join(vehicle.problems)
            return Summary(task.key, task.flight, "refused", refusal, flown_s=0.0, wall_s=wall_s)
        lost, scored_s = bool(self.lost[k]), float(self._scored_s[k])
        steps, samples = max(1.0, self._steps[k]), max(1.0, self._samples[k])
        return Summary(
            key=task.key,
            task=task.flight,
            outcome="aborted" if lost else "tracked",
            note=f"Batched study: {self._notes[k]}." if lost else "",
            mean_error_m=math.inf if lost else float(self._sum[k] / steps),
            rms_error_m=math.inf if lost else math.sqrt(self._square[k] / steps),
            max_error_m=math.inf if lost else float(self._most[k]),
            reported_mean_error_m=math.inf if lost else float(self._reported[k] / samples),
            peak_height_error_m=float(self._height[k]),
            flown_s=float(self._flown_s[k]),
            scored_s=scored_s,
            fallbacks=fallbacks,
            r_max_share=r_max_share,
            wind_peak_m_s2=float(self._wind[k]),
            tilt_slew_rms_g_s=math.sqrt(self._slew[k] / max(1.0, self._slews[k])),
            wall_s=wall_s,
        )

    def _scored(self, time_s: float) -> NDArray[np.bool_]:
        scored: NDArray[np.bool_] = ~self.lost & (
            (time_s >= self._hover_s - 1e-9) & (time_s - self._hover_s <= self._scored_s + 1e-9)
        )
        return scored
