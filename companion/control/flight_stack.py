"""What the flight runs: any stack of control laws, from the state to an attitude and a thrust."""

from typing import Any, Protocol

from companion.control.attitude import AttitudeGains
from companion.control.frameworks import Command, Limits, Reference, StackRecord, Tick
from companion.control.interfaces import AdaptationMean
from companion.control.reference_model import Array
from companion.control.thrust_laws import ThrustLaw
from companion.frames import Vector3
from companion.vehicle_state import VehicleState


class FlightStack(Protocol):
    """A stack; `companion.control.frameworks.Stack` and MPC-L1+ are of the kind.

    Its memory is its own affair; whoever runs it hands it back unread.
    """

    @property
    def thrust(self) -> ThrustLaw:
        """What makes its thrust field; also holds the vehicle when the stack may not."""

    @property
    def limits(self) -> Limits:
        """What it may ask the vehicle for."""

    @property
    def attitude_loop(self) -> AttitudeGains | None:
        """What makes body rates of its attitudes; None: attitudes are sent."""

    def about(self, anchor_enu_m: Vector3) -> "FlightStack":
        """The same where its geofence lies about a point (ENU m)."""

    def without_adaptation(self, mean: AdaptationMean) -> "FlightStack | None":
        """The same with its adaptation switched off, held at a mean; None if it has none."""

    def start(
        self,
        state: VehicleState,
        thrust_memory: Any = None,  # noqa: ANN401 - the thrust law's own
        applied_u: Array | None = None,
    ) -> Any:  # noqa: ANN401
        """Memory with which it takes over at a state, without a bump."""

    def step(
        self,
        memory: Any,  # noqa: ANN401
        tick: Tick,
        reference: Reference,
    ) -> tuple[Any, Command, StackRecord]:
        """Advance by one sample.

        Raises:
            ValueError: time does not advance, or something is not finite.
        """
