"""Figures to files: PNG, and SVG whose letters are letters."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg

from companion.experiments.paper.figures.registry import DRAWINGS, drawing
from companion.experiments.paper.results import PaperResults
from companion.report.pages.style import SETTINGS
from companion.report.pages.svg import svg_text

FOLDER = "figures"
_DPI = 150
_PAYS_FROM = 4
_SLOW = ("trajectories", "bounds", "reference_system")
"""First in the order, so that they are dealt out evenly."""


@dataclass(frozen=True, slots=True)
class DrawnFigure:
    """A figure and its files."""

    name: str
    title: str
    caption: str
    png: Path
    svg: Path


def draw_figures(results: PaperResults, folder: Path, jobs: int = 1) -> list[DrawnFigure]:
    """Draw every figure of the study into `folder/figures`, as PNG and as SVG.

    Args:
        results: of the study.
        folder: of the study; `figures` is made in it.
        jobs: how many processes; with fewer than four, this one does it: to start others takes
            as long as they would save (two seconds each, and drawing takes four).

    Returns:
        The figures in the order of the page.

    Raises:
        OSError: a file can't be written.
    """
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    names = [one.name for one in DRAWINGS]
    order = sorted(names, key=lambda name: name not in _SLOW)
    if jobs < _PAYS_FROM:
        drawn = [draw_one(results, name, folder) for name in order]
    else:
        drawn = _in_processes(results, order, folder, min(jobs, len(order)))
    by_name = {one.name: one for one in drawn}
    return [by_name[name] for name in names]


def draw_one(results: PaperResults, name: str, folder: Path) -> DrawnFigure:
    """Draw one figure into `folder/figures`."""
    one = drawing(name)
    png, svg = (folder / FOLDER / f"{name}.{kind}" for kind in ("png", "svg"))
    with mpl.rc_context(SETTINGS):
        figure = one.draw(results)
        FigureCanvasAgg(figure)
        figure.savefig(png, dpi=_DPI, metadata={"Software": None})
        figure.set_layout_engine("none")  # places stay as they are: half the work the second time
        svg.write_text(svg_text(figure), encoding="utf-8")
    return DrawnFigure(name, one.title, one.caption(results), png, svg)


def _in_processes(
    results: PaperResults, names: Sequence[str], folder: Path, jobs: int
) -> list[DrawnFigure]:
    shares = [names[k::jobs] for k in range(jobs)]
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        drawn = pool.map(_draw_share, [results] * jobs, shares, [folder] * jobs)
        return [figure for share in drawn for figure in share]


def _draw_share(results: PaperResults, names: Sequence[str], folder: Path) -> list[DrawnFigure]:
    return [draw_one(results, name, folder) for name in names]
