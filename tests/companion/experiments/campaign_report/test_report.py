"""The report of a made-up campaign, whose answers are known; of partial and of bad folders."""

import contextlib
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pyarrow as arrow
import pyarrow.parquet as parquet
import pytest

from companion.commands.report import ReportRequest, run_report
from companion.config.yaml_source import ConfigError
from companion.experiments.campaign_report.read import read_campaign
from companion.experiments.campaign_report.report import make_report
from tests.companion.experiments.campaign_report.folders import (
    CONTROLLER,
    PARAMETERS,
    row,
    rows,
    write_campaign,
)

_VOID = {"meta", "link", "br", "hr", "img", "input"}


class _Page(HTMLParser):
    """Ids, references and text of a page; fails on tags that do not match."""

    def __init__(self, text):
        super().__init__()
        self.open, self.ids, self.references, self.text = [], [], [], ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self._note(dict(attrs))
        if tag not in _VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self._note(dict(attrs))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data

    def _note(self, attributes):
        self.ids += [attributes["id"]] if "id" in attributes else []
        self.references += [attributes[name] for name in ("href", "src") if name in attributes]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    return write_campaign(folder, rows())


@pytest.fixture(scope="module")
def told(folder):
    """The report, its page, what is said on a terminal."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        run_report(ReportRequest(folder))
    page = (folder / "report" / "report.html").read_text(encoding="utf-8")
    return make_report(read_campaign(folder)), page, out.getvalue()


def test_what_decides_is_found_for_each_controller(told):
    found = told[0].sensitivity
    assert found.of("all", "error")[0].parameter == "controller"
    for controller in CONTROLLER.values:
        first, second, *rest = found.of(controller, "error")
        assert (first.parameter, second.parameter) == ("plant.delay_s", "wind")
        assert first.correlation.low > 0.5
        assert not any(one.seen for one in rest)
    assert found.of("pid-l1", "lost")[0].parameter == "plant.delay_s"
    assert not found.of("mpc-l1", "lost")


def test_the_summary_says_who_tracked_where_it_breaks_and_what_hurts(told):
    summary = told[0].summary
    assert "MPC-L1: 80 of 80 flights tracked to the end, 100 % (95.4 … 100 %)" in summary.tracked[0]
    assert "plant.delay_s 0.039 … 0.050" in summary.breaks[1]
    assert "0 of 60 elsewhere" in summary.breaks[1]
    assert summary.hurts[1].startswith("MPC-L1: plant.delay_s hurts most, 0.7")
    assert summary.state == ""


def test_the_page_is_sound_and_needs_nothing_but_itself(told):
    page = _Page(told[1])
    assert len(page.ids) == len(set(page.ids))
    inside = {one[1:] for one in page.references if one.startswith("#")}
    assert inside <= set(page.ids)
    others = {one for one in page.references if not one.startswith("#")}
    assert others == {"groups.parquet", "worst.parquet", "lost.parquet", "sensitivity.parquet"}
    assert "<script" not in told[1]
    assert "prefers-color-scheme: dark" in told[1]


def test_the_page_holds_each_part(told):
    report, text, _ = told
    page = _Page(text)
    for word in ("Did it track?", "Where does it break?", "What hurts most?", "19 aborted"):
        assert word in page.text
    for case in (*report.worst, *report.lost):
        assert case.command in page.text
    assert "the tilt was beyond … for … s" in page.text
    assert {"mean-errors", "max-errors", "against-plant_delay_s", "map-mpc_l1"} <= set(page.ids)
    assert "mean error, mm (logarithmic)" in page.text


def test_the_same_flights_give_the_same_page(tmp_path, capsys):
    folder = write_campaign(tmp_path, rows(4))
    pages = []
    for name in ("one", "other"):
        run_report(ReportRequest(folder, tmp_path / name))
        pages.append((tmp_path / name / "report.html").read_bytes())
    assert pages[0] == pages[1]


def test_a_terminal_of_80_columns_shows_all_but_commands_whole(told):
    lines = told[2].splitlines()
    wide = [line for line in lines if len(line) > 80]
    assert all(line.startswith(("point ", "  companion campaign ", "/")) for line in wide)
    worst = max(told[0].worst, key=lambda case: case.mean_error_m)
    assert f"  {worst.command}" in lines


def test_the_worst_flights_come_with_the_command_that_flies_them(told, folder):
    worst = max(told[0].worst, key=lambda case: case.mean_error_m)
    assert worst.command == (
        f"companion campaign {folder} --point {worst.point} --out {folder}/again/{worst.point}"
    )


def test_tables_hold_numbers_with_their_types(told, folder):
    groups = parquet.read_table(folder / "report" / "groups.parquet").to_pylist()
    of_pid = next(
        g for g in groups if g["by"] == "controller" and g["param.controller"] == "pid-l1"
    )
    assert (of_pid["flights"], of_pid["lost"]) == (80, 19)
    assert of_pid["mean_error_p99_m"] == float("inf")
    lost = parquet.read_table(folder / "report" / "lost.parquet")
    assert lost.num_rows == 19
    assert lost.schema.field("param.plant.mass").type == arrow.float64()
    assert lost.schema.field("param.wind").type == arrow.string()
    shares = parquet.read_table(folder / "report" / "sensitivity.parquet").to_pylist()
    assert {one["group"] for one in shares} == {"all", "mpc-l1", "pid-l1"}


def test_json_is_one_object_and_nothing_else(tmp_path, capsys):
    folder = write_campaign(tmp_path, rows(16))
    run_report(ReportRequest(folder, json_output=True))
    said = json.loads(capsys.readouterr().out)
    assert said["counts"] == {"planned": 32, "flown": 32, "lost": len(said["lost"]), "unflown": 0}
    assert len(said["lost"]) > 0
    assert said["lost"][0]["mean_error_m"] is None
    assert {"groups", "worst", "sensitivity", "summary", "remarks"} <= said.keys()
    assert all((folder / "report" / Path(name).name).is_file() for name in said["files"])


def test_a_campaign_that_is_not_finished_says_so(tmp_path, capsys):
    made = rows(8)
    made[3] = row(3, {p.name: made[3][f"param.{p.name}"] for p in PARAMETERS}, 0.0, lost=True,
                  outcome="failed", note="RuntimeError: no such plant")  # fmt: skip
    run_report(ReportRequest(write_campaign(tmp_path, made, planned=50)))
    said = re.sub(r"\s+", " ", capsys.readouterr().out)
    assert "Not finished: 16 of 50 flights have ended." in said
    assert "1 flight could not be flown by the program" in said
    assert "Too few flights" in said
    page = _Page((tmp_path / "report" / "report.html").read_text(encoding="utf-8"))
    assert "RuntimeError: no such plant" in page.text
    assert "34 missing" in page.text


def test_rows_that_are_in_the_journal_alone_count(tmp_path):
    made = rows(10)
    write_campaign(tmp_path, made[:12], planned=20)
    extra = {"peak_height_error_m": None, "reported_peak_height_error_m": None, "event": "",
             "event_s": None}  # fmt: skip
    lines = [
        json.dumps({k: None if v != v else v for k, v in (one | extra).items()}) for one in made
    ]
    (tmp_path / "journal.jsonl").write_text("\n".join(lines) + '\n{"point": 99', encoding="utf-8")
    campaign = read_campaign(tmp_path)
    assert len(campaign.flights) == 20
    assert campaign.missing == 0


def test_one_lost_flight_alone_has_a_report(tmp_path, capsys):
    made = [one for one in rows() if one["outcome"] == "aborted"][:1]
    run_report(ReportRequest(write_campaign(tmp_path, made, planned=1)))
    said = capsys.readouterr().out
    assert "0 of 1 flight tracked" in said
    assert "The one flight was lost." in said


def test_one_flight_of_which_nothing_varies_is_told_without_an_empty_place(tmp_path, capsys):
    run_report(ReportRequest(write_campaign(tmp_path, rows()[:1])))
    lines = capsys.readouterr().out.splitlines()
    assert any("1 of 1 flight tracked" in line for line in lines)
    (point,) = (line for line in lines if line.startswith("point 0"))
    assert point.rstrip().endswith(" mm")


def _other_parquet(folder):
    parquet.write_table(arrow.table({"point": [1], "name": ["a"]}), folder / "results.parquet")


def _wrong_types(folder):
    table = parquet.read_table(folder / "results.parquet")
    place = table.column_names.index("mean_error_m")
    wrong = arrow.array(["far"] * table.num_rows)
    parquet.write_table(table.set_column(place, "mean_error_m", wrong), folder / "results.parquet")


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda f: (f / "campaign.json").unlink(), "it holds no campaign.json"),
        (lambda f: (f / "campaign.json").write_text("[]"), "not what a campaign writes"),
        (lambda f: (f / "results.parquet").unlink(), "it is missing, and journal.jsonl too"),
        (lambda f: (f / "results.parquet").write_bytes(b"PAR1"), "no readable Parquet file"),
        (_other_parquet, "it has no column key, outcome"),
        (_wrong_types, "a column is of another type"),
        (lambda f: write_campaign(f, []), "no flight has ended yet"),
    ],
)
def test_a_bad_folder_is_refused_with_what_is_wrong(tmp_path, spoil, said):
    write_campaign(tmp_path, rows(2))
    spoil(tmp_path)
    with pytest.raises(ConfigError, match=re.escape(said)):
        read_campaign(tmp_path)


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="no such folder"):
        read_campaign(tmp_path / "nowhere")
