"""The pictures of docs/how-it-works.md, and what the page says that they show."""

import re
from pathlib import Path

import numpy as np
import pytest

from tools.docs.how_it_works import IMAGES, PICTURES
from tools.docs.pictures import adaptation, constraint, delay, loop, preview
from tools.docs.pictures.model import run, shipped_mpc
from tools.docs.style import LARGEST_BYTES

PAGE = Path(__file__).parents[2] / "docs" / "how-it-works.md"


def test_the_page_shows_every_picture_that_is_made_and_no_other():
    shown = set(re.findall(r"\(images/(how-[\w-]+\.svg)\)", PAGE.read_text(encoding="utf-8")))
    assert shown == {f"how-{name}.svg" for name in PICTURES}
    assert shown == {path.name for path in IMAGES.glob("how-*")}


def test_pictures_are_small_and_say_what_they_show():
    for path in [*IMAGES.glob("how-*.svg"), IMAGES / "architecture.svg"]:
        assert 5_000 < path.stat().st_size <= LARGEST_BYTES, path
        assert "<dc:description>" in path.read_text(encoding="utf-8"), path


@pytest.mark.parametrize("draw", [loop.draw, constraint.draw, preview.draw])
def test_a_picture_is_the_same_each_time(draw, tmp_path):
    first = [path.read_bytes() for path in draw(tmp_path)]
    assert [path.read_bytes() for path in draw(tmp_path)] == first


def test_l1_brings_the_vehicle_back_from_a_gust_front_and_without_it_it_stays_blown_off():
    adapted, frozen = (adaptation.blown_east_m(data) for data in adaptation.flights())
    time_s, east_m = adapted
    assert 0.10 < east_m.max() < 0.16
    assert np.abs(east_m[time_s > 2.0]).max() < 0.03
    time_s, east_m = frozen
    assert 0.2 < east_m[time_s > 2.0].mean() < 0.3


def test_the_solver_makes_ten_centimetres_of_thirty_beyond_the_fence():
    free, walled = constraint.plans()
    farthest = [max(plan.position_m[0] for plan in made) for made in (free, walled)]
    assert farthest[0] == pytest.approx(0.8, abs=0.02)
    assert farthest[1] == pytest.approx(0.6, abs=0.02)
    plan, closed_form = constraint.shown_plan(walled)
    assert plan.record.status == "solved"
    assert closed_form[-1, 0] > plan.predicted_m[-1, 0] + 0.08


def test_before_a_corner_the_reference_jumps_back_while_the_closed_form_still_serves():
    made = run(shipped_mpc(), preview._corner, -4.0, 0.0)
    before = min(made, key=lambda plan: abs(plan.time_s + 0.3))
    assert before.plan_m[0, 0] < before.position_m[0] - 0.5
    assert np.abs(before.position_m[0] + 0.8 * 0.3) < 0.06


def test_at_70_ms_of_delay_a_plan_from_the_state_as_measured_swings_and_a_carried_one_holds():
    assert delay.mean_error_mm(40, carried=True) == pytest.approx(37.0, abs=10.0)
    assert delay.mean_error_mm(40, carried=False) > 150.0
