"""Every figure of the study, in the order of the page.  A new one is a module and a line here."""

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.figure import Figure

from companion.experiments.paper.figures import (
    adaptation_rate,
    bounds,
    computing_time,
    errors_fan,
    errors_feedback,
    hover_convergence,
    mass_step,
    model_transfer,
    origin,
    reference_system,
    time_response,
    trajectories,
)
from companion.experiments.paper.results import PaperResults


@dataclass(frozen=True, slots=True)
class Drawing:
    """One figure, not yet drawn."""

    name: str
    """Of its files."""
    title: str
    caption: Callable[[PaperResults], str]
    draw: Callable[[PaperResults], Figure]


DRAWINGS = (
    Drawing("trajectories", "The five test trajectories", trajectories.caption, trajectories.draw),
    Drawing("bounds", "The L1 controller's bounds", bounds.caption, bounds.draw),
    Drawing(
        "errors_feedback",
        "Looking ahead against feeding back",
        errors_feedback.caption,
        errors_feedback.draw,
    ),
    Drawing(
        "time_response",
        "Position over time on trajectory 4",
        time_response.caption,
        time_response.draw,
    ),
    Drawing("errors_fan", "With and without the fan", errors_fan.caption, errors_fan.draw),
    Drawing(
        "adaptation_rate",
        "Estimation error against the adaptation rate",
        adaptation_rate.caption,
        adaptation_rate.draw,
    ),
    Drawing(
        "reference_system",
        "Velocity beside the closed-loop reference system",
        reference_system.caption,
        reference_system.draw,
    ),
    Drawing(
        "model_transfer",
        "A model tuned for one trajectory, on the others",
        model_transfer.caption,
        model_transfer.draw,
    ),
    Drawing("mass_step", "A load taken up in flight", mass_step.caption, mass_step.draw),
    Drawing(
        "hover_convergence",
        "Adaptation in a hover, without excitation",
        hover_convergence.caption,
        hover_convergence.draw,
    ),
    Drawing("origin", "The laboratory's origin moved", origin.caption, origin.draw),
    Drawing(
        "computing_time",
        "Computing time, linear and nonlinear",
        computing_time.caption,
        computing_time.draw,
    ),
)


def drawing(name: str) -> Drawing:
    """A figure by its name."""
    return next(one for one in DRAWINGS if one.name == name)
