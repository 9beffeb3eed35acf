"""The second-order model of MPC-PID, identified again by steps: how well it describes it."""

from companion.experiments.flight_task import FlightTask
from companion.experiments.identify_steps import SecondOrder, StepTask, identify
from companion.experiments.paper.scale import VEHICLE
from companion.experiments.workers import Failure, Workers

_SEED = 1


def identify_models(jobs: int) -> tuple[SecondOrder, ...]:
    """Models of x, y and z under the PID alone; empty if one of them could not be found."""
    steps = [StepTask(FlightTask("pid", 4, seed=_SEED, vehicle=VEHICLE), axis) for axis in range(3)]
    with Workers(identify, min(jobs, len(steps))) as workers:
        results = workers.run(steps, lambda *_: None)
    models = [result for result in results if not isinstance(result, Failure)]
    return tuple(models) if len(models) == len(steps) else ()
