"""From a climb rate (u_z) to the thrust field, for each thing that an autopilot makes of it.

Three small laws behind one protocol.  Two of them close the climb-rate loop here
(`companion.control.thrust`) and differ in who compensates the tilt; the third leaves the loop to
the autopilot, as the paper's vehicle does: its field *is* a climb rate.
"""

from dataclasses import dataclass
from typing import Any, Protocol

from companion.control import thrust
from companion.control.thrust import ThrustGains, ThrustMemory

_LEAST_HOLD_COSINE = 0.7
"""Of the tilt that a hold compensates: it levels meanwhile, and must not climb away."""
_NOT_KNOWN = float("nan")


class ThrustLaw(Protocol):
    """What makes a thrust field of a climb rate.

    Its memory is its own affair; whoever runs it hands it back unread.
    """

    def start(self, climb_rate_m_s: float, earlier: Any = None) -> Any:  # noqa: ANN401
        """Memory at engagement with a measured climb rate.

        Args:
            climb_rate_m_s: measured, up positive.
            earlier: memory of this law from before, whose estimates are worth keeping.
        """

    def step(
        self,
        memory: Any,  # noqa: ANN401
        climb_rate_command_m_s: float,
        climb_rate_m_s: float,
        tilt_cosine: float,
        dt_s: float,
    ) -> tuple[Any, float]:
        """The new memory and the thrust field, 0..1, for a sample dt_s after the last one.

        Args:
            memory: from `start` or from the sample before.
            climb_rate_command_m_s: u_z, up positive.
            climb_rate_m_s: measured.
            tilt_cosine: of the attitude in effect.
            dt_s: since the sample before, s.
        """

    def hold(
        self,
        memory: Any,  # noqa: ANN401
        climb_rate_m_s: float,
        tilt_cosine: float,
    ) -> float:
        """The field that ends a climb rate, as well as it can be done without a loop."""

    def hover_thrust(self, memory: Any) -> float:  # noqa: ANN401
        """The field that is reckoned to hover; NaN for a law that needs none."""


class AccelerationLaw(ThrustLaw, Protocol):
    """A thrust law that can be asked for a vertical acceleration, too."""

    def accelerate(
        self,
        memory: Any,  # noqa: ANN401
        acceleration_m_s2: float,
        climb_rate_m_s: float,
        tilt_cosine: float,
        dt_s: float,
    ) -> tuple[Any, float, float]:
        """The new memory, the field, and the acceleration that the limits leave.

        Args:
            memory: from `start` or from the sample before.
            acceleration_m_s2: wanted beside what carries the weight, up positive.
            climb_rate_m_s: measured.
            tilt_cosine: of the attitude in effect when the thrust acts.
            dt_s: since the sample before, s.
        """


@dataclass(frozen=True, slots=True)
class CollectiveThrust:
    """The field is thrust along the body's vertical: the tilt is compensated here."""

    gains: ThrustGains

    def start(self, climb_rate_m_s: float, earlier: ThrustMemory | None = None) -> ThrustMemory:
        """See `ThrustLaw`; the estimated hover thrust is kept."""
        known = None if earlier is None else earlier.hover_force
        return thrust.start(self.gains, climb_rate_m_s, known)

    def step(
        self,
        memory: ThrustMemory,
        climb_rate_command_m_s: float,
        climb_rate_m_s: float,
        tilt_cosine: float,
        dt_s: float,
    ) -> tuple[ThrustMemory, float]:
        """See `ThrustLaw`."""
        return thrust.step(
            self.gains, memory, climb_rate_command_m_s, climb_rate_m_s, tilt_cosine, dt_s
        )

    def accelerate(
        self,
        memory: ThrustMemory,
        acceleration_m_s2: float,
        climb_rate_m_s: float,
        tilt_cosine: float,
        dt_s: float,
    ) -> tuple[ThrustMemory, float, float]:
        """See `AccelerationLaw`."""
        return thrust.accelerate(
            self.gains, memory, acceleration_m_s2, climb_rate_m_s, tilt_cosine, dt_s
        )

    def hold(self, memory: ThrustMemory, climb_rate_m_s: float, tilt_cosine: float) -> float:
        """See `ThrustLaw`."""
        gains = self.gains
        limit = gains.maximum_acceleration_m_s2
        correction = max(-limit, min(limit, -gains.proportional * climb_rate_m_s))
        force = memory.hover_force * (1.0 + correction / thrust.GRAVITY_M_S2)
        force /= max(_LEAST_HOLD_COSINE, tilt_cosine)
        field = thrust.thrust_from_force(max(0.0, force), gains.thrust_curve)
        return max(gains.minimum_thrust, min(gains.maximum_thrust, field))

    def hover_thrust(self, memory: ThrustMemory) -> float:
        """See `ThrustLaw`."""
        return thrust.thrust_from_force(memory.hover_force, self.gains.thrust_curve)


