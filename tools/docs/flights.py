"""Short flights in lockstep, with their records as arrays."""

from collections.abc import Mapping
from typing import Any

from companion.experiments.flight_task import FlightTask, load_task
from companion.experiments.fly_task import fly_loaded
from companion.experiments.memory_log import MemoryLog
from companion.flight.assemble import make_trajectory
from companion.flight.conduct import Outcome
from companion.report.flight_data import FlightData


class _KeepingLog(MemoryLog):
    """A log in memory that lends the controller's records as they came."""

    def __init__(self) -> None:
        super().__init__()
        self.control: list[Mapping[str, Any]] = []

    def record(self, topic: str, time_s: float, values: Mapping[str, Any]) -> None:
        """Keep a record of the controller, as it is and for the arrays."""
        super().record(topic, time_s, values)
        if topic == "control":
            self.control.append(values)


def fly(
    trajectory: int | str,
    settings: Mapping[str, str] | None = None,
    **more: Any,  # noqa: ANN401
) -> tuple[Outcome, FlightData, list[Mapping[str, Any]]]:
    """Fly `mpc-l1` on the `bebop2`, beginning in the air.

    Args:
        trajectory: 1 … 5, or a file.
        settings: dotted keys and YAML texts, as ``--set`` takes them.
        **more: of `FlightTask`.

    Returns:
        How it ended, its data, and the records of the channel `control`.
    """
    chosen = {"controller": "mpc-l1", "vehicle": "bebop2", "seed": 1, **more}
    task = FlightTask(trajectory=trajectory, settings=tuple((settings or {}).items()), **chosen)
    loaded = load_task(task)
    log = _KeepingLog()
    outcome = fly_loaded(
        loaded, make_trajectory(loaded.config.mission), log, airborne=task.airborne
    )
    return outcome, log.data(), log.control
