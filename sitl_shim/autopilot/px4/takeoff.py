"""The ramp between standing and flying, as PX4's TakeoffHandling.

After arming the motors spool up; when a climb is wanted, the climb rate that is allowed grows
from a value that holds the vehicle down to the take-off speed; then the ramp is out of the way.
"""

from enum import IntEnum

from sitl_shim.autopilot.interface import TICK_S
from sitl_shim.autopilot.parameters import ParameterStore

_GRAVITY_M_S2 = 9.80665


class TakeoffStage(IntEnum):
    """Where a take-off has got to."""

    DISARMED = 0
    SPOOL_UP = 1
    READY = 2
    RAMP = 3
    FLIGHT = 4


class TakeoffRamp:
    """Stages of the take-off under position control."""

    __slots__ = ("_progress", "_spool_up_s", "_spooled_s", "stage")

    def __init__(self) -> None:
        self.stage = TakeoffStage.DISARMED
        self._progress = 0.0
        self._spooled_s = 0.0

    def start_in_flight(self) -> None:
        """Begin in the air."""
        self.stage = TakeoffStage.FLIGHT

    def step(self, parameters: ParameterStore, *, armed: bool, landed: bool, wanted: bool) -> None:
        """One period of 4 ms.

        Args:
            parameters: for the times.
            armed: whether the motors may turn.
            landed: the land detector's verdict.
            wanted: a setpoint wants to leave the ground.
        """
        if not armed:
            self.stage = TakeoffStage.DISARMED
            return
        if self.stage is TakeoffStage.DISARMED:
            self.stage = TakeoffStage.SPOOL_UP
            self._spooled_s = 0.0
        if self.stage is TakeoffStage.SPOOL_UP:
            self._spooled_s += TICK_S
            if not landed:  # flown off under a mode that has no ramp
                self.stage = TakeoffStage.FLIGHT
            elif self._spooled_s >= parameters["COM_SPOOLUP_TIME"]:
                self.stage = TakeoffStage.READY
        if self.stage is TakeoffStage.READY:
            if not landed:
                self.stage = TakeoffStage.FLIGHT
            elif wanted:
                self.stage = TakeoffStage.RAMP
                self._progress = 0.0
        if self.stage is TakeoffStage.RAMP:
            ramp_s = parameters["MPC_TKO_RAMP_T"]
            self._progress += TICK_S / ramp_s if ramp_s > 0.0 else 1.0
            if self._progress >= 1.0:
                self.stage = TakeoffStage.FLIGHT
        elif self.stage is TakeoffStage.FLIGHT and landed:
            self.stage = TakeoffStage.READY

    def climb_limit_m_s(self, parameters: ParameterStore) -> float:
        """Upper limit of the climb rate now."""
        if self.stage is not TakeoffStage.RAMP:
            return parameters["MPC_Z_VEL_MAX_UP"]
        hold_down = -_GRAVITY_M_S2 / max(parameters["MPC_Z_VEL_P_ACC"], 0.01)
        return hold_down + self._progress * (parameters["MPC_TKO_SPEED"] - hold_down)
