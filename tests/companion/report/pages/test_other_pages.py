"""Pages of a comparison, the paper, a campaign and the table of faults share one look."""

import contextlib
import io
import math
from dataclasses import replace

import pytest

from companion.commands.faults import FaultsRequest, run_faults
from companion.commands.report import ReportRequest, run_report
from companion.experiments.paper.glance import study_glance
from companion.experiments.paper.headline import mean_errors
from companion.experiments.paper.scale import QUICK
from companion.report.compare_figure import draw_comparison
from companion.report.compare_page.glance import comparison_glance
from companion.report.compare_page.page import write_page
from companion.report.pages.glance import Glance, worst
from companion.report.recovery_cell import RecoveryCell
from tests.companion.experiments.campaign_report.folders import rows, write_campaign
from tests.companion.experiments.faults import made_up
from tests.companion.experiments.paper.factory import make_claims, make_results
from tests.companion.report.pages.sound_page import check_page
from tests.companion.report.synthetic_comparison import ERRORS_MM, NOMINAL, comparison

EVENT = RecoveryCell(
    "mpc-l1", "drop", "nominal", "payload dropped", 2, 0.04, 0.05, 0.4, math.inf, 1
)


def compare_page(folder, made, pictures=()):
    (folder / "compare.json").write_text("{}")
    (folder / "flights").mkdir()
    draw_comparison(made, folder / "compare.png")
    for name in pictures:
        (folder / name).write_bytes((folder / "compare.png").read_bytes())
    return check_page(write_page(made, [folder / name for name in pictures], folder))


def test_a_comparison_says_who_tracks_best_what_was_lost_and_what_is_not_borne(tmp_path):
    page = compare_page(tmp_path, replace(comparison(), recoveries=(EVENT,)), ["recovery-drop.png"])
    assert set(page.links) == {"compare.json", "compare.png", "flights/", "recovery-drop.png"}
    assert (
        "46 of 48 flights tracked to the end; 5.0 mm on average by mpc-l1-plus (calm; mpc-l1 4.0 × "
        "as much); 9.0 mm on average by mpc-l1-plus (fan; mpc-l1 3.6 × as much)."
    ) in page.said
    assert "1 of 4 lost: mpc-l1, calm, attitude lag + 50 %: The geofence was left." in page.said
    assert (
        "mpc-l1-plus, calm, attitude lag + 50 %: 6.0 × its error on the nominal vehicle, more than "
        "4 ×."
    ) in page.said
    assert "payload dropped" in page.text
    assert "companion compare" in page.text


def test_a_comparison_of_which_nothing_was_lost_is_green_and_one_that_lost_all_is_red():
    calm = {key: errors[:1] for key, errors in ERRORS_MM.items()}
    good = comparison_glance(comparison(calm, (NOMINAL,)))
    assert good.level == "good"
    assert good.sentence.startswith("All 16 flights tracked to the end; 5.0 mm")
    alone = comparison_glance(comparison({("mpc-l1", "calm"): (20.0,)}, (NOMINAL,)))
    assert alone.sentence.endswith("20.0 mm on average by mpc-l1 (calm).")


def test_the_page_of_faults_names_the_rows_that_did_not_end_as_promised(tmp_path):
    request = FaultsRequest(only=("delay", "jitter"), jobs=1, out=tmp_path)
    with contextlib.redirect_stdout(io.StringIO()):
        run_faults(request, made_up.verdict)
    page = check_page(tmp_path / "faults.html")
    assert "0 of 2 rows ended as promised; not so: delay, jitter." in page.said
    assert "delay (ardupilot): the trajectory was not flown to its end" in page.said
    assert page.links == ["faults.json"]


def test_the_page_of_faults_that_all_passed_is_green(tmp_path):
    request = FaultsRequest(only=("delay", "jitter"), autopilot="px4", jobs=1, out=tmp_path)
    with contextlib.redirect_stdout(io.StringIO()):
        run_faults(request, made_up.verdict)
    page = check_page(tmp_path / "faults.html")
    assert "All 2 rows ended as promised." in page.said
    assert "glance good" in page.source


def test_the_page_of_a_campaign_says_how_many_tracked_the_worst_and_what_hurts(tmp_path):
    write_campaign(tmp_path, rows(40))
    with contextlib.redirect_stdout(io.StringIO()):
        run_report(ReportRequest(tmp_path))
    page = check_page(tmp_path / "report" / "report.html")
    flown = [one for one in rows(40) if math.isfinite(one["mean_error_m"])]
    assert f"{len(flown)} of {len(rows(40))} flights tracked to the end" in page.said
    worst_mm = 1e3 * max(one["mean_error_m"] for one in flown)
    assert f"the worst of these had a mean error of {worst_mm:.1f} mm" in page.said
    assert "plant.delay_s hurts most." in page.said


def test_the_paper_says_how_many_claims_were_reproduced_and_which_were_not():
    results, claims = make_results(QUICK), make_claims()
    glance = study_glance(results, claims, mean_errors(results))
    assert glance.level == "half"
    assert glance.sentence.startswith(
        "1 of the paper's 4 claims was reproduced (1 partly, 1 not reproduced, 1 not tested); "
        "MPC-L1 tracks to 22.4 mm in calm air"
    )
    assert len(glance.reasons) == 1
    assert claims[2].quote in glance.reasons[0]
    good = [claim for claim in claims if claim.verdict == "reproduced"]
    assert study_glance(results, good, mean_errors(results)).level == "good"


@pytest.mark.parametrize(
    ("levels", "of_all"), [((), "none"), (("good", "none"), "good"), (("half", "bad"), "bad")]
)
def test_the_weightiest_level_counts(levels, of_all):
    assert worst(levels) == of_all
    assert Glance(of_all, "x").mark in "✓!✗–"
