"""What is said of a tuning: in the controller's file, and to the person who asked for it."""

from collections.abc import Sequence
from pathlib import Path

from companion.experiments.flight_task import FlightTask
from companion.experiments.identify_steps import SecondOrder
from companion.experiments.tuning import TuningResult

_AXES = ("x", "y", "z")


def said_name(name_or_path: str) -> str:
    """As it is said to others, who have not our folders."""
    return Path(name_or_path).name


def cost_in_words(task: FlightTask, attitude_lag: float | None) -> str:
    """What the search makes least; with the further vehicle's lag, as a factor."""
    error = (
        f"the mean true error on trajectory {said_name(str(task.trajectory))}, {task.wind}, "
        f"seed {task.seed}, airborne"
    )
    if attitude_lag is None:
        return error
    return (
        f"{error}: the larger of that of the vehicle and of one with {attitude_lag - 1.0:.0%} more "
        "attitude lag"
    )


def source_text(
    command: str, cost: str, result: TuningResult, models: Sequence[SecondOrder]
) -> str:
    """Where the numbers came from, without a date: the same command gives the same text.

    Args:
        command: the command line.
        cost: what the search made least.
        result: what it found.
        models: per axis, if any were identified with the tuned PID.
    """
    ends = "; ".join(
        f"from the {start.name} start {start.first_cost_m * 1e3:.1f} → "
        f"{start.best.evaluation.cost_m * 1e3:.1f} mm in {start.evaluations} sets of gains"
        for start in result.starts
    )
    text = f"{command}. CMA-ES on {cost}: {ends}."
    if not models:
        return text
    fits = ", ".join(
        f"{axis} ω {model.natural_frequency_rad_s:.2f} rad/s ζ {model.damping:.2f} "
        f"(misfit {model.misfit_rms_m * 1e3:.0f} mm rms of a step of {model.step_m:g} m)"
        for axis, model in zip(_AXES, models, strict=True)
    )
    return (
        f"{text} That tuned the PID alone (r2 = y2*). Model identified from separate steps of r2 "
        f"with it: {fits}. The MPC is that of mpc-l1."
    )


def result_lines(result: TuningResult, models: Sequence[SecondOrder]) -> list[str]:
    """The result for a terminal, line by line."""
    lines = [f"cost      {result.best.evaluation.cost_m * 1e3:.1f} mm"]
    lines += [
        f"start     {start.name}: {start.first_cost_m * 1e3:.1f} → "
        f"{start.best.evaluation.cost_m * 1e3:.1f} mm in {start.evaluations} evaluations"
        for start in result.starts
    ]
    lines += [f"gains     {key} {list(values)}" for key, values in result.best.gains.items()]
    lines += [
        f"model {axis}   ω {model.natural_frequency_rad_s:.3f} rad/s, ζ {model.damping:.3f}, "
        f"misfit {model.misfit_rms_m * 1e3:.1f} mm rms of a step of {model.step_m:g} m"
        for axis, model in zip(_AXES, models, strict=False)
    ]
    return lines
