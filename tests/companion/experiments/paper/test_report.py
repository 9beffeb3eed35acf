"""report.html: everything is on it, it needs nothing but itself, and it is sound HTML."""

import html
import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from companion.experiments.paper.figures.registry import DRAWINGS
from companion.experiments.paper.figures.render import draw_figures
from companion.experiments.paper.report import write_report
from companion.experiments.paper.scale import FULL, QUICK
from companion.experiments.paper.statistics import lost_text, millimetres, spread
from companion.report.pages.inline_svg import inline_svg
from companion.report.pages.style import DARK, INK
from tests.companion.experiments.paper.factory import make_claims, make_results, with_losses

_VOID = {"meta", "link", "br", "hr", "img", "input", "col", "source", "wbr"}


class _Page(HTMLParser):
    """Tags, ids, references and text of a page; fails on tags that do not match."""

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: list[str] = []
        self.references: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []

    def handle_starttag(self, tag, attrs):
        self._note(tag, attrs)
        if tag not in _VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self._note(tag, attrs)

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    def _note(self, tag, attrs):
        attributes = dict(attrs)
        self.tags.append((tag, attributes))
        if "id" in attributes:
            self.ids.append(attributes["id"])
        self.references += [
            value for key, value in attrs if key in ("href", "src", "xlink:href", "srcset", "data")
        ]


def _write(results, folder):
    figures = draw_figures(results, folder)
    return write_report(results, make_claims(), figures, folder).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    return folder, _write(make_results(FULL), folder)


@pytest.fixture(scope="module")
def page(study):
    parsed = _Page()
    parsed.feed(study[1])
    parsed.close()
    return parsed


@pytest.fixture(scope="module")
def lost(tmp_path_factory):
    return _write(with_losses(make_results(QUICK)), tmp_path_factory.mktemp("lost"))


def test_tags_are_balanced_and_ids_are_unique(page):
    assert page.open == []
    assert len(page.ids) == len(set(page.ids))


def test_references_inside_the_page_lead_somewhere(page, study):
    inside = {reference[1:] for reference in page.references if reference.startswith("#")}
    inside |= set(re.findall(r"url\(#([^)]+)\)", study[1]))
    assert inside
    assert inside <= set(page.ids)


def test_nothing_is_fetched_from_anywhere(study):
    assert not re.search(r"https?:|//[a-z]+\.|@import|url\((?!#)", study[1])


def test_links_lead_to_files_of_the_study(page, study):
    outside = [reference for reference in page.references if not reference.startswith("#")]
    not_written_here = {"results.json", "flights/"}
    assert not_written_here < set(outside)
    for reference in set(outside) - not_written_here:
        assert (study[0] / reference).is_file()


def test_every_figure_is_there_with_caption_description_and_files(page, study):
    drawings = [attributes for tag, attributes in page.tags if tag == "svg"]
    assert len(drawings) == len(DRAWINGS)
    assert all(attributes["role"] == "img" for attributes in drawings)
    results = make_results(FULL)
    for one, attributes in zip(DRAWINGS, drawings, strict=True):
        assert attributes["aria-label"].startswith(one.title)
        assert one.caption(results) in html.unescape(study[1])
        assert f"figures/{one.name}.png" in page.references
        assert f"figures/{one.name}.svg" in page.references


def test_every_claim_is_there_with_its_verdict_in_words(page, study):
    text = "".join(page.text)
    for claim in make_claims():
        for part in (claim.quote, claim.figures, claim.rule, claim.reason):
            assert part in text
    verdicts = re.findall(r'class="verdict ([a-z-]+)"><span[^>]*>.</span> ([a-z ]+)<', study[1])
    assert verdicts == [(c.verdict.replace(" ", "-"), c.verdict) for c in make_claims()]


def test_what_a_claim_quotes_is_no_markup(study):
    assert "<b>bounded</b>" not in study[1]


def test_the_summary_gives_the_means_and_their_ratios(page):
    text = "".join(page.text)
    errors = make_results(FULL).tracking.errors
    own, pid = errors["mpc-l1"]["calm"].mean, errors["pid-l1"]["calm"].mean
    assert f"{own.mean * 1e3:.1f} ± {own.std * 1e3:.1f} mm in calm air" in text
    assert f"PID-L1 makes {pid.mean / own.mean:.0f}\u00a0×" in text
    recipe, whole = (
        errors[name]["fan"].mean.mean / errors["mpc-l1"]["fan"].mean.mean
        for name in ("mpc-pid", "mpc-pid-joint")
    )
    assert (
        f"With the fan, MPC-PID by the paper's recipe makes {recipe:.2f}\u00a0×, "
        f"tuned as a whole {whole:.2f}\u00a0× its error; PID-L1 makes"
    ) in text


