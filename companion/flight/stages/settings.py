"""The autopilot's parameters that a flight goes by, kept true for as long as it lasts.

Anybody on the vehicle's links may set them at any time.  So they are read again before each time
that setpoints flow, and heard of meanwhile: an autopilot tells a change to all of its links.
"""

import math
from collections.abc import Callable, Mapping

from companion.config.models import MissionConfig
from companion.flight.errors import FlightRefusedError
from companion.flight.setpoints.setpoint_stream import LONGEST_PAUSE_S, SetpointStream
from companion.flight.vehicle.connection import Connection
from companion.flight.vehicle.parameters import Parameters
from companion.flight.voice import Voice
from companion.mavlink.exchange import Patience
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId
from companion.mavlink.parameters import parameter_from_frame
from companion.thrust_meaning import ThrustMeaning

_AGAIN = Patience(timeout_s=0.3, attempts=5)
"""These exist: what does not answer is lost on the way."""
_COVERED_WITHIN_S = 0.06
_SAME_HEIGHT_M = 0.05


class Settings:
    """What the thrust field means, how long a pause may be, how high a take-off goes."""

    def __init__(
        self,
        mission: MissionConfig,
        connection: Connection,
        stream: SetpointStream,
        voice: Voice,
        adopt: Callable[[ThrustMeaning], None],
    ) -> None:
        """Prepare; nothing is asked yet.

        Args:
            mission: whose limits count as well.
            connection: to the vehicle.
            stream: which must not go on with a meaning that is not true any more.
            voice: tells a person.
            adopt: makes the stream fly by a meaning of the thrust field; raises
                FlightRefusedError where the controller can't.
        """
        self.takeoff_height_m = mission.takeoff_height_m
        """How high the autopilot's take-off goes, above the ground."""
        self._mission = mission
        self._connection = connection
        self._stream = stream
        self._voice = voice
        self._adopt = adopt
        self._parameters = Parameters(connection)
        self._taken: dict[str, float] = {}
        """That the flight goes by."""
        self._values: dict[str, float] = {}
        """As they were read or told last."""
        self._meaning: ThrustMeaning | None = None
        """That the stream flies by."""
        listeners = connection.listeners.setdefault(int(MessageId.PARAM_VALUE), [])
        listeners.append(self._on_value)

    @property
    def changed(self) -> bool:
        """True if somebody has changed one since they were read."""
        return self._values != self._taken

    async def learn(self) -> None:
        """Read them all, and fly accordingly.

        Raises:
            FlightRefusedError: with these the flight cannot be flown.
            FlightAbortedError: the wait was ended from outside.
        """
        self._taken = {}
        self._values = {}
        self._meaning = None
        self._take(await self._parameters.read(self._connection.dialect.flight_parameters))

    async def read_again(self) -> None:
        """Read those that the autopilot has again, and fly accordingly; only while nothing flows.

        Raises:
            FlightRefusedError: with these the flight cannot be flown.
            FlightAbortedError: the wait was ended from outside.
        """
        self._take(await self._parameters.read(tuple(self._taken), _AGAIN))

    def _take(self, values: Mapping[str, float]) -> None:
        """Fly by what was read.

        Raises:
            FlightRefusedError: that cannot be flown.
        """
        meaning = self._connection.dialect.thrust_meaning(values)
        if isinstance(meaning, str):
            raise FlightRefusedError(f"{meaning}.")
        before = self._taken
        self._taken = {**before, **values}
        self._values = self._taken
        if meaning != self._meaning:
            self._adopt(meaning)
            if self._meaning is not None:
                self._voice.tell("warning", f"{_changes(before, values)}; flown accordingly")
            self._meaning = meaning
        self._limit_pause()
        self._set_height()

    def _limit_pause(self) -> None:
        """A sample that does not come is covered for a while; to the stream that is a pause."""
        covered_s = self._mission.supervisor.state_age_limit_s + _COVERED_WITHIN_S
        timeout_s = self._connection.dialect.setpoint_timeout_s(self._values)
        self._stream.longest_pause_s = max(covered_s, min(LONGEST_PAUSE_S, 0.5 * timeout_s))

    def _set_height(self) -> None:
        mission, dialect = self._mission, self._connection.dialect
        wanted_m, before_m = mission.takeoff_height_m, self.takeoff_height_m
        height_m = dialect.takeoff_height_m(self._values, wanted_m)
        self.takeoff_height_m = height_m
        was_asked_for = "takeoff_height_m" in mission.model_fields_set
        if height_m != before_m and abs(height_m - wanted_m) > _SAME_HEIGHT_M and was_asked_for:
            self._voice.tell(
                "info",
                f"{dialect.title} takes off to its own height of {height_m:g} m "
                f"(MIS_TAKEOFF_ALT), not to takeoff_height_m, {wanted_m:g} m",
            )

    def _on_value(self, frame: Frame, received_s: float) -> None:
        """Somebody has set, or read, a parameter."""
        dialect = self._connection.dialect
        reported = parameter_from_frame(frame, dialect.parameter_encoding)
        if reported is None or reported.name not in self._values:
            return
        value = float(reported.value)
        if value == self._values[reported.name] or not math.isfinite(value):
            return
        self._values = {**self._values, reported.name: value}
        self._limit_pause()
        if dialect.thrust_meaning(self._values) != self._meaning:
            # What holds the vehicle until a mode is confirmed would have the old meaning, too.
            self._stream.give_up(f"{_changes(self._taken, self._values)} in flight", hold=False)


def _changes(before: Mapping[str, float], after: Mapping[str, float]) -> str:
    changed = [
        f"{name} from {before[name]:g} to {value:g}"
        for name, value in after.items()
        if before.get(name, value) != value
    ]
    return f"somebody set {' and '.join(changed)}"
