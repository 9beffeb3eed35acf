"""Position and velocity control: from a trajectory setpoint to attitude and thrust.

PX4's cascade (src/modules/mc_pos_control/PositionControl): position P, velocity PID, then the
acceleration is turned into a thrust vector with horizontal and vertical parts decoupled.
"""

import math
from dataclasses import dataclass

from sitl_shim.autopilot.filters import first_order_gain
from sitl_shim.autopilot.interface import TICK_RATE_HZ, TICK_S, Motion
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.thrust_axis import attitude_from_thrust_axis
from sitl_shim.frames import Quaternion, Vector3

_GRAVITY_M_S2 = 9.80665
_VELOCITY_DERIVATIVE_CUTOFF_HZ = 5.0


@dataclass(frozen=True, slots=True)
class TrajectorySetpoint:
    """Where to be and how fast to move.  World ENU; None: that part is not controlled."""

    position_xy_m: tuple[float, float] | None
    velocity_xy_m_s: tuple[float, float] | None
    """Feed-forward when the position is given, else the setpoint itself."""
    position_z_m: float | None
    velocity_z_m_s: float | None
    """Feed-forward when the height is given, else the setpoint itself."""
    yaw_rad: float
    yaw_rate_rad_s: float = 0.0
    """Feed-forward, positive to the left."""
    acceleration_m_s2: Vector3 = (0.0, 0.0, 0.0)
    """Feed-forward; all that there is on an axis without position and velocity."""


@dataclass(frozen=True, slots=True)
class ControlOutput:
    """What the position controller asks of the attitude controller."""

    attitude_flu_to_enu: Quaternion
    thrust: float
    position_enu_m: Vector3 | None
    """Setpoints, for telemetry; the position only where all of it is controlled."""
    velocity_enu_m_s: Vector3
    acceleration_enu_m_s2: Vector3
    yaw_rate_rad_s: float


