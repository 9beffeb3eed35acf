"""MPC above L1 and above PID, with and without the fan."""

import math
from collections.abc import Sequence

from matplotlib.figure import Figure

from companion.experiments.paper.figures.bars import Bar, Series, bar_of, draw_bars
from companion.experiments.paper.results import PaperResults
from companion.experiments.paper.scale import TRAJECTORIES
from companion.experiments.paper.statistics import Spread, spread
from companion.experiments.paper.tracking import Errors
from companion.report.pages.style import (
    COLOURS,
    MPC_L1_FAN,
    MPC_PID_FAN,
    MPC_PID_JOINT_FAN,
    legend_above,
    name_of,
    new_figure,
    seeds_text,
)
from companion.trajectories.harmonic import TEST_TRAJECTORIES

_CONTROLLERS = ("mpc-pid", "mpc-pid-joint", "mpc-l1")
_PAIRS = (("mpc-pid", "mpc-l1"), ("mpc-pid-joint", "mpc-l1"))
_FAN_COLOURS = {
    "mpc-pid": MPC_PID_FAN,
    "mpc-pid-joint": MPC_PID_JOINT_FAN,
    "mpc-l1": MPC_L1_FAN,
}
_MM = 1e3


def caption(results: PaperResults) -> str:
    """What is drawn."""
    said = []
    for name in _CONTROLLERS:
        more = increase(results, name)[-1]
        text = f"{more.mean * _MM:.1f} mm" if math.isfinite(more.mean) else "not defined"
        said.append(f"{name_of(name)} {text}")
    return (
        "The mean distance |y2* − y2| in millimetres, true, of MPC-PID (blue) and MPC-L1 (red) in "
        "calm air (strong) and with the fan's jet across the path (pale). Above, MPC-PID by the "
        "paper's recipe: the PID is tuned alone on trajectory 4, its model is identified from "
        "steps, and the MPC of MPC-L1 is put on top. In the middle, the same structure with PID "
        "and model tuned as a whole, under the MPC, on trajectory 4. Below, what the fan adds, "
        f"seed by seed; {seeds_text(results.scale.seeds)}. On average that is: "
        f"{', '.join(said)}. A bar below zero says that the fan happened to "
        "push towards the path."
    )


def draw(results: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(8.6)
    *errors, increases = figure.subplots(3, 1)
    groups = [TEST_TRAJECTORIES[number].name for number in TRAJECTORIES] + ["mean of the five"]
    for axes, pair in zip(errors, _PAIRS, strict=True):
        series = []
        for name in pair:
            by_wind = results.tracking.errors[name]
            calm, fan = (_bars(by_wind[wind]) for wind in ("calm", "fan"))
            series += [
                Series(f"{name_of(name)}, calm", COLOURS[name], calm),
                Series(f"{name_of(name)}, fan", _FAN_COLOURS[name], fan),
            ]
        draw_bars(axes, groups, series, letters=7.5)
        axes.set_title("mean error, mm")
        legend_above(axes)
    more = [
        Series(name_of(name), COLOURS[name], [bar_of(s, _MM) for s in increase(results, name)])
        for name in _CONTROLLERS
    ]
    draw_bars(increases, groups, more)
    increases.set_title("what the fan adds, mm")
    legend_above(increases)
    return figure


def increase(results: PaperResults, controller: str) -> list[Spread]:
    """Error with the fan minus without, by trajectory and at last of the mean, seed by seed, m."""
    calm, fan = (results.tracking.errors[controller][wind] for wind in ("calm", "fan"))
    pairs = [(fan.by_trajectory[n], calm.by_trajectory[n]) for n in TRAJECTORIES]
    return [spread(_differences(a.values, b.values)) for a, b in [*pairs, (fan.mean, calm.mean)]]


def _differences(fan: Sequence[float], calm: Sequence[float]) -> list[float]:
    """With one of a pair lost, the difference counts as lost."""
    return [
        a - b if math.isfinite(a) and math.isfinite(b) else math.inf
        for a, b in zip(fan, calm, strict=True)
    ]


def _bars(errors: Errors) -> list[Bar]:
    return [bar_of(s, _MM) for s in [*errors.by_trajectory.values(), errors.mean]]
