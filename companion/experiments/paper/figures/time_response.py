"""Position over time along trajectory 4: who lags."""

from matplotlib.figure import Figure

from companion.experiments.paper.results import PaperResults
from companion.experiments.paper.tracking import SHOWN
from companion.report.pages.style import (
    AXES,
    COLOURS,
    SHOULD_BE,
    name_of,
    new_figure,
    say,
    thin,
)

_CONTROLLERS = ("pid-l1", "lqr-l1", "mpc-l1")


def caption(results: PaperResults) -> str:
    """What is drawn."""
    responses = results.tracking.responses
    lags = ", ".join(
        f"{name_of(name)} {responses[name].lag_s:.2f} s"
        for name in _CONTROLLERS
        if name in responses
    )
    return (
        f"True position in metres over time on trajectory {SHOWN} in calm air, seed "
        f"{results.scale.seeds[0]}, with the desired one (dashed). The lag is the shift in time of "
        f"the desired path that brings it closest to the flown one: {lags or 'none flown'}. "
        "PID-L1 and LQR-L1 know the present desired position only, MPC-L1 the next second of it."
    )


def draw(results: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(5.6)
    responses = results.tracking.responses
    shown = [name for name in _CONTROLLERS if name in responses]
    if not shown:
        say(figure.add_subplot(), "none of the three flights could be flown")
        return figure
    rows = figure.subplots(3, 1, sharex=True)
    for k, axes in enumerate(rows):
        for name in shown:
            response = responses[name]
            label = f"{name_of(name)}, {response.lag_s:.2f} s late"
            axes.plot(
                *thin(response.times_s, response.position_m[:, k]),
                color=COLOURS[name],
                lw=1.5,
                label=label,
            )
        longest = max((responses[name] for name in shown), key=lambda r: len(r.times_s))
        axes.plot(*thin(longest.times_s, longest.desired_m[:, k]), **SHOULD_BE, label="desired")
        axes.set_title(f"{AXES[k]}, m")
        axes.margins(x=0.01)
    rows[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, borderaxespad=0.1)
    rows[-1].set_xlabel("time since the trajectory's start, s")
    return figure