def test_the_summary_tells_of_a_recipe_that_chatters_and_else_does_not(study, tmp_path):
    assert "chatters, as" not in study[1]
    results = make_results(QUICK)
    errors = {c: dict(by_wind) for c, by_wind in results.tracking.errors.items()}
    errors["mpc-pid"]["calm"] = replace(errors["mpc-pid"]["calm"], tilt_slew_g_s=spread([4.1]))
    results = replace(results, tracking=replace(results.tracking, errors=errors))
    text = write_report(results, make_claims(), [], tmp_path).read_text(encoding="utf-8")
    assert "tilt command moves at 4.10 g/s rms in calm air, that of MPC-L1 at 0.40 g/s" in text


def test_the_summary_leaves_out_who_was_lost(tmp_path):
    results = make_results(QUICK)
    errors = {c: dict(by_wind) for c, by_wind in results.tracking.errors.items()}
    errors["mpc-pid"]["calm"] = replace(errors["mpc-pid"]["calm"], mean=spread([math.inf]))
    errors["mpc-l1"]["fan"] = replace(errors["mpc-l1"]["fan"], mean=spread([math.inf]))
    results = replace(results, tracking=replace(results.tracking, errors=errors))
    text = write_report(results, make_claims(), [], tmp_path).read_text(encoding="utf-8")
    assert "In calm air, MPC-PID tuned as a whole makes" in text
    assert "with the fan it did not fly all five to their end." in text
    assert "With the fan, MPC-PID" not in text


def test_the_table_of_errors_has_every_cell(page):
    text = "".join(page.text)
    for by_wind in make_results(FULL).tracking.errors.values():
        for errors in by_wind.values():
            for cell in (*errors.by_trajectory.values(), errors.mean):
                assert f"{cell.mean * 1e3:.1f} ± {cell.std * 1e3:.1f}" in text


def test_the_table_of_errors_has_a_row_group_for_each_controller(study):
    table = study[1][study[1].index('<table class="figures many">') :]
    groups = re.findall(r"<tbody>(.*?)</tbody>", table[: table.index("</table>")], re.DOTALL)
    assert len(groups) == len(make_results(FULL).tracking.errors)
    for group in groups:
        assert group.count('<th scope="rowgroup" rowspan="2">') == 1
        assert re.findall(r'<th scope="row">([a-z]+)</th>', group) == ["calm", "fan"]


def test_whatever_scrolls_is_reached_by_keys_and_has_a_name(page):
    for kind in ("wide", "drawing"):
        boxes = [a for tag, a in page.tags if tag == "div" and a.get("class") == kind]
        assert boxes
        for box in boxes:
            assert box["tabindex"] == "0"
            assert box["role"] in ("region", "group")
            assert box.get("aria-label") or box["aria-labelledby"] in page.ids


def test_tables_stay_tables_on_a_small_screen(study):
    rules = re.findall(r"([^{}]*)\{[^{}]*display:\s*block", study[1][: study[1].index("</style>")])
    assert not any(re.search(r"\b(t[dhr]|tbody|table)\b|claims", rule) for rule in rules)


def test_it_says_where_it_comes_from(page):
    text = "".join(page.text)
    provenance = make_results(FULL).provenance
    for said in (provenance.command, provenance.commit, provenance.machine, provenance.date):
        assert said in text
    assert "137" in text
    assert "71 s" in text


def test_lost_flights_are_said_and_nothing_is_nan(lost):
    assert "MPC-L1 did not fly all five trajectories to their end" in lost
    assert ">lost<" in lost
    assert not re.search(r"\b(nan|inf)\b", lost)


def test_one_seed_claims_no_spread(lost):
    assert "no spread is claimed" in lost
    table = lost[lost.index('id="errors"') : lost.index('id="figures"')]
    assert "±" not in table


def test_a_spread_is_told_with_what_is_known_of_it():
    assert millimetres(spread([0.02, 0.03])) == "25.0 ± 7.1"
    assert millimetres(spread([0.02]), " mm") == "20.0 mm"
    assert millimetres(spread([0.02, math.inf, 0.03]), " mm") == "lost 1 of 3"
    assert millimetres(spread([math.nan])) == "lost"
    assert lost_text(spread([])) == "–"


def test_colours_of_the_figures_follow_the_page(study):
    variable = f"--figure-{INK[1:]}"
    assert f"{variable}: {INK};" in study[1]
    assert f"{variable}: {DARK[INK]};" in study[1]
    drawings = study[1][study[1].index("<svg") :]
    assert f"var({variable})" in drawings
    assert not any(colour in drawings for colour in DARK)


def test_a_file_without_an_svg_element_is_refused():
    with pytest.raises(ValueError, match="bounds"):
        inline_svg("<html></html>", "bounds", "")
