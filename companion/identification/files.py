"""All that an identification writes beside its log, and the order in which it is derived."""

from dataclasses import dataclass
from pathlib import Path

from companion.config.models import VehicleConfig
from companion.identification.controller_files import write_mpc_l1
from companion.identification.estimates import Identified
from companion.identification.figure import draw_identification
from companion.identification.recommend import Recommendation, recommend
from companion.identification.recommend_search import NothingHoldsError
from companion.identification.vehicle_file import write_vehicle

VEHICLE_NAME, MPC_L1_NAME, FIGURE_NAME = "vehicle.yaml", "mpc-l1.yaml", "identify.png"


@dataclass(frozen=True, slots=True)
class WrittenFiles:
    """What was written, and what of."""

    vehicle: VehicleConfig
    recommendation: Recommendation | None
    """None where no gains of `mpc-l1` hold; there is no file of it then."""
    note: str
    """Why there are no gains; empty where there are."""
    paths: tuple[Path, ...]


def write_files(
    identified: Identified,
    base: VehicleConfig,
    folder: Path,
    *,
    source: str,
    climb_rate_field: bool,
    shaped_commands: bool | None = None,
    state_rate_hz: float = 100.0,
) -> WrittenFiles:
    """Write the vehicle's file, its picture, and the gains that suit it; about half a minute.

    Args:
        identified: what was found.
        base: the vehicle's name and limits.
        folder: exists.
        source: when and how it was identified.
        climb_rate_field: whether the autopilot takes a climb rate in its thrust field.
        shaped_commands: whether it shapes the commanded attitude, as ArduCopter does;
            by default where it takes a climb rate, which is its default, too.
        state_rate_hz: of the state's samples that it will be flown with.

    Raises:
        OSError: something can't be written.
    """
    vehicle = write_vehicle(identified, base, folder / VEHICLE_NAME, source)
    title = f"{vehicle.name}: identified, residuals below"
    draw_identification(identified, title, folder / FIGURE_NAME)
    paths = [folder / VEHICLE_NAME, folder / FIGURE_NAME]
    try:
        recommendation = recommend(
            vehicle,
            climb_rate_field=climb_rate_field,
            shaped_commands=climb_rate_field if shaped_commands is None else shaped_commands,
            state_rate_hz=state_rate_hz,
        )
    except NothingHoldsError as error:
        return WrittenFiles(vehicle, None, str(error), tuple(paths))
    write_mpc_l1(recommendation, vehicle.name, folder / MPC_L1_NAME)
    return WrittenFiles(vehicle, recommendation, "", (*paths, folder / MPC_L1_NAME))
