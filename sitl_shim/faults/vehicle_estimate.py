"""What faults make of the estimate: it steps, it loses its position, it is told no more."""

from dataclasses import replace
from math import radians

from sitl_shim.autopilot.interface import EstimateStep
from sitl_shim.faults.schema import EstimatorReset
from sitl_shim.frames import Vector3
from sitl_shim.sensors.estimator import Estimate
from sitl_shim.sensors.heading_error import turned

_ZERO: Vector3 = (0.0, 0.0, 0.0)


class EstimateFaults:
    """The offsets that an estimate has, for good, and whether its position is lost."""

    __slots__ = ("_position", "_shifts", "_velocity", "_yaw_rad", "position_lost", "resets")

    def __init__(self) -> None:
        self.resets = 0
        """Announced resets so far, as EKF2 counts them: each of velocity and position, level and
        upright, and heading by itself."""
        self.position_lost = False
        self.forget()

    def forget(self) -> None:
        """The estimator begins anew."""
        self._position = self._velocity = _ZERO
        self._yaw_rad = 0.0
        self._shifts = False
        self.resets = 0

    def step(self, reset: EstimatorReset) -> EstimateStep:
        """Let the estimate step from now on; returns by how much."""
        step = EstimateStep(reset.position_enu_m, reset.velocity_enu_m_s, radians(reset.yaw_deg))
        self._position = _sum(self._position, step.position_enu_m)
        self._velocity = _sum(self._velocity, step.velocity_enu_m_s)
        self._yaw_rad += step.yaw_rad
        self._shifts = True
        if reset.announced:
            self.count(step)
        return step

    def count(self, step: EstimateStep) -> None:
        """An announced reset: the counter goes up for each quantity that stepped, at least once."""
        px, py, pz = step.position_enu_m
        vx, vy, vz = step.velocity_enu_m_s
        stepped = (px or py, pz, vx or vy, vz, step.yaw_rad)
        self.resets += max(1, sum(1 for part in stepped if part))

    def of(self, estimate: Estimate) -> Estimate:
        """The estimate as the autopilot has it."""
        if self._shifts:
            estimate = replace(
                estimate,
                position_enu_m=_sum(estimate.position_enu_m, self._position),
                velocity_enu_m_s=_sum(estimate.velocity_enu_m_s, self._velocity),
            )
            if self._yaw_rad:
                estimate = turned(estimate, self._yaw_rad)
        if self.position_lost:
            estimate = replace(estimate, local_position_valid=False, global_position_valid=False)
        return estimate


def step_between(before: Estimate, after: Estimate) -> EstimateStep:
    """By how much an estimate stepped level, between two ticks; the barometer's height did not."""
    (px, py, _), (vx, vy, _) = before.position_enu_m, before.velocity_enu_m_s
    (qx, qy, _), (wx, wy, _) = after.position_enu_m, after.velocity_enu_m_s
    return EstimateStep((qx - px, qy - py, 0.0), (wx - vx, wy - vy, 0.0), 0.0)


def _sum(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
