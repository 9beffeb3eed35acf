"""All that an identification writes beside its log: first derived, then written all at once."""

from collections.abc import Callable
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
from companion.identification.vehicle_file import identified_vehicle, write_vehicle
from companion.recording.whole_file import made_whole

VEHICLE_NAME, FIGURE_NAME = "vehicle.yaml", "identify.png"
MPC_L1_NAME, MPC_L1_PLUS_NAME = "mpc-l1.yaml", "mpc-l1-plus.yaml"


@dataclass(frozen=True, slots=True)
class Derived:
    """What is to be written, and what of."""

    identified: Identified
    base: VehicleConfig
    source: str
    vehicle: VehicleConfig
    recommendation: Recommendation | None
    """None where no gains of `mpc-l1` hold; there is no file of it then."""
    note: str
    """Why there are no gains; empty where there are."""
    plus: ControllerConfig
    """Gains of `mpc-l1-plus`, which falls back to those of `mpc-l1` where there are any."""


def derive(
    identified: Identified,
    base: VehicleConfig,
    *,
    source: str,
    climb_rate_field: bool,
    shaped_commands: bool | None = None,
    state_rate_hz: float = 100.0,
    progress: Callable[[int, int], None] | None = None,
) -> Derived:
    """Derive the vehicle and the gains that suit it; about half a minute.

    Args:
        identified: what was found.
        base: the vehicle's name and limits.
        source: when and how it was identified.
        climb_rate_field: whether the autopilot takes a climb rate in its thrust field.
        shaped_commands: whether it shapes the commanded attitude, as ArduCopter does;
            by default where it takes a climb rate, which is its default, too.
        state_rate_hz: of the state's samples that it will be flown with.
        progress: told how many rounds of the search are done, and of how many.
    """
    vehicle = identified_vehicle(identified, base, source)
    recommendation, note = None, ""
    try:
        recommendation = recommend(
            vehicle,
            climb_rate_field=climb_rate_field,
            shaped_commands=climb_rate_field if shaped_commands is None else shaped_commands,
            state_rate_hz=state_rate_hz,
            progress=progress,
        )
    except NothingHoldsError as error:
        note = str(error)
    plus = recommend_plus(
        vehicle,
        method_source(vehicle),
        climb_rate_field=climb_rate_field,
        fallback=NO_FALLBACK if recommendation is None else MPC_L1_NAME,
    )
    return Derived(identified, base, source, vehicle, recommendation, note, plus)


def write_files(derived: Derived, folder: Path) -> tuple[Path, ...]:
    """Write the vehicle's file, its picture and the gains, each whole.

    Controllers that stand there from an identification before are of another vehicle: they go
    first, so that none is ever beside a vehicle's file that it does not belong to.

    Args:
        derived: by `derive`.
        folder: exists.

    Returns:
        The files.

    Raises:
        OSError: something can't be written.
    """
    for name in (MPC_L1_PLUS_NAME, MPC_L1_NAME):
        (folder / name).unlink(missing_ok=True)
    vehicle = derived.vehicle
    title = f"{vehicle.name}: identified, residuals below"
    write_vehicle(derived.identified, derived.base, folder / VEHICLE_NAME, derived.source)
    made_whole(
        folder / FIGURE_NAME, lambda path: draw_identification(derived.identified, title, path)
    )
    paths = [folder / VEHICLE_NAME, folder / FIGURE_NAME]
    if derived.recommendation is not None:
        write_mpc_l1(derived.recommendation, vehicle.name, folder / MPC_L1_NAME)
        paths.append(folder / MPC_L1_NAME)
    write_mpc_l1_plus(derived.plus, vehicle.name, folder / MPC_L1_PLUS_NAME)
    paths.append(folder / MPC_L1_PLUS_NAME)
    return tuple(paths)
