"""`companion paper`: what it writes and tells, and how it ends when it can't."""

import json

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.commands import paper as paper_command
from companion.experiments.campaign import CampaignInterruptedError
from companion.experiments.flight_store import MissingExtraError
from companion.experiments.paper.figures.registry import DRAWINGS
from tests.companion.experiments.paper.factory import make_results


def paper(*options):
    return CliRunner().invoke(app, ["paper", *options])


def flown(monkeypatch, end=make_results):
    """Lets the study end at once; gives what it was asked for."""
    asked = []

    def run_study(scale, folder, jobs, command, progress=None, say=None):
        asked.append((scale.name, folder, jobs))
        return end(scale)

    monkeypatch.setattr(paper_command, "run_study", run_study)
    return asked


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_writes_the_page_the_figures_and_the_numbers_and_tells_both_tables(monkeypatch, here):
    asked = flown(monkeypatch)

    said = paper("--quick", "--out", "study", "--jobs", "1")

    assert said.exit_code == 0, said.output
    assert [(name, str(folder), jobs) for name, folder, jobs in asked] == [("quick", "study", 1)]
    page = (here / "study" / "report.html").read_text(encoding="utf-8")
    for drawing in DRAWINGS:
        assert f'id="{drawing.name}"' in page
        for suffix in ("png", "svg"):
            assert (here / "study" / "figures" / f"{drawing.name}.{suffix}").stat().st_size > 1000
    numbers = json.loads((here / "study" / "results.json").read_text(encoding="utf-8"))
    cell = numbers["tracking"]["errors"]["mpc-l1"]["fan"]["by_trajectory"]["5"]
    assert {"mean_m", "std_m", "seeds"} <= set(cell)
    for told in ("Mean tracking error", "mpc-pid-joint", "The paper's claims", "report.html"):
        assert told in said.stdout


def test_help_names_the_options_and_what_the_exit_status_means():
    said = CliRunner().invoke(app, ["paper", "--help"], env={"COLUMNS": "200", "NO_COLOR": "1"})
    assert said.exit_code == 0
    for option in ("--quick", "--out", "--jobs", "report.html", "4 interrupted"):
        assert option in said.stdout


def test_without_a_folder_the_same_command_finds_the_same_one(monkeypatch):
    def interrupted(_):
        raise CampaignInterruptedError("before anything is drawn")

    asked = flown(monkeypatch, interrupted)
    paper("--quick", "--jobs", "1")
    paper("--jobs", "1")
    assert [str(folder) for _, folder, _ in asked] == ["paper-quick", "paper"]


def test_an_interrupt_says_how_to_go_on(monkeypatch):
    def interrupted(_):
        raise CampaignInterruptedError("interrupted: 3 of 9 flights are kept in study.")

    flown(monkeypatch, interrupted)
    said = paper("--quick", "--out", "study")
    assert said.exit_code == 4
    assert "error: interrupted: 3 of 9 flights are kept in study." in said.stderr


def test_a_missing_library_is_told_with_its_remedy_before_anything_is_flown(monkeypatch, here):
    def missing():
        raise MissingExtraError("pyarrow is missing: pip install 'companion[study]'")

    asked = flown(monkeypatch)
    monkeypatch.setattr(paper_command, "need_pyarrow", missing)
    said = paper("--quick")
    assert said.exit_code == 2
    assert "companion[study]" in said.stderr
    assert asked == []
    assert list(here.iterdir()) == []


def test_a_folder_that_is_a_file_is_bad_input(monkeypatch, here):
    flown(monkeypatch)
    (here / "study").write_text("")
    said = paper("--out", "study")
    assert said.exit_code == 2
    assert "study" in said.stderr
    assert "Traceback" not in said.output
