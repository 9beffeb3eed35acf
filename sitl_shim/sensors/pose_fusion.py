"""Fusion of poses from outside with the inertial sensors, as PX4's EKF2 does it in effect.

Per axis a position, a velocity and an error of the acceleration (what tilt error and accelerometer
bias make together) are carried on by the measured acceleration and corrected by each pose, with
the steady Kalman gains of PX4's default noise figures.  A pose is compared with what was estimated
at its own time, so that a late pose costs accuracy but no bias.  Yaw is corrected in the same way.

Sources: EKF2's parameters (docs.px4.io/main/en/advanced_config/parameter_reference.html, EKF2_*),
and how it starts, stops, resets and gives up (docs.px4.io/main/en/advanced_config/
tuning_the_ecl_ekf.html).
"""

from collections import deque
from math import cos, isfinite, sin, sqrt

from sitl_shim.frames import (
    Vector3,
    euler_from_quaternion,
    wrap_angle_rad,
)
from sitl_shim.sensors.aiding import Aiding, ExternalPose

_ACCELERATION_NOISE_M_S2 = 0.35
"""EKF2_ACC_NOISE's default, new in each of its steps."""
_GYRO_NOISE_RAD_S = 0.015
"""EKF2_GYR_NOISE's default, new in each of its steps."""
_FILTER_STEP_S = 0.01
_GRAVITY_M_S2 = 9.80665
_LONGEST_INTERVAL_S = 0.2
"""Poses farther apart do not start the fusion; twice this without one ends it."""
_REMEMBERED = 64
"""Estimates kept to compare late poses with: 0.25 s, a little more than EKF2_DELAY_MAX."""
_GATE = 5.0
"""In standard deviations of the innovation: EKF2_EVP_GATE's default."""
_GIVES_IN_AFTER_S = 1.0
"""After this long of nothing but rejected poses the estimate is set to what they say."""


