"""The motors of a quad X: spooling, mixing, saturation, the learned hover throttle.

ArduPilot's AP_MotorsMatrix with its normalised factors (one unit of roll, pitch or yaw is half a
unit per rotor) and its order of giving way: yaw first, then throttle, roll and pitch last.
"""

from enum import IntEnum

from sitl_shim.autopilot.filters import first_order_gain
from sitl_shim.autopilot.interface import TICK_RATE_HZ, TICK_S, RotorCommands
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Vector3

STOPPED: RotorCommands = (0.0, 0.0, 0.0, 0.0)
_HOVER_LEARN_GAIN = TICK_S / (10.0 + TICK_S)
_HOVER_LEAST, _HOVER_MOST = 0.125, 0.6875
_MIX_IN_AIR = 0.5
"""How far throttle may rise above what was asked for, towards hover, for roll and pitch."""


class Spool(IntEnum):
    """How far the motors are spun up."""

    SHUT_DOWN = 0
    IDLE = 1
    SPOOLING = 2
    UNLIMITED = 3


class Motors:
    """Turns torques and throttle into the rotors' signals."""

    __slots__ = (
        "_expo",
        "_headroom",
        "_idle",
        "_spool_rate",
        "_spooled",
        "_told_hover",
        "hover",
        "signals",
        "spool",
        "throttle",
        "throttle_at_bottom",
        "throttle_at_top",
        "tilt_limited",
        "wants_unlimited",
        "yaw_limited",
    )

    def __init__(self, parameters: ParameterStore, *, airborne: bool) -> None:
        self.spool = Spool.UNLIMITED if airborne else Spool.SHUT_DOWN
        self.wants_unlimited = airborne
        self._spooled = 1.0 if airborne else 0.0
        self._told_hover = self.hover = parameters["MOT_THST_HOVER"]
        """Learned in flight, from the parameter on."""
        self.throttle = self.hover if airborne else 0.0
        """After filter and limits, 0 to 1."""
        self.signals: RotorCommands = STOPPED
        self.throttle_at_bottom = self.throttle_at_top = False
        self.tilt_limited = self.yaw_limited = False
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read the parameters anew."""
        if parameters["MOT_THST_HOVER"] != self._told_hover:
            self._told_hover = self.hover = parameters["MOT_THST_HOVER"]
        self._expo = parameters["MOT_THST_EXPO"]
        self._headroom = parameters["MOT_YAW_HEADROOM"] * 0.001
        self._idle = parameters["MOT_SPIN_ARM"]
        self._spool_rate = TICK_S / parameters["MOT_SPOOL_TIME"]

    def stop(self) -> None:
        """Disarmed."""
        self.spool = Spool.SHUT_DOWN
        self._spooled = self.throttle = 0.0
        self.signals = STOPPED

    def advance_spool(self) -> None:
        """One period armed: towards idle, or to the full range where that is wanted."""
        if self.wants_unlimited:
            self._spooled = min(1.0, self._spooled + self._spool_rate)
        else:
            self._spooled = max(0.0, self._spooled - self._spool_rate)
        full = self._spooled >= 1.0
        self.spool = Spool.UNLIMITED if full else Spool.SPOOLING if self._spooled else Spool.IDLE

    def filter_throttle(self, wanted: float, cutoff_hz: float) -> None:
        """Take a throttle through the filter of the motors; 0 Hz: at once."""
        gain = first_order_gain(TICK_RATE_HZ, cutoff_hz)
        self.throttle += gain * (wanted - self.throttle)

    def idle(self) -> RotorCommands:
        """Armed, on the ground, turning but not lifting."""
        self.throttle = 0.0
        self.throttle_at_bottom, self.throttle_at_top = True, False
        self.tilt_limited = self.yaw_limited = True
        idle = self._idle
        self.signals = (idle, idle, idle, idle)
        return self.signals

    def mix(self, torque_flu: Vector3) -> RotorCommands:
        """Rotor signals for torques (normalised, FLU) at the present throttle."""
        throttle = self.throttle
        self.throttle_at_bottom = throttle <= 0.0
        self.throttle_at_top = throttle >= 1.0
        throttle = 0.0 if throttle < 0.0 else 1.0 if throttle > 1.0 else throttle
        roll, pitch, yaw = torque_flu
        a, b, c = 0.5 * (roll + pitch), 0.5 * (roll - pitch), 0.5 * yaw
        first, second = throttle - a - c, throttle + a - c
        third, fourth = throttle + b + c, throttle - b + c
        self.tilt_limited = self.yaw_limited = False
        if not (
            0.0 <= first <= 1.0
            and 0.0 <= second <= 1.0
            and 0.0 <= third <= 1.0
            and 0.0 <= fourth <= 1.0
        ):
            first, second, third, fourth = self._fit(throttle, (-a, a, b, -b), c)
        expo = self._expo
        if expo == 0.0:
            self.signals = (first, second, third, fourth)
        else:
            self.signals = (
                _signal(first, expo),
                _signal(second, expo),
                _signal(third, expo),
                _signal(fourth, expo),
            )
        return self.signals

    def _fit(self, throttle: float, tilt: RotorCommands, yaw: float) -> RotorCommands:
        """Thrusts that fit within 0 to 1, when what was asked for does not."""
        average_max = max(throttle, throttle * (1.0 - _MIX_IN_AIR) + self.hover * _MIX_IN_AIR)
        best = min(0.5, average_max)
        signs = (-1.0, -1.0, 1.0, 1.0)
        room = min(
            max(0.0, 1.0 - best - part if sign * yaw > 0.0 else best + part)
            for part, sign in zip(tilt, signs, strict=True)
        )
        room = max(room, 0.5 * self._headroom)
        if abs(yaw) > room:
            self.yaw_limited = True
            yaw = room if yaw > 0.0 else -room
        parts = [part + sign * yaw for part, sign in zip(tilt, signs, strict=True)]
        low, high = min(parts), max(parts)
        scale = 1.0
        if high - low > 1.0:
            scale = 1.0 / (high - low)
        if average_max + low < 0.0:
            scale = min(scale, -average_max / low)
        low, high = low * scale, high * scale
        base = max(throttle, -low)
        if scale < 1.0:
            self.tilt_limited = self.yaw_limited = True
            self.throttle_at_top = self.throttle_at_top or throttle > -low
            base = -low
        elif base > 1.0 - high:
            base = 1.0 - high
            self.throttle_at_top = True
        first, second, third, fourth = (min(1.0, max(0.0, base + scale * part)) for part in parts)
        return (first, second, third, fourth)

    def tell_hover(self, parameters: ParameterStore) -> None:
        """Let the parameter say what was learned."""
        if self.hover != self._told_hover:
            self._told_hover = self.hover
            parameters.learn("MOT_THST_HOVER", self.hover)

    def learn_hover(self) -> None:
        """One period of quiet hover: the hover throttle follows, slowly."""
        hover = self.hover + _HOVER_LEARN_GAIN * (self.throttle - self.hover)
        self.hover = max(_HOVER_LEAST, min(_HOVER_MOST, hover))


def _signal(thrust: float, expo: float) -> float:
    """Positive root of e u^2 + (1 - e) u = thrust."""
    if thrust <= 0.0:
        return 0.0
    linear = 1.0 - expo
    return float(2.0 * thrust / (linear + (linear * linear + 4.0 * expo * thrust) ** 0.5))
