"""Figures: each draws, whole study or quick look, with losses or without, and is captioned."""

import math
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from companion.config.resolve import load_flight
from companion.experiments.paper.figures import render
from companion.experiments.paper.figures.bars import bar_of
from companion.experiments.paper.figures.bounds import SPEED_LIMIT_M_S
from companion.experiments.paper.figures.errors_fan import increase
from companion.experiments.paper.figures.registry import DRAWINGS, drawing
from companion.experiments.paper.figures.render import draw_figures, draw_one
from companion.experiments.paper.origin import CostFigures
from companion.experiments.paper.scale import FULL, QUICK, VEHICLE
from companion.experiments.paper.statistics import spread
from companion.report.pages.style import COLOURS, DARK, SETTINGS, percent, smooth, thin
from tests.companion.experiments.paper.factory import make_results, with_losses

_LARGEST_SVG_BYTES = 400_000
_STUDIES = {
    "whole": make_results(FULL),
    "quick": make_results(QUICK),
    "lost": with_losses(make_results(FULL)),
    "quick and lost": with_losses(make_results(QUICK)),
}


def _texts(name, results):
    """All that is written in a figure."""
    with mpl.rc_context(SETTINGS):
        figure = drawing(name).draw(results)
        figure.draw_without_rendering()
    return [text.get_text() for text in figure.findobj(mpl.text.Text) if text.get_visible()]


@pytest.mark.parametrize("study", ["whole", "quick", "quick and lost"])
@pytest.mark.parametrize("name", [one.name for one in DRAWINGS])
def test_every_figure_draws_and_is_captioned(name, study, tmp_path):
    (tmp_path / "figures").mkdir()
    drawn = draw_one(_STUDIES[study], name, tmp_path)
    assert drawn.png.read_bytes().startswith(b"\x89PNG")
    svg = drawn.svg.read_text(encoding="utf-8")
    assert ElementTree.fromstring(svg).tag.endswith("svg")
    assert len(svg.encode()) < _LARGEST_SVG_BYTES
    assert len(drawn.caption) > 40
    assert not re.search(r"\b(nan|inf)\b", drawn.caption)


def test_the_registry_has_the_figures_of_the_paper_once_each():
    names = [one.name for one in DRAWINGS]
    assert len(set(names)) == len(names) == 12
    assert {"trajectories", "bounds", "errors_feedback", "errors_fan", "adaptation_rate"} < set(
        names
    )


def test_a_figure_is_the_same_whoever_draws_it(tmp_path, monkeypatch):
    results = _STUDIES["quick"]
    monkeypatch.setattr(render, "DRAWINGS", tuple(drawing(name) for name in ("origin", "bounds")))
    monkeypatch.setattr(render, "_PAYS_FROM", 2)
    alone = draw_figures(results, tmp_path / "a", jobs=1)
    together = draw_figures(results, tmp_path / "b", jobs=2)
    assert [one.name for one in alone] == ["origin", "bounds"]
    for one, other in zip(alone, together, strict=True):
        assert (one.name, one.title, one.caption) == (other.name, other.title, other.caption)
        assert one.svg.read_bytes() == other.svg.read_bytes()


def test_letters_in_an_svg_are_letters_and_nothing_is_fetched(tmp_path):
    (tmp_path / "figures").mkdir()
    svg = draw_one(_STUDIES["quick"], "errors_feedback", tmp_path).svg.read_text(encoding="utf-8")
    assert ">mean error in calm air, mm<" in svg
    assert not re.search(r'href="(?!#)', svg)


def test_drawing_leaves_the_settings_of_matplotlib_alone(tmp_path):
    (tmp_path / "figures").mkdir()
    before = dict(mpl.rcParams)
    draw_one(_STUDIES["quick"], "origin", tmp_path)
    assert dict(mpl.rcParams) == before


def test_every_controller_has_a_colour_of_its_own_and_each_has_a_dark_shade():
    assert len(set(COLOURS.values())) == len(COLOURS)
    assert set(COLOURS.values()) <= set(DARK)
    assert len(set(DARK.values())) == len(DARK)


def test_bars_carry_their_values_and_the_ratio_to_mpc_l1():
    results = _STUDIES["whole"]
    texts = _texts("errors_feedback", results)
    errors = results.tracking.errors
    pid, mpc = (errors[name]["calm"].mean.mean for name in ("pid-l1", "mpc-l1"))
    assert f"{pid / mpc:.1f}×\n{pid * 1e3:.0f}" in texts
    assert f"{mpc * 1e3:.1f}" in texts


def test_one_seed_has_no_whisker_and_five_have():
    assert np.isnan(bar_of(spread([0.02]), 1e3).spread)
    assert bar_of(spread([0.02, 0.04]), 1e3).spread == pytest.approx(np.sqrt(2.0) * 10.0)
    assert "no spread is claimed" in drawing("errors_feedback").caption(_STUDIES["quick"])
    assert "5 seeds" in drawing("errors_feedback").caption(_STUDIES["whole"])


def test_lost_flights_are_named_and_counted():
    assert "lost 5 of 5" in _texts("errors_fan", _STUDIES["lost"])
    assert "lost" in _texts("errors_fan", _STUDIES["quick and lost"])
    assert _texts("model_transfer", _STUDIES["lost"]).count("lost") == 2


def test_what_the_fan_adds_is_taken_seed_by_seed():
    results = _STUDIES["whole"]
    calm, fan = (results.tracking.errors["mpc-l1"][wind] for wind in ("calm", "fan"))
    added = increase(results, "mpc-l1")
    differences = np.array(fan.by_trajectory[1].values) - np.array(calm.by_trajectory[1].values)
    assert added[0].mean == pytest.approx(differences.mean())
    assert added[0].std == pytest.approx(differences.std(ddof=1))
    assert added[-1].mean == pytest.approx(fan.mean.mean - calm.mean.mean)


