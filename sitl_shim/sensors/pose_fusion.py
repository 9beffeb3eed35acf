"""Fusion of poses from outside with the inertial sensors, as PX4's EKF2 does it in effect.

Per axis a position, a velocity and an error of the acceleration (what tilt error and accelerometer
bias make together) are carried on by the measured acceleration and corrected by each pose, with
the steady Kalman gains of PX4's default noise figures.  A pose is compared with what was estimated
at its own time and corrects that, and what follows from it until now: a late pose costs accuracy
but neither bias nor stability.  Yaw is corrected in the same way.  The horizontal position and the
height are judged apart, and the height only counts where it is asked for.

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
_FARTHEST_M = 1e6
"""EKF2 keeps its position within this: a pose farther away is no pose."""
_FASTEST_M_S = 100.0
"""EKF2 keeps its velocity within this (EKF2_VEL_LIM)."""


class PoseFusion:
    """Horizontal position, height and yaw of one estimator, as far as poses give them.

    All positions are in the frame of the poses, which becomes the autopilot's local frame.
    """

    __slots__ = (
        "_acceleration_error",
        "_fused_s",
        "_gains",
        "_gains_key",
        "_height_fused_s",
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
        self._height_fused_s = -1e9
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
        anew = pose.reset_counter != previous.reset_counter
        if not self.fusing:
            if interval_s > _LONGEST_INTERVAL_S:
                return
            self.fusing = anew = True
            if now_s - self._fused_s > _GIVES_IN_AFTER_S:
                self.velocity = self._velocity_between(previous, pose, aiding, then[2])
        if anew:
            if aiding.pose_yaw:
                yaw = euler_from_quaternion(pose.attitude_flu_to_enu)[2]
                self.yaw_correction_rad = wrap_angle_rad(yaw - then[2])
            x, y, z = self._innovation(pose, aiding, then)
            self._set_horizontal(x, y, now_s)
            if aiding.pose_height:
                self._set_height(z, now_s)
            return
        self._correct(pose, aiding, then, min(interval_s, _LONGEST_INTERVAL_S), now_s)

    def _then(self, time_s: float) -> tuple[float, Vector3, float] | None:
        """The estimate at a time; None if that is forgotten.  The future counts as now."""
        past = self._past
        if not past or time_s < past[0][0] - 0.004:
            return None
        for entry in reversed(past):
            if entry[0] <= time_s + 0.002:
                return entry
        return past[0]

    def _innovation(
        self, pose: ExternalPose, aiding: Aiding, then: tuple[float, Vector3, float]
    ) -> Vector3:
        """How far the pose lies from the estimate of its time."""
        _, (x, y, z), heading = then
        u, v, w = self._in_our_frame(pose, aiding, heading)
        return (u - x, v - y, w - z)

    def _set_horizontal(self, x: float, y: float, now_s: float) -> None:
        """Start anew from a pose, keeping what has been flown since it was taken."""
        self._move_since(0.0, (x, y, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), now_s)
        self.started = True
        self.resets += 1
        self._fused_s = now_s

    def _set_height(self, z: float, now_s: float) -> None:
        """The same with the height."""
        self._move_since(0.0, (0.0, 0.0, z), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), now_s)
        self._height_fused_s = now_s

    def _move_since(
        self,
        time_s: float,
        position: Vector3,
        velocity: Vector3,
        acceleration: Vector3,
        now_s: float,
    ) -> None:
        """Correct the estimate at a time, and with it all estimates of later times."""
        (dx, dy, dz), (du, dv, dw), (da, db, dc) = position, velocity, acceleration
        moved: deque[tuple[float, Vector3, float]] = deque(maxlen=_REMEMBERED)
        for at_s, (x, y, z), heading in self._past:
            t = max(0.0, at_s - time_s)
            h = 0.5 * t * t
            there = (x + dx + du * t + da * h, y + dy + dv * t + db * h, z + dz + dw * t + dc * h)
            moved.append((at_s, there, heading))
        self._past = moved
        t = max(0.0, now_s - time_s)
        h = 0.5 * t * t
        (x, y, z), (u, v, w) = self.position, self.velocity
        self.position = (
            _within(x + dx + du * t + da * h, _FARTHEST_M),
            _within(y + dy + dv * t + db * h, _FARTHEST_M),
            _within(z + dz + dw * t + dc * h, _FARTHEST_M),
        )
        self.velocity = (
            _within(u + du + da * t, _FASTEST_M_S),
            _within(v + dv + db * t, _FASTEST_M_S),
            _within(w + dw + dc * t, _FASTEST_M_S),
        )
        a, b, c = self._acceleration_error
        self._acceleration_error = (a - da, b - db, c - dc)

    def _velocity_between(
        self, before: ExternalPose, after: ExternalPose, aiding: Aiding, heading: float
    ) -> Vector3:
        """How fast the vehicle moves, by two poses: what the filter had grown sure of is gone."""
        passed_s = after.time_s - before.time_s
        if passed_s < 1e-3:
            return (0.0, 0.0, 0.0)
        x, y, z = self._in_our_frame(before, aiding, heading)
        u, v, w = self._in_our_frame(after, aiding, heading)
        return (
            _within((u - x) / passed_s, _FASTEST_M_S),
            _within((v - y) / passed_s, _FASTEST_M_S),
            _within((w - z) / passed_s, _FASTEST_M_S),
        )

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
        then: tuple[float, Vector3, float],
        interval_s: float,
        now_s: float,
    ) -> None:
        sigma, yaw_sigma = aiding.least_position_noise_m, aiding.least_yaw_noise_rad
        if aiding.noise_of_message:
            sigma = _at_least(sigma, pose.position_variance_m2)
            yaw_sigma = _at_least(yaw_sigma, pose.yaw_variance_rad2)
        x, y, z = self._innovation(pose, aiding, then)
        gate = _GATE * 1.4 * sigma
        if max(abs(x), abs(y)) > gate:
            if now_s - self._fused_s > _GIVES_IN_AFTER_S:
                self._set_horizontal(x, y, now_s)
            x = y = 0.0
        else:
            self._fused_s = now_s
            if aiding.pose_yaw:
                self._correct_yaw(pose, then[2], yaw_sigma, interval_s)
        if not aiding.pose_height:
            z = 0.0
        elif abs(z) > gate:
            if now_s - self._height_fused_s > _GIVES_IN_AFTER_S:
                self._set_height(z, now_s)
            z = 0.0
        else:
            self._height_fused_s = now_s
        if x == y == z == 0.0:
            return
        self._tune(sigma, interval_s)
        k1, k2, k3 = self._gains
        k1, k2, k3 = k1 * interval_s, k2 * interval_s, k3 * interval_s
        self._move_since(
            then[0],
            (k1 * x, k1 * y, k1 * z),
            (k2 * x, k2 * y, k2 * z),
            (k3 * x, k3 * y, k3 * z),
            now_s,
        )

    def _correct_yaw(
        self, pose: ExternalPose, heading: float, sigma_rad: float, interval_s: float
    ) -> None:
        yaw = euler_from_quaternion(pose.attitude_flu_to_enu)[2]
        error = wrap_angle_rad(yaw - heading - self.yaw_correction_rad)
        gain = _GYRO_NOISE_RAD_S * sqrt(_FILTER_STEP_S * interval_s) / sigma_rad
        self.yaw_correction_rad += min(1.0, gain) * error

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
    return (
        all(abs(coordinate) <= _FARTHEST_M for coordinate in pose.position_enu_m)
        and all(map(isfinite, pose.attitude_flu_to_enu))
        and (aiding.least_quality <= 0 or pose.quality >= aiding.least_quality)
    )


def _within(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def _at_least(sigma: float, variance: float) -> float:
    return max(sigma, sqrt(variance)) if isfinite(variance) and variance > 0.0 else sigma
