"""The estimator whole: on its own with satellites, or with poses from outside in their place."""

from dataclasses import replace
from math import atan2, cos, sin

from sitl_shim.frames import Quaternion, Vector3, rotate, rotate_inverse
from sitl_shim.plant.state import PlantState
from sitl_shim.plant.vehicle import GRAVITY_M_S2, VehicleModel
from sitl_shim.sensors.aiding import Aiding, ExternalPose
from sitl_shim.sensors.estimator import Estimate, Estimator
from sitl_shim.sensors.pose_fusion import PoseFusion
from sitl_shim.sensors.profile import SensorProfile

_AT_REST_SHARE = 0.05


class AidedEstimator:
    """Turns the truth into an estimate, once per step of the plant.

    Satellites on (the rule): the profile's errors.  Satellites off: the acceleration as measured,
    turned by the estimated attitude, integrated and corrected by poses; without poses it drifts,
    and after a while it says of itself that it is lost.

    Args:
        profile: sizes of the errors.
        vehicle: see `Estimator`.
        seed: draws everything random here.
    """

    def __init__(self, profile: SensorProfile, vehicle: VehicleModel, *, seed: int) -> None:
        self.aiding = Aiding()
        """What to lean on; may change at any time."""
        self._inner = Estimator(profile, vehicle, seed=seed)
        self._at_rest_thrust_n = _AT_REST_SHARE * vehicle.mass_kg * GRAVITY_M_S2
        self._fusion: PoseFusion | None = None
        self._poses: list[ExternalPose] = []
        self._height_offset_m: float | None = None
        self._last_s = 0.0
        self._booted = False

    @property
    def resets(self) -> int:
        """How often the estimate was set to a pose anew."""
        return 0 if self._fusion is None else self._fusion.resets

    def take(self, pose: ExternalPose) -> None:
        """Take a pose; it is used at the next step, if at all."""
        self._poses.append(pose)

    def update(self, state: PlantState) -> Estimate:
        """The estimate of a state; to be called for each step of the plant, in order."""
        estimate = self._inner.update(state)
        step_s, self._last_s = state.time_s - self._last_s, state.time_s
        if self.aiding.gnss:
            self._fusion = None
            self._poses.clear()
            self._booted = True
            return estimate
        fusion = self._fusion
        if fusion is None:
            fusion = self._fusion = PoseFusion()
            fusion.begin(
                estimate.position_enu_m,
                estimate.velocity_enu_m_s,
                state.time_s,
                valid=self._booted,
            )
            self._height_offset_m = None
        self._booted = True
        return self._fused(fusion, estimate, state, step_s)

    def _fused(
        self, fusion: PoseFusion, estimate: Estimate, state: PlantState, step_s: float
    ) -> Estimate:
        aiding, now_s = self.aiding, state.time_s
        w, x, y, z = estimate.attitude_flu_to_enu
        heading = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        attitude = _turned(estimate.attitude_flu_to_enu, fusion.yaw_correction_rad)
        if state.on_ground and sum(state.rotor_thrust_n) < self._at_rest_thrust_n:
            fusion.hold()
            measured: Vector3 = (0.0, 0.0, 0.0)
        else:
            measured = _acceleration(estimate, state, attitude)
        fusion.predict(now_s, step_s, measured, heading)
        if aiding.pose_horizontal:  # height or yaw alone are not fused here
            for pose in self._poses:
                fusion.take(pose, aiding, now_s)
        self._poses.clear()

        (px, py, pz), (vx, vy, vz) = fusion.position, fusion.velocity
        if not (aiding.pose_height and fusion.fusing):
            # The barometer's height, joined on without a step.
            if self._height_offset_m is None:
                self._height_offset_m = pz - estimate.position_enu_m[2]
            pz = estimate.position_enu_m[2] + self._height_offset_m
            vz = estimate.velocity_enu_m_s[2]
            fusion.position, fusion.velocity = (px, py, pz), (vx, vy, vz)
        else:
            self._height_offset_m = None
        return replace(
            estimate,
            position_enu_m=(px, py, pz),
            velocity_enu_m_s=(vx, vy, vz),
            attitude_flu_to_enu=attitude,
            local_position_valid=fusion.valid(now_s, aiding.lost_after_s),
            global_position_valid=False,
        )


def _acceleration(estimate: Estimate, state: PlantState, attitude: Quaternion) -> Vector3:
    """What the accelerometer says, turned into the world by the estimated attitude, m/s²."""
    ax, ay, az = estimate.acceleration_enu_m_s2
    force = rotate_inverse(state.attitude_flu_to_enu, (ax, ay, az + GRAVITY_M_S2))
    ax, ay, az = rotate(attitude, force)
    return (ax, ay, az - GRAVITY_M_S2)


def _turned(attitude: Quaternion, yaw_rad: float) -> Quaternion:
    """An attitude turned about up."""
    if yaw_rad == 0.0:
        return attitude
    c, s = cos(0.5 * yaw_rad), sin(0.5 * yaw_rad)
    w, x, y, z = attitude
    return (c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w)
