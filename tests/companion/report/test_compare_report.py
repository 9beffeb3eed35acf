import io
import itertools
import math
import re
import struct
from dataclasses import replace

import pytest
from rich.console import Console

from companion.report.compare_figure import draw_comparison
from companion.report.compare_record import comparison_object
from companion.report.compare_results import make_cell, ratio
from companion.report.compare_table import compare_table
from tests.companion.report.synthetic_comparison import (
    ERRORS_MM,
    LAG,
    NOMINAL,
    comparison,
    flown,
)


def test_the_mean_is_that_of_the_trajectories_and_its_spread_that_of_the_seeds():
    flights = [flown(t, s, mm) for t, s, mm in [(1, 1, 8), (2, 1, 12), (1, 2, 10), (2, 2, 18)]]
    cell = make_cell("a", "calm", "nominal", flights)
    assert cell.by_trajectory_m == pytest.approx({"1": 0.009, "2": 0.015})
    assert cell.mean_error_m == pytest.approx(0.012)
    assert cell.spread_m == pytest.approx(0.002 * math.sqrt(2.0))
    assert cell.peak_height_error_m == 0.02
    assert cell.lost == 0


def test_a_lost_flight_leaves_no_mean_and_one_seed_no_spread():
    cell = make_cell("a", "calm", "nominal", [flown(1, 1, 8), flown(2, 1, math.inf)])
    assert cell.lost == 1
    assert math.isinf(cell.mean_error_m)
    assert math.isnan(make_cell("a", "calm", "nominal", [flown(1, 1, 8)]).spread_m)


def test_a_flight_that_tracked_and_then_did_not_land_is_lost():
    assert flown(1, 1, 8).lost is False
    assert replace(flown(1, 1, 8), outcome="aborted").lost
    assert not replace(flown(1, 1, 8), outcome="landed").lost


def test_ratios_are_to_the_first_controller_and_to_the_own_nominal_error():
    made = comparison()
    cell = made.cell("mpc-l1-plus", "fan", "lag+50")
    assert made.to_nominal(cell) == pytest.approx(35 / 9)
    assert math.isnan(made.to_first(cell))  # the first one lost a flight there
    assert made.to_first(made.cell("mpc-l1-plus", "calm", "lag+25")) == pytest.approx(0.2)
    assert math.isnan(ratio(1.0, math.inf))


def test_what_is_borne_depends_on_the_perturbation():
    made = comparison()
    borne = {
        (cell.controller, cell.wind, cell.perturbation): made.bears(cell) for cell in made.cells
    }
    assert borne["mpc-l1", "calm", "lag+25"]
    assert not borne["mpc-l1", "calm", "lag+50"]  # lost
    assert borne["mpc-l1-plus", "fan", "lag+50"]  # 3.9 of 4
    assert not borne["mpc-l1-plus", "calm", "lag+50"]  # 6 of 4
    assert borne["mpc-l1", "fan", "nominal"]


def printed(made, width=80):
    console = Console(file=io.StringIO(), width=width)
    console.print(compare_table(made))
    return console.file.getvalue()


def rows_of(text):
    """Cells of the rows of its tables, by table; heads and titles are no rows."""
    blocks = re.split(r"\n *\n", text)
    return [
        [re.split(r"\s{2,}", line.strip()) for line in block.splitlines() if "mpc-l1" in line]
        for block in blocks
    ]


def test_the_table_has_a_row_a_cell_and_names_what_was_lost():
    text = printed(comparison())
    rows = rows_of(text)[0]
    assert len(rows) == 12
    assert rows[0][:3] == ["calm", "nominal", "mpc-l1"]
    assert rows[3] == ["mpc-l1-plus", "6.0 ± 0.4", "0.20", "1.20", "0.30", "1.0", "20"]
    assert rows[4][2:] == ["mpc-l1", "lost 1 of 4", "–", "0.30", "20"]
    assert "mpc-l1, calm, lag+50, trajectory 5 (seed 2): The geofence was left." in text
    assert "flights: 46 tracked, 2 aborted" in text


def test_what_each_trajectory_gave_is_a_table_of_its_own():
    rows = rows_of(printed(comparison()))[1]
    assert len(rows) == 12
    assert rows[3] == ["mpc-l1-plus", "5.7", "6.3"]


@pytest.mark.parametrize("width", [60, 80])
def test_the_table_fits_a_terminal_and_cuts_nothing_off(width):
    text = printed(comparison(), width)
    assert max(len(line) for line in text.splitlines()) <= width
    assert "…" not in text


def test_the_table_leaves_out_what_there_is_not():
    alone = printed(comparison({("mpc-l1", "calm"): (20.0,)}, (NOMINAL,)))
    assert "nominal" not in alone
    assert "first" not in alone