@dataclass(frozen=True, slots=True)
class VerticalThrust:
    """The field is the vertical part of the thrust: the autopilot divides by the tilt's cosine.

    The limits stay those of the thrust along the body, so what acts is what `CollectiveThrust`
    would have made act.
    """

    loop: CollectiveThrust

    def start(self, climb_rate_m_s: float, earlier: ThrustMemory | None = None) -> ThrustMemory:
        """See `ThrustLaw`."""
        return self.loop.start(climb_rate_m_s, earlier)

    def step(
        self,
        memory: ThrustMemory,
        climb_rate_command_m_s: float,
        climb_rate_m_s: float,
        tilt_cosine: float,
        dt_s: float,
    ) -> tuple[ThrustMemory, float]:
        """See `ThrustLaw`."""
        advanced, _ = self.loop.step(
            memory, climb_rate_command_m_s, climb_rate_m_s, tilt_cosine, dt_s
        )
        curve = self.loop.gains.thrust_curve
        return advanced, thrust.thrust_from_force(advanced.vertical_force, curve)

    def accelerate(
        self,
        memory: ThrustMemory,
        acceleration_m_s2: float,
        climb_rate_m_s: float,
        tilt_cosine: float,
        dt_s: float,
    ) -> tuple[ThrustMemory, float, float]:
        """See `AccelerationLaw`."""
        advanced, _, got = self.loop.accelerate(
            memory, acceleration_m_s2, climb_rate_m_s, tilt_cosine, dt_s
        )
        curve = self.loop.gains.thrust_curve
        return advanced, thrust.thrust_from_force(advanced.vertical_force, curve), got

    def hold(self, memory: ThrustMemory, climb_rate_m_s: float, tilt_cosine: float) -> float:
        """See `ThrustLaw`; what is sent along with it is level, which leaves nothing to divide."""
        return self.loop.hold(memory, climb_rate_m_s, 1.0)

    def hover_thrust(self, memory: ThrustMemory) -> float:
        """See `ThrustLaw`."""
        return self.loop.hover_thrust(memory)


@dataclass(frozen=True, slots=True)
class ClimbRateField:
    """The field is a climb rate, and the loop the autopilot's: the paper's interface.

    ``field = 0.5 + u_z / (2 rate)`` with one rate for up and one for down, as ArduCopter reads it.
    """

    climb_m_s: float
    """Rate that 1 asks for."""
    descent_m_s: float
    """Rate that 0 asks for, positive."""

    def start(self, climb_rate_m_s: float, earlier: None = None) -> None:
        """Nothing to remember."""

    def step(
        self,
        memory: None,
        climb_rate_command_m_s: float,
        climb_rate_m_s: float,
        tilt_cosine: float,
        dt_s: float,
    ) -> tuple[None, float]:
        """See `ThrustLaw`; the command alone counts."""
        rate = self.climb_m_s if climb_rate_command_m_s > 0.0 else self.descent_m_s
        return None, max(0.0, min(1.0, 0.5 + 0.5 * climb_rate_command_m_s / rate))

    def hold(self, memory: None, climb_rate_m_s: float, tilt_cosine: float) -> float:
        """No climb rate."""
        return 0.5

    def hover_thrust(self, memory: None) -> float:
        """Not known, nor needed."""
        return _NOT_KNOWN