class PoseFusion:
    """Horizontal position, height and yaw of one estimator, as far as poses give them.

    All positions are in the frame of the poses, which becomes the autopilot's local frame.
    """

    __slots__ = (
        "_acceleration_error",
        "_fused_s",
        "_gains",
        "_gains_key",
        "_past",
        "_previous",
        "_taken_s",
        "_yaw_gain",
        "fusing",
        "position",
        "resets",
        "started",
        "velocity",
        "yaw_correction_rad",
    )

    def __init__(self) -> None:
        self.position: Vector3 = (0.0, 0.0, 0.0)
        """ENU m."""
        self.velocity: Vector3 = (0.0, 0.0, 0.0)
        """ENU m/s."""
        self.yaw_correction_rad = 0.0
        """What is added to the heading that the inertial sensors keep."""
        self.started = False
        """Whether any pose was ever fused."""
        self.fusing = False
        """Whether poses come and are fused."""
        self.resets = 0
        """How often the estimate was set to a pose."""
        self._acceleration_error: Vector3 = (0.0, 0.0, 0.0)
        self._previous: ExternalPose | None = None
        self._taken_s = -1e9
        self._fused_s = -1e9
        self._past: deque[tuple[float, Vector3, float]] = deque(maxlen=_REMEMBERED)
        self._gains = (0.0, 0.0, 0.0)
        self._gains_key = (0.0, 0.0)
        self._yaw_gain = 0.0

    def valid(self, now_s: float, lost_after_s: float) -> bool:
        """Whether the position may still be believed."""
        return self.started and now_s - self._fused_s <= lost_after_s

    def begin(self, position: Vector3, velocity: Vector3, now_s: float, *, valid: bool) -> None:
        """Go on from another estimate, which was being corrected until now if `valid`."""
        self.position, self.velocity = position, velocity
        self._acceleration_error = (0.0, 0.0, 0.0)
        self.yaw_correction_rad = 0.0
        self.fusing = False
        self.started = valid
        self._fused_s = now_s
        self._past.clear()

    def hold(self) -> None:
        """A vehicle that stands still knows it: nothing moves but by poses."""
        self.velocity = (0.0, 0.0, 0.0)

    def predict(self, now_s: float, step_s: float, acceleration: Vector3, heading: float) -> None:
        """Carry the estimate on by one step.

        Args:
            now_s: time at the end of the step.
            step_s: its length.
            acceleration: measured, turned into the world by the estimated attitude, m/s².
            heading: that the inertial sensors keep, without the correction, rad.
        """
        (x, y, z), (u, v, w) = self.position, self.velocity
        a, b, c = acceleration
        ea, eb, ec = self._acceleration_error
        u, v, w = u + (a - ea) * step_s, v + (b - eb) * step_s, w + (c - ec) * step_s
        self.velocity = (u, v, w)
        self.position = (x + u * step_s, y + v * step_s, z + w * step_s)
        self._past.append((now_s, self.position, heading))
        if self.fusing and now_s - self._taken_s > 2.0 * _LONGEST_INTERVAL_S:
            self.fusing = False

    def take(self, pose: ExternalPose, aiding: Aiding, now_s: float) -> None:
        """Fuse a pose, or start with it, or drop it."""
        if not _usable(pose, aiding):
            return
        time_s = pose.time_s - aiding.pose_delay_s
        previous, self._previous = self._previous, pose
        interval_s = now_s - self._taken_s
        self._taken_s = now_s
        then = self._then(time_s)
        if previous is None or then is None:
            return
        heading = then[2]
        if not self.fusing:
            if interval_s > _LONGEST_INTERVAL_S:
                return
            self.fusing = True
            if now_s - self._fused_s > _GIVES_IN_AFTER_S:
                self.velocity = self._velocity_between(previous, pose, aiding, heading)
            self._set_to(pose, aiding, then, now_s)
            return
        if pose.reset_counter != previous.reset_counter:
            self._set_to(pose, aiding, then, now_s)
            return
        self._correct(pose, aiding, then[1], heading, min(interval_s, _LONGEST_INTERVAL_S), now_s)

    def _then(self, time_s: float) -> tuple[float, Vector3, float] | None:
        """The estimate at a time; None if that is forgotten.  The future counts as now."""
        past = self._past
        if not past or time_s < past[0][0] - 0.004:
            return None
        for entry in reversed(past):
            if entry[0] <= time_s + 0.002:
                return entry
        return past[0]

    def _set_to(
        self,
        pose: ExternalPose,
        aiding: Aiding,
        then: tuple[float, Vector3, float],
        now_s: float,
    ) -> None:
        """Start anew from a pose, keeping what has been flown since it was taken."""
        if aiding.pose_yaw:
            yaw = euler_from_quaternion(pose.attitude_flu_to_enu)[2]
            self.yaw_correction_rad = wrap_angle_rad(yaw - then[2])
        measured = self._in_our_frame(pose, aiding, then[2])
        moved = self.position
        self.position = (
            measured[0] + moved[0] - then[1][0],
            measured[1] + moved[1] - then[1][1],
            measured[2] + moved[2] - then[1][2],
        )
        shift = (measured[0] - then[1][0], measured[1] - then[1][1], measured[2] - then[1][2])
        self._past = deque(
            (
                (t, (x + shift[0], y + shift[1], z + shift[2]), heading)
                for t, (x, y, z), heading in self._past
            ),
            maxlen=_REMEMBERED,
        )
        self.started = True
        self.resets += 1
        self._fused_s = now_s

    def _velocity_between(
        self, before: ExternalPose, after: ExternalPose, aiding: Aiding, heading: float
    ) -> Vector3:
        """How fast the vehicle moves, by two poses: what the filter had grown sure of is gone."""
        passed_s = after.time_s - before.time_s
        if passed_s < 1e-3:
            return (0.0, 0.0, 0.0)
        x, y, z = self._in_our_frame(before, aiding, heading)
        u, v, w = self._in_our_frame(after, aiding, heading)
        return ((u - x) / passed_s, (v - y) / passed_s, (w - z) / passed_s)

    def _in_our_frame(self, pose: ExternalPose, aiding: Aiding, heading: float) -> Vector3:
        """Its position; turned by the headings' difference if its yaw is not to be believed."""
        if aiding.pose_yaw or not pose.heading_is_arbitrary:
            return pose.position_enu_m
        yaw = euler_from_quaternion(pose.attitude_flu_to_enu)[2]
        angle = heading + self.yaw_correction_rad - yaw
        c, s = cos(angle), sin(angle)
        x, y, z = pose.position_enu_m
        return (c * x - s * y, s * x + c * y, z)

    def _correct(
        self,
        pose: ExternalPose,
        aiding: Aiding,
        expected: Vector3,
        heading: float,
        interval_s: float,
        now_s: float,
    ) -> None:
        sigma, yaw_sigma = aiding.least_position_noise_m, aiding.least_yaw_noise_rad
        if aiding.noise_of_message:
            sigma = _at_least(sigma, pose.position_variance_m2)
            yaw_sigma = _at_least(yaw_sigma, pose.yaw_variance_rad2)
        mx, my, mz = self._in_our_frame(pose, aiding, heading)
        ix, iy, iz = mx - expected[0], my - expected[1], mz - expected[2]
        if max(abs(ix), abs(iy), abs(iz)) > _GATE * 1.4 * sigma:
            if now_s - self._fused_s > _GIVES_IN_AFTER_S:
                self._set_to(pose, aiding, (now_s, expected, heading), now_s)
            return
        self._tune(sigma, interval_s)
        k1, k2, k3 = self._gains
        k1, k2, k3 = k1 * interval_s, k2 * interval_s, k3 * interval_s
        (x, y, z), (u, v, w) = self.position, self.velocity
        a, b, c = self._acceleration_error
        self.position = (x + k1 * ix, y + k1 * iy, z + k1 * iz)
        self.velocity = (u + k2 * ix, v + k2 * iy, w + k2 * iz)
        self._acceleration_error = (a - k3 * ix, b - k3 * iy, c - k3 * iz)
        if aiding.pose_yaw:
            yaw = euler_from_quaternion(pose.attitude_flu_to_enu)[2]
            error = wrap_angle_rad(yaw - heading - self.yaw_correction_rad)
            gain = _GYRO_NOISE_RAD_S * sqrt(_FILTER_STEP_S * interval_s) / yaw_sigma
            self.yaw_correction_rad += min(1.0, gain) * error
        self._fused_s = now_s

    def _tune(self, sigma_m: float, interval_s: float) -> None:
        """Steady Kalman gains of a triple integrator, per second of time between poses.

        With r, q and j the densities of the noises of the measurement, of the acceleration and of
        its drift, spectral factorisation asks for k3² = j / r, k2² = q / r + 2 k1 k3, k1² = 2 k2.
        """
        key = (sigma_m, round(interval_s, 3))
        if key == self._gains_key:
            return
        self._gains_key = key
        density = sigma_m * sigma_m * max(interval_s, 0.004)
        drive = _ACCELERATION_NOISE_M_S2**2 * _FILTER_STEP_S / density
        drift = (_GRAVITY_M_S2 * _GYRO_NOISE_RAD_S) ** 2 * _FILTER_STEP_S / density
        k3 = sqrt(drift)
        k1 = 2.0
        for _ in range(20):
            k2 = sqrt(drive + 2.0 * k1 * k3)
            k1 = sqrt(2.0 * k2)
        self._gains = (k1, k2, k3)


def _usable(pose: ExternalPose, aiding: Aiding) -> bool:
    numbers = (*pose.position_enu_m, *pose.attitude_flu_to_enu)
    return all(map(isfinite, numbers)) and (
        aiding.least_quality <= 0 or pose.quality >= aiding.least_quality
    )


def _at_least(sigma: float, variance: float) -> float:
    return max(sigma, sqrt(variance)) if isfinite(variance) and variance > 0.0 else sigma