class PositionControl:
    """Cascaded position and velocity control."""

    __slots__ = (
        "_derivative",
        "_derivative_gain",
        "_hover",
        "_integral",
        "_last_velocity",
        "_p_xy",
        "_p_z",
        "_thrust_max",
        "_thrust_min",
        "_tilt_max_rad",
        "_velocity_max_down",
        "_velocity_max_up",
        "_velocity_max_xy",
        "_velocity_xy_pid",
        "_velocity_z_pid",
    )

    def __init__(self, parameters: ParameterStore) -> None:
        self._integral = [0.0, 0.0, 0.0]
        self._derivative = [0.0, 0.0, 0.0]
        self._last_velocity: Vector3 | None = None
        self._derivative_gain = first_order_gain(TICK_RATE_HZ, _VELOCITY_DERIVATIVE_CUTOFF_HZ)
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains and limits anew."""
        self._p_xy = parameters["MPC_XY_P"]
        self._p_z = parameters["MPC_Z_P"]
        self._velocity_xy_pid = (
            parameters["MPC_XY_VEL_P_ACC"],
            parameters["MPC_XY_VEL_I_ACC"],
            parameters["MPC_XY_VEL_D_ACC"],
        )
        self._velocity_z_pid = (
            parameters["MPC_Z_VEL_P_ACC"],
            parameters["MPC_Z_VEL_I_ACC"],
            parameters["MPC_Z_VEL_D_ACC"],
        )
        self._velocity_max_xy = parameters["MPC_XY_VEL_MAX"]
        self._velocity_max_up = parameters["MPC_Z_VEL_MAX_UP"]
        self._velocity_max_down = parameters["MPC_Z_VEL_MAX_DN"]
        self._hover = parameters["MPC_THR_HOVER"]
        self._thrust_min = parameters["MPC_THR_MIN"]
        self._thrust_max = parameters["MPC_THR_MAX"]
        self._tilt_max_rad = math.radians(parameters["MPC_TILTMAX_AIR"])

    def reset(self) -> None:
        """Forget the past: the controller has not been in charge."""
        self._integral = [0.0, 0.0, 0.0]
        self._derivative = [0.0, 0.0, 0.0]
        self._last_velocity = None

    def note_reset(self, velocity_enu_m_s: Vector3) -> None:
        """The estimated velocity stepped by this much, which is no acceleration."""
        if self._last_velocity is not None:
            x, y, z = self._last_velocity
            dx, dy, dz = velocity_enu_m_s
            self._last_velocity = (x + dx, y + dy, z + dz)

    def update(
        self,
        motion: Motion,
        setpoint: TrajectorySetpoint,
        *,
        climb_limit_m_s: float,
        tilt_limit_rad: float,
        integrate: bool,
    ) -> ControlOutput:
        """One period of 4 ms.

        Args:
            motion: the estimate.
            setpoint: where to be.
            climb_limit_m_s: upper limit of the climb rate; negative holds the vehicle down.
            tilt_limit_rad: tilt limit besides MPC_TILTMAX_AIR.
            integrate: whether the integrators run; they are zero while they do not.
        """
        self._differentiate(motion.velocity_enu_m_s)
        velocity_sp = self._velocity_setpoint(motion, setpoint, climb_limit_m_s)
        acceleration_sp = self._acceleration_setpoint(
            motion.velocity_enu_m_s, velocity_sp, setpoint
        )
        tilt_limit = min(tilt_limit_rad, self._tilt_max_rad)
        thrust, body_z = self._thrust_vector(acceleration_sp, tilt_limit)
        if integrate:
            self._integrate(motion.velocity_enu_m_s, velocity_sp, setpoint, thrust)
        else:
            self._integral = [0.0, 0.0, 0.0]
        return ControlOutput(
            attitude_from_thrust_axis(body_z, setpoint.yaw_rad),
            thrust,
            _whole_position(setpoint),
            velocity_sp,
            acceleration_sp,
            setpoint.yaw_rate_rad_s,
        )

    def _differentiate(self, velocity: Vector3) -> None:
        last = self._last_velocity
        if last is not None:
            gain = self._derivative_gain
            for i in range(3):
                raw = (velocity[i] - last[i]) / TICK_S
                self._derivative[i] += gain * (raw - self._derivative[i])
        self._last_velocity = velocity

    def _velocity_setpoint(
        self, motion: Motion, setpoint: TrajectorySetpoint, climb_limit_m_s: float
    ) -> Vector3:
        x, y, z = motion.position_enu_m
        vx, vy = setpoint.velocity_xy_m_s or (0.0, 0.0)
        if setpoint.position_xy_m is not None:
            vx += self._p_xy * (setpoint.position_xy_m[0] - x)
            vy += self._p_xy * (setpoint.position_xy_m[1] - y)
        speed = math.hypot(vx, vy)
        if speed > self._velocity_max_xy:
            vx *= self._velocity_max_xy / speed
            vy *= self._velocity_max_xy / speed
        vz = setpoint.velocity_z_m_s or 0.0
        if setpoint.position_z_m is not None:
            vz += self._p_z * (setpoint.position_z_m - z)
        vz = max(-self._velocity_max_down, min(self._velocity_max_up, vz))
        return (vx, vy, min(vz, climb_limit_m_s))

    def _acceleration_setpoint(
        self, velocity: Vector3, velocity_sp: Vector3, setpoint: TrajectorySetpoint
    ) -> Vector3:
        p, _, d = self._velocity_xy_pid
        pz, _, dz = self._velocity_z_pid
        integral, derivative = self._integral, self._derivative
        ax, ay, az = setpoint.acceleration_m_s2
        if _controls_z(setpoint):
            az += pz * (velocity_sp[2] - velocity[2]) + integral[2] - dz * derivative[2]
        if not _controls_xy(setpoint):
            return (ax, ay, az)
        return (
            ax + p * (velocity_sp[0] - velocity[0]) + integral[0] - d * derivative[0],
            ay + p * (velocity_sp[1] - velocity[1]) + integral[1] - d * derivative[1],
            az,
        )

    def _thrust_vector(self, acceleration: Vector3, tilt_limit_rad: float) -> tuple[float, Vector3]:
        ax, ay, az = acceleration
        horizontal = math.hypot(ax, ay)
        tilt = min(math.atan2(horizontal, _GRAVITY_M_S2), tilt_limit_rad)
        if horizontal > 1e-9:
            scale = math.sin(tilt) / horizontal
            body_z = (ax * scale, ay * scale, math.cos(tilt))
        else:
            body_z = (0.0, 0.0, 1.0)
        vertical = self._hover * (1.0 + az / _GRAVITY_M_S2)
        thrust = vertical / body_z[2]
        return max(self._thrust_min, min(self._thrust_max, thrust)), body_z

    def _integrate(
        self,
        velocity: Vector3,
        velocity_sp: Vector3,
        setpoint: TrajectorySetpoint,
        thrust: float,
    ) -> None:
        _, i_xy, _ = self._velocity_xy_pid
        _, i_z, _ = self._velocity_z_pid
        error_z = velocity_sp[2] - velocity[2] if _controls_z(setpoint) else 0.0
        at_top = thrust >= self._thrust_max and error_z > 0.0
        at_bottom = thrust <= self._thrust_min and error_z < 0.0
        if not (at_top or at_bottom):
            total = self._integral[2] + i_z * error_z * TICK_S
            self._integral[2] = max(-_GRAVITY_M_S2, min(_GRAVITY_M_S2, total))
        if not _controls_xy(setpoint):
            return
        limit = _GRAVITY_M_S2 * math.tan(self._tilt_max_rad)
        for i in (0, 1):
            total = self._integral[i] + i_xy * (velocity_sp[i] - velocity[i]) * TICK_S
            self._integral[i] = max(-limit, min(limit, total))


def _controls_xy(setpoint: TrajectorySetpoint) -> bool:
    """Whether horizontal velocity is controlled: else acceleration alone."""
    return setpoint.position_xy_m is not None or setpoint.velocity_xy_m_s is not None


def _controls_z(setpoint: TrajectorySetpoint) -> bool:
    """Whether vertical velocity is controlled: else acceleration alone."""
    return setpoint.position_z_m is not None or setpoint.velocity_z_m_s is not None


def _whole_position(setpoint: TrajectorySetpoint) -> Vector3 | None:
    if setpoint.position_xy_m is None or setpoint.position_z_m is None:
        return None
    return (*setpoint.position_xy_m, setpoint.position_z_m)
