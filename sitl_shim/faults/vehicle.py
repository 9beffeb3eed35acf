"""When what befalls the vehicle begins and ends."""

from dataclasses import dataclass
from math import inf

from sitl_shim.faults.schema import FrozenTelemetry, PositionLoss, VehicleFault
from sitl_shim.wind.events import Moments


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A fault begins, or is over."""

    fault: VehicleFault
    begins: bool


class Timetable:
    """The beginnings and ends of faults, handed out when their time has come.

    Args:
        faults: in any order; those of the same moment come in the order of the file.
        moments: what their times count from.
    """

    __slots__ = ("_ends", "_moments", "_waiting")

    def __init__(self, faults: tuple[VehicleFault, ...], moments: Moments) -> None:
        self._moments = moments
        self._waiting = list(faults)
        self._ends: list[tuple[float, VehicleFault]] = []

    def due(self, time_s: float) -> list[Occurrence]:
        """What begins or ends at this tick or has done so since the last one, in its order.

        Args:
            time_s: simulated time since the vehicle was switched on; never decreases.
        """
        reached = time_s + 1e-9
        moment = self._moments.time_s
        if not any(moment(fault) <= reached for fault in self._waiting) and not any(
            end_s <= reached for end_s, _ in self._ends
        ):
            return []
        # Ends first: what begins at the moment at which its like is over lasts.
        found = [Occurrence(fault, begins=False) for end_s, fault in self._ends if end_s <= reached]
        self._ends = [entry for entry in self._ends if entry[0] > reached]
        begun = [fault for fault in self._waiting if moment(fault) <= reached]
        self._waiting = [fault for fault in self._waiting if moment(fault) > reached]
        for fault in sorted(begun, key=moment):
            found.append(Occurrence(fault, begins=True))
            if lasts_s(fault) < inf:
                self._ends.append((moment(fault) + lasts_s(fault), fault))
        return found


def lasts_s(fault: VehicleFault) -> float:
    """How long a fault lasts; infinite for what is not undone."""
    return fault.lasts_s if isinstance(fault, PositionLoss | FrozenTelemetry) else inf
