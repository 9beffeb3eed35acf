"""Everything that a plan without constraints is and leads to, as one matrix per axis.

The closed form is linear in what is known at a tick, and so are the positions, the velocities and
the second differences that it leads to.  With n = N_h + 1, the data of an axis are

``(y2, y1, r applied last, r before that, y* at k̄ … k̄+n)``,

n + 5 numbers as they come, in the world's coordinates: that the problem is posed about y*(k̄) is
in the matrices.
"""

from dataclasses import dataclass

import numpy as np

from companion.control.qp.condensed import AxisProblem
from companion.control.reference_model import Array

POSITION, VELOCITY, APPLIED, BEFORE, PREVIEW = 0, 1, 2, 3, 4
"""Where in the data what is; the preview goes on to the end."""


@dataclass(frozen=True, slots=True)
class PlanMap:
    """The matrices of one axis; n = N_h + 1."""

    rows: Array
    """(4n, n + 5): the plan, then its positions and velocities at k̄+1 … k̄+n, and its second
    differences."""
    relative: Array
    """(2n + 3, n + 5): what `AxisProblem` is a function of, about y*(k̄)."""


class PlanData:
    """The data of all axes in one array, and views of it to write to; zero at first."""

    __slots__ = (
        "_finite",
        "all",
        "applied",
        "before",
        "columns",
        "position",
        "preview",
        "velocity",
    )

    def __init__(self, axes: int, times: int) -> None:
        """Set up.

        Args:
            axes: each of which has a row.
            times: of the preview, n + 1.
        """
        self.all: Array = np.zeros((axes, PREVIEW + times))
        """(axes, n + 5)."""
        self.columns: Array = self.all[:, :, None]
        """The same as the columns that `PlanMap.rows` are multiplied by."""
        by_time = self.all.T
        self.position, self.velocity = by_time[POSITION], by_time[VELOCITY]
        self.applied, self.before = by_time[APPLIED], by_time[BEFORE]
        self.preview = by_time[PREVIEW:]
        self._finite = np.empty(self.all.shape, dtype=bool)

    def finite(self) -> bool:
        """Whether all of it is."""
        np.isfinite(self.all, self._finite)
        return 0 not in self._finite.tobytes()


def plan_map(problem: AxisProblem, *, penalise_absolute_r: bool) -> PlanMap:
    """Build the matrices.

    Args:
        problem: of the axis.
        penalise_absolute_r: the target of r is 0 (the paper's literal cost), else y*.
    """
    n = problem.hessian.shape[0]
    columns = n + 5
    unit = np.eye(columns)
    centre = unit[PREVIEW]
    desired = unit[PREVIEW:] - centre
    target = np.tile(-centre, (n, 1)) if penalise_absolute_r else desired[:n]
    state = np.stack([unit[POSITION] - centre, unit[VELOCITY]])
    relative = np.vstack([state, unit[APPLIED] - centre, desired[1:], target])
    plan = problem.gain @ relative
    position = problem.position_from_state @ state + problem.position_from_r @ plan
    velocity = problem.velocity_from_state @ state + problem.velocity_from_r @ plan
    second = problem.second_difference @ (plan + centre)
    second[0] += unit[BEFORE] - 2.0 * unit[APPLIED]
    second[1] += unit[APPLIED]
    rows = np.vstack([plan + centre, position + centre, velocity, second])
    return PlanMap(rows, relative)