@pytest.fixture
def texts(monkeypatch):
    """What stands on the figures that are drawn."""
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    found = []
    original = Figure.savefig

    def savefig(self, *arguments, **options):
        original(self, *arguments, **options)
        found.append(
            [t for t in self.findobj(Text) if t.get_text() and t.get_visible()]
            + [self.canvas.get_width_height()]
        )

    monkeypatch.setattr(Figure, "savefig", savefig)
    return found


def test_a_scenario_that_is_a_file_is_told_without_its_folder(tmp_path, texts):
    errors = {("mpc-l1", "a/long/way/storm.yaml"): (20.0, 25.0)}
    made = comparison(errors, (NOMINAL, LAG))
    draw_comparison(made, tmp_path / "compare.png")
    assert "storm" in [text.get_text() for text in texts[0][:-1]]
    assert rows_of(printed(made))[0][0][:2] == ["storm", "nominal"]


def test_the_record_is_plain_and_has_no_figure_where_there_is_none():
    record = comparison_object(comparison())
    lost = next(c for c in record["cells"] if c["lost"])
    assert lost["mean_error_m"] is None
    assert lost["flights"][3]["note"] == "The geofence was left."
    assert record["cells"][1]["ratio_to_nominal"] == pytest.approx(1.5)


CASES = {
    "perturbations and winds": comparison(),
    "winds alone": comparison(
        {key: errors[:1] for key, errors in ERRORS_MM.items()}, perturbations=(NOMINAL,)
    ),
    "one controller": comparison({("mpc-l1", "calm"): ERRORS_MM["mpc-l1", "calm"]}),
    "nothing but losses": comparison({("mpc-l1", "calm"): (math.inf,) * 3}),
}


@pytest.mark.parametrize("made", CASES.values(), ids=CASES)
def test_a_figure_is_a_thousand_pixels_wide_and_nothing_is_cut_off(tmp_path, made, texts, recwarn):
    path = tmp_path / "compare.png"

    draw_comparison(made, path)

    width, height = struct.unpack(">II", path.read_bytes()[16:24])
    assert width == 1000
    assert 200 < height < 1000
    assert [str(w.message) for w in recwarn] == []
    *drawn, _ = texts[0]
    for text in drawn:
        box = text.get_window_extent()
        assert box.x0 >= 0, text.get_text()
        assert box.x1 <= width, text.get_text()
        assert box.y0 >= 0, text.get_text()


@pytest.mark.parametrize(
    "errors_mm", [(20.0, 30.0), (20.0, 20.5), (0.6, 70.0), (9.99, 10.01), (1.0, 4000.0)]
)
@pytest.mark.parametrize("winds", [1, 3])
def test_a_scale_can_be_read_at_three_ticks_at_least(tmp_path, errors_mm, winds, monkeypatch):
    from matplotlib.figure import Figure

    figures = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: figures.append(self))
    errors = {("mpc-l1", f"wind{k}"): errors_mm for k in range(winds)}
    draw_comparison(comparison(errors, (NOMINAL, LAG)), tmp_path / "compare.png")
    (figure,) = figures
    figure.canvas.draw()
    assert len(figure.axes) == winds
    for axes in figure.axes:
        assert axes.get_xlabel() == "mm, logarithmic"
        low, high = axes.get_xlim()
        ticks = axes.get_xticks()
        assert sum(low <= tick <= high for tick in ticks) >= 3
        assert ticks[-1] > errors_mm[-1]
        boxes = [label.get_window_extent() for label in axes.get_xticklabels()]
        assert all(a.x1 < b.x0 for a, b in itertools.pairwise(boxes))


def test_one_trajectory_is_told_as_one(tmp_path, texts):
    draw_comparison(comparison(trajectories=("1",)), tmp_path / "one.png")
    draw_comparison(comparison(), tmp_path / "two.png")
    one, two = ([text.get_text() for text in drawn[:-1]] for drawn in texts)
    assert "bebop2, px4: mean tracking error, trajectory 1, 2 seeds" in one
    assert "bebop2, px4: mean tracking error, trajectories 4, 5, 2 seeds" in two


def test_the_figure_says_the_errors_the_factors_and_what_was_lost(tmp_path, texts):
    draw_comparison(comparison(), tmp_path / "compare.png")
    *drawn, _ = texts[0]
    said = {text.get_text().strip(): text for text in drawn}
    assert {"calm", "fan", "attitude lag + 25 %", "mpc-l1-plus"} <= said.keys()
    assert {"5.0", "6.0  (1.2 ×)", "✕ lost 1 of 4"} <= said.keys()
    assert said["30.0  (6.0 ×)"].get_color() == "#c0392b"  # beyond what the row allows
    assert said["35.0  (3.9 ×)"].get_color() != "#c0392b"
