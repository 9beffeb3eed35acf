"""Whether the autopilot's estimator would use the poses that motion capture sends it."""

from collections.abc import Mapping

from companion.mocap.parameters import Autopilot, Misfit, misfits, parameter_names
from companion.preflight.finding import Finding, ParameterChange, Verdict

PARAMETERS: dict[str, tuple[str, ...]] = {
    "px4": parameter_names("px4"),
    "ardupilot": parameter_names("ardupilot"),
}
_AFTER_A_RESTART = ("VISO_TYPE",)
"""Setting these for one flight does nothing for it."""


def judge_mocap(autopilot: Autopilot, parameters: Mapping[str, float]) -> list[Finding]:
    """A finding for each parameter that does not fit; belongs to missions with `mocap`."""
    found = [_finding(misfit) for misfit in misfits(autopilot, parameters)]
    return found or [Finding("motion capture", "the estimator is set to use its poses")]


def _finding(misfit: Misfit) -> Finding:
    if misfit.value is None:
        return Finding(
            misfit.name,
            f"could not be read: {misfit.why}",
            Verdict.WARNING,
            f"It should be {misfit.wanted:g}. Is this build made for motion capture?",
        )
    change = None
    if misfit.name not in _AFTER_A_RESTART:
        change = ParameterChange(misfit.name, misfit.value, misfit.wanted, misfit.why)
    restart = "" if change else ", and restart the autopilot"
    return Finding(
        misfit.name,
        f"{misfit.value:g}: {misfit.why}",
        Verdict.WARNING,
        f"Set {misfit.wanted:g}{restart}.",
        change,
    )