def test_a_far_bound_is_drawn_and_said_with_its_distance():
    results = _STUDIES["whole"]
    exact, noisy = (
        0.9 / np.abs(results.bounds[name].y_tilde_m_s[:, 0]).max() for name in ("exact", "noisy")
    )
    texts = _texts("bounds", results)
    assert "bound γ0 = ±0.9 m/s" in texts
    ratios = f"{noisy:.0f} × with noise, {exact:.0f} × noise-free"
    assert f"γ0 over the largest |ỹ|: {ratios}" in texts
    caption = drawing("bounds").caption(results)
    assert f"Noise-free, the largest |ỹ| is {100 / exact:.1f} % (x)" in caption
    assert f"With noise, the largest |ỹ| is {100 / noisy:.1f} % (x)" in caption


def test_a_bound_that_no_flight_could_reach_is_said_to_be_no_test():
    results = _STUDIES["whole"]
    assert "no test" not in drawing("bounds").caption(results)
    wide = replace(results.guarantees, gamma_0_m_s=np.array([4.2, 4.2, 1.8]))
    caption = drawing("bounds").caption(replace(results, guarantees=wide))
    assert "On x and y γ0 is beyond the vehicle's speed limit of 3 m/s" in caption
    config = load_flight(None, {"controller": "mpc-l1", "vehicle": VEHICLE}, {})
    assert config.vehicle.speed_limit_m_s == SPEED_LIMIT_M_S


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0.00 %"),
        (9.2e-8, "less than 0.01 %"),
        (0.00067, "0.07 %"),
        (0.0174, "1.7 %"),
        (0.0996, "10 %"),
        (1.383, "138 %"),
        (-0.5, "−50 %"),
    ],
)
def test_a_share_is_told_without_powers_of_ten(share, text):
    assert percent(share) == text


def test_moving_the_origin_is_told_in_plain_figures_and_which_cost_does_better_where():
    results = _STUDIES["whole"]
    costs = {
        "r_minus_target": CostFigures(0.0207, 0.0207 * (1.0 + 1e-7), 0.0007),
        "absolute_r": CostFigures(0.0127, 0.0303, 0.0278),
    }
    caption = drawing("origin").caption(replace(results, origin=costs))
    assert "error by less than 0.01 %" in caption
    assert "error by 139 %" in caption
    assert not re.search(r"\de[-+]\d", caption)
    assert "About the origin itself the paper's letter does better (12.7 against 20.7" in caption
    assert "moved away from it the paper's letter does worse (30.3 against 20.7" in caption
    costs["absolute_r"] = CostFigures(math.inf, math.inf, math.inf)
    assert "does" not in drawing("origin").caption(replace(results, origin=costs))


def test_the_legend_of_the_adaptation_rate_leaves_its_title_alone():
    with mpl.rc_context(SETTINGS):
        figure = drawing("adaptation_rate").draw(_STUDIES["whole"])
        FigureCanvasAgg(figure)
        figure.draw_without_rendering()
        axes = figure.axes[0]
        legend = axes.get_legend().get_window_extent()
        (title,) = [t for t in axes.findobj(mpl.text.Text) if t.get_text().startswith("largest")]
        assert not legend.overlaps(title.get_window_extent())
        assert len(axes.get_legend().get_texts()) == 6


def test_a_bound_whose_conditions_fail_is_said_to_be_none():
    results = _STUDIES["whole"]
    none = replace(results.guarantees, gamma_0_m_s=np.full(3, np.inf))
    assert "no bound γ0: the conditions do not hold" in _texts(
        "bounds", replace(results, guarantees=none)
    )


def test_the_fitted_line_goes_through_the_points_of_the_fit_and_no_others():
    results = _STUDIES["whole"]
    sweep = results.adaptation_rate
    with mpl.rc_context(SETTINGS):
        lines = drawing("adaptation_rate").draw(results).axes[0].get_lines()
    (line,) = [one for one in lines if one.get_label() == "slope −0.90"]
    fitted = sweep.gammas[sweep.fitted]
    assert line.get_xdata() == pytest.approx([fitted.min(), fitted.max()])
    # The data of the factory lie on that very line, but for the first point, which is not fitted.
    ends = sweep.exact_m_s[sweep.fitted, 0][[0, -1]] * 1e3
    assert line.get_ydata() == pytest.approx(ends)
    assert "fitted from Γ = 150 to 1000" in drawing("adaptation_rate").caption(results)


def test_the_lag_is_stated_beside_each_controller():
    texts = _texts("time_response", _STUDIES["whole"])
    assert "PID-L1, 0.30 s late" in texts
    assert "MPC-L1, 0.02 s late" in texts


def test_without_casadi_the_figure_says_how_to_get_it():
    texts = _texts("computing_time", _STUDIES["lost"])
    assert any("install companion[nonlinear]" in text for text in texts)


def test_thinning_keeps_the_extremes_and_the_order():
    times = np.arange(10_000) * 0.01
    values = np.sin(times)
    values[5_000] = 9.0
    values[7] = np.nan
    kept_times, kept = thin(times, values)
    assert len(kept) <= 900
    assert kept.max() == 9.0
    assert kept.min() == np.nanmin(values)
    assert (np.diff(kept_times) > 0.0).all()


def test_the_moving_mean_looks_back_only():
    times = np.arange(1_000) * 0.01
    step = (times >= 5.0).astype(float)
    mean = smooth(times, step, 0.5)
    assert (mean[times < 5.0] == 0.0).all()
    assert mean[times >= 5.5] == pytest.approx(1.0)
