"""The figure-eight over a link with more and more delay, with the state carried over it and not."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

from companion.control.frameworks import Reference, Stack, StackMemory, Tick
from companion.report.metrics import tracking_figures
from tools.docs.flights import fly
from tools.docs.style import FLOWN, OTHER, QUIET, panels, save

_MORE_MS = (0, 10, 20, 30, 40, 50)
"""Delay beside the vehicle's own, there and back together."""
_OWN_MS = 30
_LOST_MM = 400.0

_step = Stack.step


def _as_measured(self: Stack, memory: StackMemory, tick: Tick, reference: Reference) -> Any:  # noqa: ANN401 - as the step
    """The stack's step for which what is decided acts at once."""
    return _step(self, memory, replace(tick, loop_delay_s=0.0), reference)


def mean_error_mm(more_ms: int, *, carried: bool) -> float:
    """Mean error of the figure-eight against the truth; infinite where it was not flown whole."""
    delay_s = more_ms * 1e-3 / 2.0
    faults = f"{{name: delay, link: [{{way: both, delay_s: {delay_s}}}]}}" if more_ms else None
    settings = {"monitor.act": "false"}
    if carried:
        outcome, data, _ = fly(4, settings, faults=faults)
    else:
        with mock.patch.object(Stack, "step", _as_measured):
            outcome, data, _ = fly(4, settings, faults=faults)
    if not outcome.completed or outcome.scored_s is None:
        return math.inf
    against_truth = tracking_figures(data, outcome.scored_s).against_truth
    return math.inf if against_truth is None else 1e3 * against_truth.mean_m


def draw(folder: Path) -> list[Path]:
    """Fly them all and draw the errors; returns the picture's path."""
    figure, axes = panels(1, 1, (6.4, 3.6))
    for carried, colour, name in (
        (False, OTHER, "planned from the state as measured"),
        (True, FLOWN, "planned from the state carried over the delay"),
    ):
        errors = [mean_error_mm(more, carried=carried) for more in _MORE_MS]
        flown = [(m + _OWN_MS, e) for m, e in zip(_MORE_MS, errors, strict=True) if e < _LOST_MM]
        lost = [m + _OWN_MS for m, e in zip(_MORE_MS, errors, strict=True) if e >= _LOST_MM]
        axes.plot(*zip(*flown, strict=True), "o-", color=colour, label=name)
        if lost:
            axes.plot(lost, [_LOST_MM] * len(lost), "x", color=colour, ms=9, mew=2)
            axes.annotate(
                "lost",
                (lost[0], _LOST_MM),
                xytext=(8, -3),
                textcoords="offset points",
                color=colour,
            )
    axes.set_yscale("log")
    axes.set_yticks([10, 20, 50, 100, 200, 400], ["10", "20", "50", "100", "200", "400"])
    axes.minorticks_off()
    axes.set_xlabel("delay of the whole loop, ms")
    axes.set_ylabel("mean error on the figure-eight, mm")
    axes.axvline(_OWN_MS, color=QUIET, lw=0.8, ls=":")
    axes.text(_OWN_MS + 0.6, 300, "the link as it is", color=QUIET, fontsize=8.5)
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, 0.9))
    says = "The error over the loop's delay: carried over the delay, the state keeps it small."
    return [save(figure, folder / "how-delay.svg", says)]
