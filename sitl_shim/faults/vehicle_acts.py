"""What befalls the vehicle, done to it when its time has come."""

from collections.abc import Callable, Mapping
from math import nan
from typing import Protocol

from sitl_shim.autopilot.flavours import flavours, mode_command, mode_number
from sitl_shim.autopilot.interface import Autopilot, Command
from sitl_shim.data_file import DataFileError
from sitl_shim.faults.schema import (
    BatteryLow,
    ClockJump,
    EstimatorReset,
    Faults,
    ForcedDisarm,
    FrozenTelemetry,
    ModeChange,
    PositionLoss,
    Reboot,
    VehicleFault,
)
from sitl_shim.faults.vehicle import Occurrence, Timetable
from sitl_shim.faults.vehicle_battery import BatteryFault
from sitl_shim.faults.vehicle_clock import BootClock
from sitl_shim.faults.vehicle_estimate import EstimateFaults
from sitl_shim.faults.vehicle_events import told
from sitl_shim.plant.state import PlantState
from sitl_shim.plant.vehicle import Battery
from sitl_shim.wind.events import Moments
from sitl_shim.wind.happened import Happened

_CMD_ARM = 400
_FORCE = 21196.0


class Vehicle(Protocol):
    """What faults act on."""

    autopilot: Autopilot
    clock: BootClock
    state: PlantState

    def reboot(self) -> None:
        """Begin the autopilot anew."""

    def rely_on_position(self, there: bool) -> None:
        """Let the estimator have measurements of its position, or none."""


class VehicleFaults:
    """The faults of a file that befall the vehicle.

    Args:
        faults: the file.
        flavour: of the autopilot.
        moments: what times count from.
        battery: of the vehicle.

    Raises:
        DataFileError: a mode that the autopilot does not know.
    """

    def __init__(self, faults: Faults, flavour: str, moments: Moments, battery: Battery) -> None:
        _refuse_unknown_modes(faults)
        self._flavour = flavour
        self._timetable = Timetable(faults.vehicle, moments)
        self._boots = 0
        self._frozen: dict[int, FrozenTelemetry] = {}
        self._lost: set[int] = set()
        self.estimate = EstimateFaults()
        """What they make of the estimate."""
        self.battery = BatteryFault(battery)
        """What they make of the battery's report."""
        self.happened: list[Happened] = []
        """What has befallen the vehicle so far, in its order."""
        self._acts: Mapping[type[VehicleFault], Callable[[Occurrence, Vehicle], float]] = {
            EstimatorReset: self._reset,
            PositionLoss: self._lose_position,
            FrozenTelemetry: self._freeze,
            ClockJump: self._jump,
            Reboot: self._reboot,
            ModeChange: self._change_mode,
            ForcedDisarm: self._disarm,
            BatteryLow: self._empty,
        }

    @property
    def frozen(self) -> bool:
        """Whether the state that is told stays as it is."""
        return bool(self._frozen)

    @property
    def stamps_frozen(self) -> bool:
        """Whether its time stamps stay, too."""
        return any(fault.stamps == "frozen" for fault in self._frozen.values())

    def act(self, time_us: int, vehicle: Vehicle) -> None:
        """Do what is due.

        Args:
            time_us: simulated time.
            vehicle: to which it is done.
        """
        for occurrence in self._timetable.due(time_us * 1e-6):
            fault = occurrence.fault
            if isinstance(fault, ModeChange) and self._flavour not in fault.mode:
                continue
            value = self._acts[type(fault)](occurrence, vehicle)
            # By the clock as it is after the fault: so is all that follows.
            stamp_s = vehicle.clock.stamp_s(time_us * 1e-6)
            self.happened += told(occurrence, value, stamp_s)

    # --- each fault; returns what is told of it ---

    def _reset(self, occurrence: Occurrence, vehicle: Vehicle) -> float:
        fault = occurrence.fault
        assert isinstance(fault, EstimatorReset)
        step = self.estimate.step(fault)
        if fault.announced:
            vehicle.autopilot.note_reset(step)
        return 0.0

    def _lose_position(self, occurrence: Occurrence, vehicle: Vehicle) -> float:
        self._lost ^= {id(occurrence.fault)}
        self.estimate.position_lost = bool(self._lost)
        vehicle.rely_on_position(not self._lost)
        return float(occurrence.begins)

    def _freeze(self, occurrence: Occurrence, vehicle: Vehicle) -> float:
        fault = occurrence.fault
        assert isinstance(fault, FrozenTelemetry)
        if occurrence.begins:
            self._frozen[id(fault)] = fault
        else:
            self._frozen.pop(id(fault), None)
        return float(occurrence.begins)

    def _jump(self, occurrence: Occurrence, vehicle: Vehicle) -> float:
        fault = occurrence.fault
        assert isinstance(fault, ClockJump)
        vehicle.clock.jump(round(fault.by_s * 1e6), round(vehicle.state.time_s * 1e6))
        return fault.by_s

    def _reboot(self, occurrence: Occurrence, vehicle: Vehicle) -> float:
        self._boots += 1
        self.estimate.forget()
        vehicle.reboot()
        return float(self._boots)

    def _change_mode(self, occurrence: Occurrence, vehicle: Vehicle) -> float:
        fault = occurrence.fault
        assert isinstance(fault, ModeChange)
        number = _number(self._flavour, fault)
        if fault.by == "rc":
            vehicle.autopilot.receive_sticks(number)
        else:
            vehicle.autopilot.receive_command(mode_command(self._flavour, number))
        return float(number)

    def _disarm(self, occurrence: Occurrence, vehicle: Vehicle) -> float:
        parameters = (0.0, _FORCE, nan, nan, nan, nan, nan)
        vehicle.autopilot.receive_command(Command(_CMD_ARM, parameters))
        return 1.0

    def _empty(self, occurrence: Occurrence, vehicle: Vehicle) -> float:
        fault = occurrence.fault
        assert isinstance(fault, BatteryLow)
        self.battery.report(fault.remaining, vehicle.state)
        return fault.remaining


def _number(flavour: str, fault: ModeChange) -> int:
    name = next(name for known, name in fault.mode.items() if known == flavour)
    return mode_number(flavour, name)


def _refuse_unknown_modes(faults: Faults) -> None:
    """Refuse a mode that there is not, whichever autopilot flies.

    Raises:
        DataFileError: it names the key and the modes that there are.
    """
    for index, fault in enumerate(faults.vehicle):
        if not isinstance(fault, ModeChange):
            continue
        for flavour in flavours():
            if flavour in fault.mode:
                try:
                    _number(flavour, fault)
                except ValueError as error:
                    raise DataFileError(
                        f"faults '{faults.name}': 'vehicle.{index}.mode.{flavour}': {error}"
                    ) from None
