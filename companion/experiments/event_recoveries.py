"""What a comparison's flights made of the sudden events of their scenarios."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from companion.experiments.compare import summaries_by_task
from companion.experiments.flight_store import Summary, flight_path, read_flight_table
from companion.experiments.flight_table import FlightTable
from companion.experiments.flight_task import FlightTask
from companion.report.compare_results import NOMINAL
from companion.report.flight_data import Array
from companion.report.recovery import GOOD, recovery
from companion.report.recovery_cell import RecoveryCell, recovery_cell
from companion.report.recovery_figure import RecoveryCurve, draw_recoveries

Place = tuple[str, str, str]
"""Label of the controller, wind and perturbation."""
_POSITIONS = {"truth": "true_position", "reported": "position"}


@dataclass(frozen=True, slots=True)
class EventFlights:
    """The flights of one place that came as far as their event."""

    place: Place
    event: str
    """In words."""
    flown: int
    curves: tuple[RecoveryCurve, ...]

    @property
    def cell(self) -> RecoveryCell:
        """Their figures."""
        return recovery_cell(
            self.place, self.event, self.flown, [curve.recovery for curve in self.curves]
        )


def event_flights(
    planned: Mapping[Place, Sequence[FlightTask]],
    summaries: Mapping[str, Summary],
    folder: Path,
    against: str,
) -> tuple[EventFlights, ...]:
    """Read the kept flights of those places whose scenario has an event.

    Args:
        planned: the flights of each place.
        summaries: their figures by key.
        folder: of the campaign.
        against: "truth" or "reported".

    Raises:
        OSError: a kept flight can't be read.
        ValueError: it is damaged.
    """
    by_task = summaries_by_task(planned, summaries)
    found: list[EventFlights] = []
    for place, tasks in planned.items():
        flown = [by_task[task] for task in tasks]
        event = next((summary.event for summary in flown if summary.event), "")
        tables = (
            read_flight_table(flight_path(folder, summary.key))
            for summary in flown
            if summary.event
        )
        curves = (table_curve(table, place[0], against) for table in tables)
        known = tuple(curve for curve in curves if curve is not None)
        if known:
            found.append(EventFlights(place, event, len(flown), known))
    return tuple(found)


def table_curve(table: FlightTable, label: str, against: str) -> RecoveryCurve | None:
    """A flight about its event; None if it has none, or was lost before.

    Args:
        table: of the flight.
        label: of its controller.
        against: "truth" or "reported".
    """
    columns = table.columns
    if not table.event or not len(columns):
        return None
    times = columns["time_s"]
    use = (times >= 0.0) & (times <= table.scored_s)
    error: Array = np.stack(
        [
            columns[f"{_POSITIONS[against]}_{axis}_m"] - columns[f"desired_{axis}_m"]
            for axis in "xyz"
        ],
        axis=1,
    ).astype(float)[use]
    figures = recovery(
        times[use], error, table.event_s, end_s=table.scored_s, lost=table.outcome not in GOOD
    )
    if figures is None:
        return None
    since: Array = times[use] - table.event_s
    tilt: Array = np.hypot(columns["roll_rad"], columns["pitch_rad"])[use]
    return RecoveryCurve(label, since, error, since, tilt, columns["thrust"][use], figures)


def draw_events(found: Sequence[EventFlights], about: str, folder: Path) -> list[Path]:
    """Draw `recovery-WIND.png` for each wind with an event: all controllers, nothing perturbed.

    Args:
        found: the flights.
        about: what they have in common.
        folder: of the pictures.

    Raises:
        OSError: a picture can't be written.
    """
    nominal = [flights for flights in found if flights.place[2] == NOMINAL]
    paths: list[Path] = []
    for wind in dict.fromkeys(flights.place[1] for flights in nominal):
        those = [flights for flights in nominal if flights.place[1] == wind]
        curves = [curve for flights in those for curve in flights.curves]
        paths.append(folder / f"recovery-{Path(wind).stem}.png")
        draw_recoveries(curves, f"{those[0].event}, {about}", paths[-1])
    return paths
