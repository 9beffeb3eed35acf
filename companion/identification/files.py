"""All that an identification writes beside its log, and the order in which it is derived."""

from dataclasses import dataclass
from pathlib import Path

from companion.config.models import ControllerConfig, VehicleConfig
from companion.config.relief import NO_FALLBACK
from companion.identification.controller_files import write_mpc_l1, write_mpc_l1_plus
from companion.identification.estimates import Identified
from companion.identification.figure import draw_identification
from companion.identification.recommend import Recommendation, method_source, recommend
from companion.identification.recommend_plus import recommend_plus
from companion.identification.recommend_search import NothingHoldsError
from companion.identification.vehicle_file import write_vehicle

VEHICLE_NAME, FIGURE_NAME = "vehicle.yaml", "identify.png"
MPC_L1_NAME, MPC_L1_PLUS_NAME = "mpc-l1.yaml", "mpc-l1-plus.yaml"


@dataclass(frozen=True, slots=True)
class WrittenFiles:
    """What was written, and what of."""

    vehicle: VehicleConfig
    recommendation: Recommendation | None
    """None where no gains of `mpc-l1` hold; there is no file of it then."""
    note: str
    """Why there are no gains; empty where there are."""
    paths: tuple[Path, ...]
    plus: ControllerConfig
    """Gains of `mpc-l1-plus`, which falls back to those of `mpc-l1` where there are any."""


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
    recommendation, note = None, ""
    try:
        recommendation = recommend(
            vehicle,
            climb_rate_field=climb_rate_field,
            shaped_commands=climb_rate_field if shaped_commands is None else shaped_commands,
            state_rate_hz=state_rate_hz,
        )
    except NothingHoldsError as error:
        note = str(error)
    else:
        write_mpc_l1(recommendation, vehicle.name, folder / MPC_L1_NAME)
        paths.append(folder / MPC_L1_NAME)
    plus = recommend_plus(
        vehicle,
        method_source(vehicle),
        climb_rate_field=climb_rate_field,
        fallback=NO_FALLBACK if recommendation is None else MPC_L1_NAME,
    )
    write_mpc_l1_plus(plus, vehicle.name, folder / MPC_L1_PLUS_NAME)
    paths.append(folder / MPC_L1_PLUS_NAME)
    return WrittenFiles(vehicle, recommendation, note, tuple(paths), plus)
