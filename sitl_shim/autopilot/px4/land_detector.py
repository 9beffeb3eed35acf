"""Land detection, as PX4's MulticopterLandDetector.

Three verdicts, each the next one's condition: ground contact, maybe landed, landed; each must
hold for a third of LNDMC_TRIG_TIME.
"""

import math
from dataclasses import dataclass

from sitl_shim.autopilot.interface import TICK_S, Motion
from sitl_shim.autopilot.parameters import ParameterStore

_LEAVES_THRUST_SHARE = 0.08
"""On the way up the ramp: flying from this share of the way from least to hover thrust on."""


@dataclass(frozen=True, slots=True)
class _Limits:
    """What a vehicle that stands on the ground does not exceed."""

    manual_thrust: float
    """Where the thrust is given."""
    climbing_thrust: float
    """Where position control is in charge of it."""
    climb_m_s: float
    speed_m_s: float
    rate_rad_s: float
    third_s: float
    """Of the time after which it has landed."""

    @classmethod
    def of(cls, parameters: ParameterStore) -> "_Limits":
        """By the parameters."""
        least = parameters["MPC_THR_MIN"]
        return cls(
            manual_thrust=_manual_thrust(parameters),
            climbing_thrust=least + 0.3 * (parameters["MPC_THR_HOVER"] - least),
            climb_m_s=parameters["LNDMC_Z_VEL_MAX"],
            speed_m_s=parameters["LNDMC_XY_VEL_MAX"],
            rate_rad_s=math.radians(parameters["LNDMC_ROT_MAX"]),
            third_s=parameters["LNDMC_TRIG_TIME"] / 3.0,
        )

    def still(self, motion: Motion) -> bool:
        """Whether it goes nowhere; a horizontal velocity that is not known does not count."""
        vx, vy, vz = motion.velocity_enu_m_s
        return abs(vz) < self.climb_m_s and (
            not motion.local_position_valid or math.hypot(vx, vy) < self.speed_m_s
        )

    def quiet(self, motion: Motion) -> bool:
        """Whether it does not turn."""
        return max(abs(rate) for rate in motion.rate_flu_rad_s) < self.rate_rad_s


class LandDetector:
    """Decides from motion and commanded thrust whether the vehicle stands on the ground."""

    __slots__ = (
        "_contact_s",
        "_landed_s",
        "_limits",
        "_maybe_s",
        "_revision",
        "ground_contact",
        "landed",
        "maybe_landed",
    )

    def __init__(self, *, landed: bool) -> None:
        self.landed = self.maybe_landed = self.ground_contact = landed
        self._contact_s = self._maybe_s = self._landed_s = 0.0
        self._revision = -1
        self._limits = _Limits(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def step(
        self,
        parameters: ParameterStore,
        motion: Motion,
        *,
        armed: bool,
        thrust: float,
        climb_rate_controlled: bool,
        descending: bool,
        ramping: bool,
    ) -> None:
        """One period of 4 ms.

        Args:
            parameters: limits.
            motion: the estimate.
            armed: a disarmed vehicle that has landed stays landed.
            thrust: collective thrust commanded, 0 to 1.
            climb_rate_controlled: whether position control is in charge of the thrust.
            descending: a sink rate is being asked for.
            ramping: the take-off ramp is on its way.
        """
        if not armed and self.landed:
            return
        if self.landed:
            if thrust > self._lift_off_thrust(parameters, climb_rate_controlled, ramping):
                self.landed = self.maybe_landed = self.ground_contact = False
                self._contact_s = self._maybe_s = self._landed_s = 0.0
            return

        if parameters.revision != self._revision:
            self._revision = parameters.revision
            self._limits = _Limits.of(parameters)
        limits = self._limits
        low = limits.climbing_thrust if climb_rate_controlled else limits.manual_thrust
        hit = climb_rate_controlled and descending
        # Freely falling: thrust may be low and the vehicle for an instant still, at the apex;
        # the times below see to that.
        contact = not ramping and (thrust <= low or hit) and limits.still(motion)
        third_s = limits.third_s
        self._contact_s = self._contact_s + TICK_S if contact else 0.0
        self.ground_contact = self._contact_s >= third_s
        quiet = self.ground_contact and limits.quiet(motion)
        self._maybe_s = self._maybe_s + TICK_S if quiet else 0.0
        self.maybe_landed = self._maybe_s >= third_s
        self._landed_s = self._landed_s + TICK_S if self.maybe_landed else 0.0
        self.landed = self._landed_s >= third_s

    @staticmethod
    def _lift_off_thrust(
        parameters: ParameterStore, climb_rate_controlled: bool, ramping: bool
    ) -> float:
        if not climb_rate_controlled:
            return _manual_thrust(parameters)
        if not ramping:
            return math.inf  # position control leaves the ground by its ramp only
        least = parameters["MPC_THR_MIN"]
        return least + _LEAVES_THRUST_SHARE * (parameters["MPC_THR_HOVER"] - least)


def _manual_thrust(parameters: ParameterStore) -> float:
    """At most so much is little, where the thrust is given."""
    return parameters["MPC_MANTHR_MIN"] + 0.01
