"""Land detection, as PX4's MulticopterLandDetector.

Three verdicts, each the next one's condition: ground contact, maybe landed, landed; each must
hold for a third of LNDMC_TRIG_TIME.
"""

import math

from sitl_shim.autopilot.interface import TICK_S, Motion
from sitl_shim.autopilot.parameters import ParameterStore

_LEAVES_THRUST_SHARE = 0.08
"""On the way up the ramp: flying from this share of the way from least to hover thrust on."""


class LandDetector:
    """Decides from motion and commanded thrust whether the vehicle stands on the ground."""

    __slots__ = (
        "_contact_s",
        "_landed_s",
        "_maybe_s",
        "ground_contact",
        "landed",
        "maybe_landed",
    )

    def __init__(self, *, landed: bool) -> None:
        self.landed = self.maybe_landed = self.ground_contact = landed
        self._contact_s = self._maybe_s = self._landed_s = 0.0

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

        vx, vy, vz = motion.velocity_enu_m_s
        # A horizontal velocity that is not known does not count.
        still = abs(vz) < parameters["LNDMC_Z_VEL_MAX"] and (
            not motion.local_position_valid or math.hypot(vx, vy) < parameters["LNDMC_XY_VEL_MAX"]
        )
        least = self._low_thrust(parameters, climb_rate_controlled)
        hit = climb_rate_controlled and descending
        # Freely falling: thrust may be low and the vehicle for an instant still, at the apex;
        # the times below see to that.
        contact = still and not ramping and (thrust <= least or hit)
        third_s = parameters["LNDMC_TRIG_TIME"] / 3.0
        self._contact_s = self._contact_s + TICK_S if contact else 0.0
        self.ground_contact = self._contact_s >= third_s
        rates = motion.rate_flu_rad_s
        quiet = max(abs(rate) for rate in rates) < math.radians(parameters["LNDMC_ROT_MAX"])
        self._maybe_s = self._maybe_s + TICK_S if self.ground_contact and quiet else 0.0
        self.maybe_landed = self._maybe_s >= third_s
        self._landed_s = self._landed_s + TICK_S if self.maybe_landed else 0.0
        self.landed = self._landed_s >= third_s

    @staticmethod
    def _low_thrust(parameters: ParameterStore, climb_rate_controlled: bool) -> float:
        if not climb_rate_controlled:
            return parameters["MPC_MANTHR_MIN"] + 0.01
        least = parameters["MPC_THR_MIN"]
        return least + 0.3 * (parameters["MPC_THR_HOVER"] - least)

    @classmethod
    def _lift_off_thrust(
        cls, parameters: ParameterStore, climb_rate_controlled: bool, ramping: bool
    ) -> float:
        if not climb_rate_controlled:
            return cls._low_thrust(parameters, climb_rate_controlled)
        if not ramping:
            return math.inf  # position control leaves the ground by its ramp only
        least = parameters["MPC_THR_MIN"]
        return least + _LEAVES_THRUST_SHARE * (parameters["MPC_THR_HOVER"] - least)
